//! One call: time limit, size limit, retries, named failures.

use std::io::ErrorKind;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use super::wire::{ChatRequest, ChatResponse, Message, ResponseFormat};

/// Where a model is and how it is called.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelConfig {
    /// Address up to and without `/chat/completions`, as in
    /// `http://127.0.0.1:8000/v1`.
    pub base_url: String,
    /// The model's name on the server.
    pub model: String,
    /// Environment variable that holds the key; none for a local server.
    pub key_variable: Option<String>,
    /// Time limit of an attempt, ms.
    pub attempt_ms: u64,
    /// Attempts in all, 1 or more.
    pub attempts: u32,
    /// Wait before the second attempt, ms; it doubles from there.
    pub back_off_ms: u64,
    /// Longest body of an answer, bytes.
    pub answer_cap_bytes: u64,
    /// Longest answer, tokens.
    pub max_tokens: u32,
}

impl ModelConfig {
    /// A model at `base_url` with default limits: 5 s in all.
    #[must_use]
    pub fn new(base_url: &str, model: &str) -> Self {
        Self {
            base_url: base_url.trim_end_matches('/').to_owned(),
            model: model.to_owned(),
            key_variable: None,
            attempt_ms: 2300,
            attempts: 2,
            back_off_ms: 200,
            answer_cap_bytes: 64 * 1024,
            max_tokens: 512,
        }
    }
}

/// How a call failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ModelError {
    /// No answer in time.
    #[error("no answer within the time limit")]
    Timeout,
    /// The server can't be reached.
    #[error("server can't be reached: {0}")]
    Unreachable(String),
    /// An HTTP error.
    #[error("server answered with status {0}")]
    Status(u16),
    /// A body above the limit.
    #[error("answer is larger than the limit")]
    TooLarge,
    /// No chat completion.
    #[error("answer isn't a chat completion: {0}")]
    Protocol(String),
    /// The answer was cut off at the token limit.
    #[error("answer was cut off")]
    Truncated,
    /// The model declined.
    #[error("model refused")]
    Refused,
    /// The content breaks the agent's schema.
    #[error("answer breaks the schema: {0}")]
    Schema(String),
    /// Nobody waits for it any more.
    #[error("cancelled")]
    Cancelled,
    /// The key's environment variable isn't set.
    #[error("environment variable {0} isn't set: it should hold the model's key")]
    NoKey(String),
}

impl ModelError {
    /// A word for the trace.
    #[must_use]
    pub fn outcome(&self) -> &'static str {
        match self {
            Self::Timeout => "timeout",
            Self::Unreachable(_) => "unreachable",
            Self::Status(_) => "status",
            Self::TooLarge => "too_large",
            Self::Protocol(_) => "protocol",
            Self::Truncated => "truncated",
            Self::Refused => "refused",
            Self::Schema(_) => "schema",
            Self::Cancelled => "cancelled",
            Self::NoKey(_) => "no_key",
        }
    }

    /// True if another attempt may succeed.
    fn is_passing(&self) -> bool {
        match self {
            Self::Unreachable(_) | Self::Timeout => true,
            Self::Status(code) => *code == 429 || *code >= 500,
            _ => false,
        }
    }
}

/// Tells a call that nobody waits for it.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<(Mutex<bool>, Condvar)>);

impl Cancel {
    /// Cancels.
    pub fn cancel(&self) {
        let (flag, wake) = &*self.0;
        *flag.lock().unwrap_or_else(PoisonError::into_inner) = true;
        wake.notify_all();
    }

    /// True once cancelled.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        *self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for `duration`; true if cancelled meanwhile.
    fn wait(&self, duration: Duration) -> bool {
        let (flag, wake) = &*self.0;
        let guard = flag.lock().unwrap_or_else(PoisonError::into_inner);
        let outcome = wake.wait_timeout_while(guard, duration, |cancelled| !*cancelled);
        *outcome.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// A key that doesn't print.
struct Key(String);

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("[key]")
    }
}

/// A model that answers chats.
#[derive(Debug)]
pub struct ChatModel {
    config: ModelConfig,
    agent: ureq::Agent,
    key: Option<Key>,
}

