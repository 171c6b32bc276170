//! A local server that speaks the OpenAI-compatible protocol, well or badly:
//! for tests, and to try a set-up without a model.
//!
//! It checks what it is asked as a real server does: method, path, JSON,
//! `model`, `messages`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Value, json};

/// What the server does with a request.
#[derive(Clone, Debug)]
pub enum Manner {
    /// A completion with this content.
    Content(String),
    /// This body, whatever it is.
    Body(String),
    /// This status.
    Status(u16),
    /// A completion with this content, but only after a while.
    Slow(Duration, String),
    /// No answer until the server is released; the connection stays open.
    Hang,
    /// A completion of this many characters.
    Huge(usize),
    /// A body shorter than announced.
    Cut,
    /// 503 once, then a completion with this content.
    Recovers(String),
    /// To another address.
    Redirect,
}

/// A request as it came.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The value of `authorization`, if there was one.
    pub authorization: Option<String>,
    /// The body.
    pub body: Value,
}

#[derive(Debug, Default)]
struct Shared {
    asked: Mutex<Vec<Asked>>,
    released: (Mutex<bool>, Condvar),
}

/// A running server; its threads end with the process.
#[derive(Clone, Debug)]
pub struct StandIn {
    url: String,
    shared: Arc<Shared>,
}

impl StandIn {
    /// Starts on a free port of the loopback.
    ///
    /// # Errors
    /// If no port can be had.
    pub fn start(manner: Manner) -> std::io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let url = format!("http://{}/v1", listener.local_addr()?);
        let shared = Arc::new(Shared::default());
        let (given, manner) = (shared.clone(), Arc::new(manner));
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (shared, manner) = (given.clone(), manner.clone());
                // A client that goes away is its own business.
                std::thread::spawn(move || drop(serve(stream, &shared, &manner)));
            }
        });
        Ok(Self { url, shared })
    }

    /// Its address, up to and without `/chat/completions`.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }

    /// The requests that came so far.
    #[must_use]
    pub fn asked(&self) -> Vec<Asked> {
        let asked = self.shared.asked.lock();
        asked.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Lets the hanging requests go.
    pub fn release(&self) {
        let (flag, wake) = &self.shared.released;
        *flag.lock().unwrap_or_else(PoisonError::into_inner) = true;
        wake.notify_all();
    }
}

/// A chat completion as servers send it.
#[must_use]
pub fn completion(content: &str) -> String {
    json!({
        "id": "chatcmpl-1", "object": "chat.completion", "created": 0, "model": "stand-in",
        "choices": [{"index": 0, "finish_reason": "stop",
                     "message": {"role": "assistant", "content": content}}],
        "usage": {"prompt_tokens": 1, "completion_tokens": 1, "total_tokens": 2}
    })
    .to_string()
}

fn serve(mut stream: TcpStream, shared: &Shared, manner: &Manner) -> std::io::Result<()> {
    let (first, authorization, body) = read(&mut BufReader::new(&stream))?;
    let Some(body) = checked(&first, &body) else {
        let problem = json!({"error": {"message": "bad request", "type": "invalid_request_error"}});
        return stream.write_all(reply(400, &problem.to_string()).as_bytes());
    };
    let number = {
        let mut asked = shared.asked.lock().unwrap_or_else(PoisonError::into_inner);
        asked.push(Asked {
            authorization,
            body,
        });
        asked.len()
    };
    let text = match manner {
        Manner::Content(content) => reply(200, &completion(content)),
        Manner::Body(body) => reply(200, body),
        Manner::Status(status) => reply(*status, "{}"),
        Manner::Slow(wait, content) => {
            std::thread::sleep(*wait);
            reply(200, &completion(content))
        }
        Manner::Hang => {
            let (flag, wake) = &shared.released;
            let flag = flag.lock().unwrap_or_else(PoisonError::into_inner);
            drop(wake.wait_while(flag, |released| !*released));
            return Ok(());
        }
        Manner::Huge(length) => reply(200, &completion(&"x".repeat(*length))),
        Manner::Cut => {
            reply(200, &completion("{}")).replace("content-length: ", "content-length: 9")
        }
        Manner::Recovers(_) if number == 1 => reply(503, "{}"),
        Manner::Recovers(content) => reply(200, &completion(content)),
        Manner::Redirect => {
            "HTTP/1.1 307 X\r\nlocation: http://127.0.0.1:9/steal\r\ncontent-length: 0\r\n\r\n"
                .to_owned()
        }
    };
    stream.write_all(text.as_bytes())
}

fn reply(status: u16, body: &str) -> String {
    format!(
        "HTTP/1.1 {status} X\r\ncontent-type: application/json\r\ncontent-length: {}\r\nconnection: close\r\n\r\n{body}",
        body.len()
    )
}

/// Request line, authorization and body.
fn read(stream: &mut impl BufRead) -> std::io::Result<(String, Option<String>, Vec<u8>)> {
    let mut first = String::new();
    stream.read_line(&mut first)?;
    let (mut length, mut authorization) = (0, None);
    loop {
        let mut line = String::new();
        if stream.read_line(&mut line)? == 0 || line.trim().is_empty() {
            break;
        }
        let Some((name, value)) = line.split_once(':') else {
            continue;
        };
        match name.to_ascii_lowercase().as_str() {
            "content-length" => length = value.trim().parse().unwrap_or(0),
            "authorization" => authorization = Some(value.trim().to_owned()),
            _ => {}
        }
    }
    let mut body = Vec::new();
    stream.take(length).read_to_end(&mut body)?;
    Ok((first, authorization, body))
}

/// The body, if the request is one that a real server would take.
fn checked(first: &str, body: &[u8]) -> Option<Value> {
    let body: Value = serde_json::from_slice(body).ok()?;
    let messages = body["messages"].as_array()?;
    let fine = |message: &Value| {
        matches!(message["role"].as_str(), Some("system" | "user"))
            && message["content"].as_array().is_some_and(|parts| {
                parts.iter().all(|part| match part["type"].as_str() {
                    Some("text") => part["text"].is_string(),
                    Some("image_url") => part["image_url"]["url"].is_string(),
                    _ => false,
                })
            })
    };
    let sound = first.starts_with("POST /v1/chat/completions ")
        && body["model"].is_string()
        && !messages.is_empty()
        && messages.iter().all(fine);
    sound.then_some(body)
}
