//! Calls in worker threads, polled and cancelled.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use serde::Serialize;

use super::client::{Cancel, ChatModel, ModelError};

/// Which agent asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The planner.
    Planner,
    /// The grounder's resolver.
    Resolver,
    /// The critic.
    Critic,
}

/// A call for the trace.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CallRecord {
    /// Who asked.
    pub role: Role,
    /// When it was asked, ns.
    pub asked_ns: u64,
    /// From asking to the poll that found the answer, ns.
    pub latency_ns: u64,
    /// Requests sent.
    pub attempts: u32,
    /// "ok", or what went wrong in a word.
    pub outcome: &'static str,
}

/// A call that came to its end.
#[derive(Debug)]
pub struct Finished {
    /// The number that [`Calls::start`] gave.
    pub ticket: u64,
    /// Who asked.
    pub role: Role,
    /// When it was asked, ns.
    pub asked_ns: u64,
    /// Requests sent.
    pub attempts: u32,
    /// The content of the answer, not yet checked against a schema.
    pub answer: Result<String, ModelError>,
}

struct Pending {
    ticket: u64,
    role: Role,
    asked_ns: u64,
    cancel: Cancel,
}

/// What a model is asked.
#[derive(Clone, Debug)]
pub struct Question {
    /// The system's message.
    pub system: &'static str,
    /// The user's message.
    pub user: String,
    /// An image as PNG.
    pub png: Option<Vec<u8>>,
}

/// Most calls at a time.
const IN_FLIGHT: usize = 4;

/// Calls under way.
pub struct Calls {
    model: Arc<ChatModel>,
    sender: Sender<(u64, Result<String, ModelError>, u32)>,
    receiver: Receiver<(u64, Result<String, ModelError>, u32)>,
    pending: Vec<Pending>,
    next: u64,
}

impl std::fmt::Debug for Calls {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Calls")
            .field("model", &self.model)
            .field("next", &self.next)
            .finish()
    }
}

impl Calls {
    /// No calls yet.
    #[must_use]
    pub fn new(model: ChatModel) -> Self {
        let (sender, receiver) = channel();
        Self {
            model: Arc::new(model),
            sender,
            receiver,
            pending: Vec::new(),
            next: 1,
        }
    }

    /// Starts a call and gives its number; `None` if too many are under way or
    /// no thread could be started.
    pub fn start(&mut self, role: Role, now_ns: u64, question: Question) -> Option<u64> {
        if self.pending.len() >= IN_FLIGHT {
            return None;
        }
        let (ticket, cancel) = (self.next, Cancel::default());
        let (model, sender, flag) = (self.model.clone(), self.sender.clone(), cancel.clone());
        let work = move || {
            let Question { system, user, png } = question;
            let (answer, attempts) = model.ask(system, &user, png.as_deref(), &flag);
            // Nobody may be listening any more.
            let _ = sender.send((ticket, answer, attempts));
        };
        std::thread::Builder::new()
            .name("model-call".to_owned())
            .spawn(work)
            .ok()?;
        self.next += 1;
        self.pending.push(Pending {
            ticket,
            role,
            asked_ns: now_ns,
            cancel,
        });
        Some(ticket)
    }

    /// Cancels all calls under way. Each still comes to an end, as cancelled.
    pub fn cancel_all(&mut self, role: Option<Role>) {
        for pending in &self.pending {
            if role.is_none_or(|role| role == pending.role) {
                pending.cancel.cancel();
            }
        }
    }

    /// Calls that ended since the last poll; never waits.
    pub fn poll(&mut self) -> Vec<Finished> {
        let mut finished = Vec::new();
        while let Ok((ticket, answer, attempts)) = self.receiver.try_recv() {
            let Some(at) = self.pending.iter().position(|p| p.ticket == ticket) else {
                continue;
            };
            let Pending {
                role,
                asked_ns,
                cancel,
                ..
            } = self.pending.remove(at);
            // An answer that came after the cancellation is no answer.
            let answer = if cancel.is_cancelled() {
                Err(ModelError::Cancelled)
            } else {
                answer
            };
            finished.push(Finished {
                ticket,
                role,
                asked_ns,
                attempts,
                answer,
            });
        }
        finished
    }

    /// Calls under way.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.pending.len()
    }
}

impl Drop for Calls {
    fn drop(&mut self) {
        self.cancel_all(None);
    }
}
