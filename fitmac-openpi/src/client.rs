//! The client: one question at a time, over a connection that comes back.

use std::collections::BTreeMap;

use tungstenite::http::HeaderValue;

use crate::{
    address::Address,
    answer::Answer,
    convention::{Conventions, HorizonError},
    link::Link,
    metadata::{Expectation, Metadata, Mismatch},
    observation::Observation,
    refusal::Refusal,
    retry::Retry,
};

/// A key that the server asks for. It is not printed.
#[derive(Clone, PartialEq, Eq)]
pub struct ApiKey(HeaderValue);

/// A key that no HTTP header can carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the key holds characters that an HTTP header cannot carry")]
pub struct ApiKeyError;

impl ApiKey {
    /// A key, sent as openpi's client does: `Authorization: Api-Key KEY`.
    ///
    /// # Errors
    /// [`ApiKeyError`] for line ends and the like.
    pub fn new(key: &str) -> Result<Self, ApiKeyError> {
        let mut header =
            HeaderValue::from_str(&format!("Api-Key {key}")).map_err(|_| ApiKeyError)?;
        header.set_sensitive(true);
        Ok(Self(header))
    }

    pub(crate) fn header(&self) -> HeaderValue {
        self.0.clone()
    }
}

impl std::fmt::Debug for ApiKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ApiKey(..)")
    }
}

/// How to talk with which server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Where it is.
    pub address: Address,
    /// A key, if it wants one.
    pub api_key: Option<ApiKey>,
    /// What its actions mean.
    pub conventions: Conventions,
    /// What its metadata must say.
    pub expected: Vec<Expectation>,
    /// Longest time from the start of a connection to its metadata, ms.
    pub connect_timeout_ms: u64,
    /// Longest time from a question to its answer, ms.
    pub answer_timeout_ms: u64,
    /// The same for the first question of a connection, ms: openpi compiles its model then.
    pub first_answer_timeout_ms: u64,
    /// Wait after a failure before the next try to connect, ms; doubled with each failure in a row.
    pub retry_first_ms: u64,
    /// Longest such wait, ms.
    pub retry_max_ms: u64,
    /// Largest message that is taken from the server.
    pub answer_max_bytes: usize,
}

impl Settings {
    /// The defaults: 3 s to connect, 5 s for an answer and 120 s for the first one, waits of 0.25 s
    /// to 5 s, 1 MiB.
    #[must_use]
    pub const fn new(address: Address, conventions: Conventions) -> Self {
        Self {
            address,
            api_key: None,
            conventions,
            expected: Vec::new(),
            connect_timeout_ms: 3_000,
            answer_timeout_ms: 5_000,
            first_answer_timeout_ms: 120_000,
            retry_first_ms: 250,
            retry_max_ms: 5_000,
            answer_max_bytes: 1 << 20,
        }
    }
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Failure {
    /// No connection came about.
    #[error("the policy server cannot be reached: {problem}")]
    Unreachable {
        /// Why.
        problem: String,
    },
    /// There is no connection, and the next try is not due.
    #[error("there is no connection to the policy server")]
    Waiting,
    /// It is another server than expected.
    #[error("it is not the expected policy server: {0}")]
    WrongServer(#[from] Mismatch),
    /// Something took too long; the connection was dropped.
    #[error("{stage} took too long")]
    TimedOut {
        /// What.
        stage: &'static str,
    },
    /// The connection broke.
    #[error("the connection to the policy server broke: {problem}")]
    Disconnected {
        /// How.
        problem: String,
    },
    /// The answer is not used.
    #[error("refused ({name}): {0}", name = .0.name())]
    Refused(#[from] Refusal),
    /// The caller wanted no more.
    #[error("stopped")]
    Stopped,
}

impl Failure {
    /// The name that counters use; a refusal's own.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Unreachable { .. } => "unreachable",
            Self::Waiting => "waiting",
            Self::WrongServer(_) => "wrong_server",
            Self::TimedOut { .. } => "timed_out",
            Self::Disconnected { .. } => "disconnected",
            Self::Refused(refusal) => refusal.name(),
            Self::Stopped => "stopped",
        }
    }

    /// Whether questions and answers are still in step after this. A sound frame with a wrong
    /// content is an answer all the same; everything else leaves that open.
    const fn leaves_in_step(&self) -> bool {
        match self {
            Self::Refused(refusal) => !matches!(
                refusal,
                Refusal::ServerFailed { .. } | Refusal::Oversized { .. } | Refusal::Unsolicited
            ),
            _ => false,
        }
    }
}

/// What happened so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Connections that came about.
    pub connections: u64,
    /// Answers that were used.
    pub answers: u64,
    /// Failures by their names. Waiting is none.
    pub failures: BTreeMap<&'static str, u64>,
}