impl ChatModel {
    /// Prepares calls; nothing is sent.
    ///
    /// # Errors
    /// [`ModelError::NoKey`] if the key's variable is named and not set.
    pub fn new(config: ModelConfig) -> Result<Self, ModelError> {
        let key = match &config.key_variable {
            None => None,
            Some(name) => {
                let value = std::env::var(name).map_err(|_| ModelError::NoKey(name.clone()))?;
                Some(Key(value))
            }
        };
        let agent = ureq::Agent::config_builder()
            .timeout_global(Some(Duration::from_millis(config.attempt_ms)))
            .http_status_as_error(false)
            // A redirect could carry the key elsewhere.
            .max_redirects(0)
            .build()
            .into();
        Ok(Self { config, agent, key })
    }

    /// Asks for one JSON object and gives its text, with the attempts made.
    ///
    /// # Errors
    /// [`ModelError`] of the last attempt.
    pub fn ask(
        &self,
        system: &str,
        user: &str,
        png: Option<&[u8]>,
        cancel: &Cancel,
    ) -> (Result<String, ModelError>, u32) {
        let request = ChatRequest {
            model: self.config.model.clone(),
            messages: vec![Message::system(system), Message::user(user.to_owned(), png)],
            temperature: 0.0,
            max_tokens: self.config.max_tokens,
            response_format: ResponseFormat::JSON,
        };
        let body = match serde_json::to_string(&request) {
            Ok(body) => body,
            Err(error) => return (Err(ModelError::Protocol(error.to_string())), 0),
        };
        let mut attempt = 1;
        loop {
            if cancel.is_cancelled() {
                return (Err(ModelError::Cancelled), attempt - 1);
            }
            let outcome = self.attempt(&body);
            let again = matches!(&outcome, Err(error) if error.is_passing());
            if !again || attempt >= self.config.attempts {
                return (outcome, attempt);
            }
            let wait = self
                .config
                .back_off_ms
                .saturating_mul(1 << (attempt - 1).min(10));
            if cancel.wait(Duration::from_millis(wait)) {
                return (Err(ModelError::Cancelled), attempt);
            }
            attempt += 1;
        }
    }

    fn attempt(&self, body: &str) -> Result<String, ModelError> {
        let mut request = self
            .agent
            .post(format!("{}/chat/completions", self.config.base_url))
            .header("content-type", "application/json");
        if let Some(Key(key)) = &self.key {
            request = request.header("authorization", format!("Bearer {key}"));
        }
        let mut response = request.send(body).map_err(transport_error)?;
        let status = response.status().as_u16();
        if status != 200 {
            return Err(ModelError::Status(status));
        }
        let text = response
            .body_mut()
            .with_config()
            .limit(self.config.answer_cap_bytes)
            .read_to_string()
            .map_err(transport_error)?;
        content(&text)
    }
}

fn transport_error(error: ureq::Error) -> ModelError {
    match error {
        ureq::Error::Timeout(_) => ModelError::Timeout,
        ureq::Error::BodyExceedsLimit(_) => ModelError::TooLarge,
        ureq::Error::Io(error) if error.kind() == ErrorKind::TimedOut => ModelError::Timeout,
        ureq::Error::Io(error) if error.kind() == ErrorKind::UnexpectedEof => {
            ModelError::Protocol("the connection ended within the answer".to_owned())
        }
        // The address may hold credentials: only the kind of error is kept.
        ureq::Error::Io(error) => ModelError::Unreachable(error.kind().to_string()),
        ureq::Error::HostNotFound => ModelError::Unreachable("host not found".to_owned()),
        ureq::Error::ConnectionFailed => ModelError::Unreachable("connection failed".to_owned()),
        ureq::Error::BadUri(_) => ModelError::Unreachable("bad address".to_owned()),
        _ => ModelError::Protocol("no HTTP answer".to_owned()),
    }
}

fn content(body: &str) -> Result<String, ModelError> {
    let response: ChatResponse =
        serde_json::from_str(body).map_err(|error| ModelError::Protocol(error.to_string()))?;
    let mut choices = response.choices.into_iter();
    let Some(choice) = choices.next() else {
        return Err(ModelError::Protocol("no choices".to_owned()));
    };
    if choice.message.refusal.is_some() {
        return Err(ModelError::Refused);
    }
    match choice.finish_reason.as_deref() {
        Some("length") => return Err(ModelError::Truncated),
        Some("content_filter") => return Err(ModelError::Refused),
        _ => {}
    }
    choice
        .message
        .content
        .ok_or_else(|| ModelError::Protocol("no content".to_owned()))
}
