//! A stand-in for an openpi policy server: it answers as openpi's
//! `websocket_policy_server.py` does, and misbehaves on demand. It reads and
//! writes the protocol by its own means, not by those of the client under test.

mod connection;
mod frame;

use std::{
    io,
    net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

pub use frame::Question;

/// What the server does with a question.
#[derive(Clone, Debug, PartialEq)]
pub enum Behaviour {
    /// Answers as openpi does, with `float64` actions.
    Answers,
    /// The same with `float32`.
    AnswersNarrow,
    /// Answers after a while.
    AnswersAfter(Duration),
    /// Answers, and once more.
    AnswersTwice,
    /// Answers with this shape over the right number of bytes for it.
    Shape(Vec<usize>),
    /// Puts a number at a place of the actions: action, component, number.
    Puts(usize, usize, f64),
    /// Answers with this dtype.
    Dtype(&'static str),
    /// Sends these bytes as the answer.
    Sends(Vec<u8>),
    /// Sends a sound answer that is larger than anybody wants: so many bytes.
    Oversized(usize),
    /// Fails: a traceback as text, then the connection is closed.
    Fails(&'static str),
    /// Never answers.
    Hangs,
    /// Sends a frame that never ends, a byte at a time.
    Drips,
    /// Closes the connection instead of an answer.
    Closes,
}

/// How the stand-in's policy acts on a question.
pub type Policy = fn(&Question) -> Vec<[f64; 7]>;

/// What the server is and does.
#[derive(Clone, Debug)]
pub struct Role {
    /// Its metadata: keys and texts.
    pub metadata: Vec<(&'static str, &'static str)>,
    /// What it does with a question.
    pub behaviour: Behaviour,
    /// What it answers with.
    pub policy: Policy,
}

impl Role {
    /// A server with empty metadata, as openpi's own LIBERO policies have it.
    #[must_use]
    pub fn sound(policy: Policy) -> Self {
        Self {
            metadata: Vec::new(),
            behaviour: Behaviour::Answers,
            policy,
        }
    }
}

/// A running stand-in; it ends, with all its connections, when it is dropped.
#[derive(Debug)]
pub struct StandIn {
    shared: Arc<Shared>,
    port: u16,
    listener: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    role: Mutex<Role>,
    questions: Mutex<Vec<Question>>,
    pongs: Mutex<u64>,
    ended: AtomicBool,
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl StandIn {
    /// Starts one on a free port of this machine.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn start(role: Role) -> Self {
        Self::start_at(0, role)
    }

    /// Starts one on a port that an earlier one had.
    ///
    /// # Panics
    /// If the port is taken.
    #[must_use]
    pub fn start_at(port: u16, role: Role) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).expect("the port is free");
        let port = listener.local_addr().expect("it is bound").port();
        let shared = Arc::new(Shared {
            role: Mutex::new(role),
            questions: Mutex::default(),
            pongs: Mutex::default(),
            ended: AtomicBool::new(false),
        });
        let listener = thread::spawn({
            let shared = shared.clone();
            move || listen(&listener, &shared)
        });
        Self {
            shared,
            port,
            listener: Some(listener),
        }
    }

    /// Its port.
    #[must_use]
    pub const fn port(&self) -> u16 {
        self.port
    }

    /// Its address, as a client is told it.
    #[must_use]
    pub fn url(&self) -> String {
        format!("ws://127.0.0.1:{}", self.port)
    }

    /// Does otherwise from the next question on.
    pub fn behave(&self, behaviour: Behaviour) {
        lock(&self.shared.role).behaviour = behaviour;
    }

    /// The questions that came so far.
    #[must_use]
    pub fn questions(&self) -> Vec<Question> {
        lock(&self.shared.questions).clone()
    }

    /// Answers to its pings so far. It sends one with each look at an idle connection.
    #[must_use]
    pub fn pongs(&self) -> u64 {
        *lock(&self.shared.pongs)
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::SeqCst);
        // Wakes the listener.
        let _ = TcpStream::connect(SocketAddr::from((Ipv4Addr::LOCALHOST, self.port)));
        if let Some(listener) = self.listener.take() {
            let _ = listener.join();
        }
    }
}

fn listen(listener: &TcpListener, shared: &Arc<Shared>) {
    let mut connections = Vec::new();
    while let Ok((tcp, _)) = listener.accept() {
        if shared.ended.load(Ordering::SeqCst) {
            break;
        }
        let shared = shared.clone();
        connections.push(thread::spawn(move || {
            // Its client is gone: what a client does to it is no failure of a test.
            let _: Result<(), io::Error> = connection::serve(tcp, &shared);
        }));
    }
    for connection in connections {
        let _ = connection.join();
    }
}