#[derive(Debug)]
enum State {
    Down {
        retry_at_ns: u64,
    },
    Up {
        link: Box<Link>,
        metadata: Metadata,
        warm: bool,
    },
}

/// A client of one policy server.
#[derive(Debug)]
pub struct Client {
    settings: Settings,
    clock: fn() -> u64,
    retry: Retry,
    state: State,
    counters: Counters,
}

impl Client {
    /// A client that is not connected yet. `clock` gives nanoseconds and never goes back.
    ///
    /// # Errors
    /// [`HorizonError`] if the declared horizon fits no chunk.
    pub fn new(settings: Settings, clock: fn() -> u64) -> Result<Self, HorizonError> {
        settings.conventions.validate()?;
        let ms = |ms: u64| ms.saturating_mul(1_000_000);
        Ok(Self {
            retry: Retry::new(ms(settings.retry_first_ms), ms(settings.retry_max_ms)),
            settings,
            clock,
            state: State::Down { retry_at_ns: 0 },
            counters: Counters::default(),
        })
    }

    /// What was set.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What happened so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// What the server said about itself, while there is a connection.
    #[must_use]
    pub const fn metadata(&self) -> Option<&Metadata> {
        match &self.state {
            State::Up { metadata, .. } => Some(metadata),
            State::Down { .. } => None,
        }
    }

    /// Connects if there is no connection and a try is due, and answers the server's pings: call it
    /// some times a second between questions. Waiting ends early when `keep_going` says no.
    ///
    /// # Errors
    /// Why there is no connection.
    pub fn tend(&mut self, keep_going: &dyn Fn() -> bool) -> Result<(), Failure> {
        let result = self.connect(keep_going);
        let result = result.and_then(|()| match &mut self.state {
            State::Up { link, .. } => link.tend(),
            State::Down { .. } => Err(Failure::Waiting),
        });
        self.settle(result)
    }

    /// Asks the policy. Waiting ends early when `keep_going` says no.
    ///
    /// # Errors
    /// Why there is no answer that may be used.
    pub fn infer(
        &mut self,
        observation: &Observation<'_>,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Answer, Failure> {
        self.tend(keep_going)?;
        let result = self.ask(observation, keep_going);
        let answer = self.settle(result)?;
        self.counters.answers += 1;
        Ok(answer)
    }

    fn ask(
        &mut self,
        observation: &Observation<'_>,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Answer, Failure> {
        let State::Up { link, warm, .. } = &mut self.state else {
            return Err(Failure::Waiting);
        };
        let limit_ms = match warm {
            true => self.settings.answer_timeout_ms,
            false => self.settings.first_answer_timeout_ms,
        };
        let deadline_ns = after(self.clock, limit_ms);
        link.send(observation.frame(), deadline_ns, keep_going)?;
        let frame = link.receive("the answer", deadline_ns, keep_going)?;
        *warm = true;
        // Only a server that answers is back: one that accepts and fails is not asked in a hurry.
        self.retry.succeeded();
        Ok(Answer::read(&frame, &self.settings.conventions)?)
    }

    fn connect(&mut self, keep_going: &dyn Fn() -> bool) -> Result<(), Failure> {
        match self.state {
            State::Up { .. } => return Ok(()),
            State::Down { retry_at_ns } if (self.clock)() < retry_at_ns => {
                return Err(Failure::Waiting);
            }
            State::Down { .. } => {}
        }
        let deadline_ns = after(self.clock, self.settings.connect_timeout_ms);
        let mut link = Link::open(&self.settings, self.clock, deadline_ns)?;
        let frame = link.receive("the server's metadata", deadline_ns, keep_going)?;
        let metadata = Metadata::read(&frame)?;
        metadata.check(&self.settings.expected)?;
        self.counters.connections += 1;
        self.state = State::Up {
            link: Box::new(link),
            metadata,
            warm: false,
        };
        Ok(())
    }

    /// Counts a failure and drops a connection on which an answer could be taken for another.
    fn settle<T>(&mut self, result: Result<T, Failure>) -> Result<T, Failure> {
        if let Err(failure) = &result
            && *failure != Failure::Waiting
        {
            *self.counters.failures.entry(failure.name()).or_default() += 1;
            let connected = matches!(self.state, State::Up { .. });
            if !(connected && failure.leaves_in_step()) {
                let retry_at_ns = self.retry.failed((self.clock)());
                self.state = State::Down { retry_at_ns };
            }
        }
        result
    }
}

fn after(clock: fn() -> u64, ms: u64) -> u64 {
    clock().saturating_add(ms.saturating_mul(1_000_000))
}
