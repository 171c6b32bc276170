//! A peer: a thread with ends of its own and a state that the test can change.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering::Relaxed},
        mpsc,
    },
    thread::JoinHandle,
};

use fitmac_rt::{
    instance::Instance,
    realtime::{Core, RealTime},
    transport::Ipc,
};

/// What the thread and the test share.
pub struct Shared<S> {
    state: Mutex<S>,
    ends: AtomicBool,
}

impl<S> Shared<S> {
    /// For a peer that is a process of its own, and goes on until it is killed.
    pub fn new(state: S) -> Self {
        Self {
            state: Mutex::new(state),
            ends: AtomicBool::new(false),
        }
    }

    /// Looks at the state, or changes it.
    pub fn with<T>(&self, action: impl FnOnce(&mut S) -> T) -> T {
        action(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether nobody has asked for the end.
    pub fn goes_on(&self) -> bool {
        !self.ends.load(Relaxed)
    }
}

/// A peer that runs until it is dropped.
pub struct Peer<S> {
    shared: Arc<Shared<S>>,
    thread: Option<JoinHandle<()>>,
}

impl<S: Send + 'static> Peer<S> {
    /// Starts a peer and waits until it has joined the instance.
    ///
    /// # Panics
    /// If it cannot.
    pub fn start(name: &str, instance: &Instance, state: S, work: fn(&Ipc, &Shared<S>)) -> Self {
        let shared = Arc::new(Shared::new(state));
        let (instance, theirs) = (instance.clone(), Arc::clone(&shared));
        let (ready, joined) = mpsc::channel();
        let thread = std::thread::Builder::new()
            .name(name.into())
            .spawn(move || {
                let transport = Ipc::join(&instance).expect("joins");
                let _ = ready.send(());
                // In front of the machine's other work, if that is allowed.
                let in_front = RealTime {
                    priority: Some(70),
                    core: Core::Any,
                    ..RealTime::off()
                };
                let _prepared = in_front.prepare();
                work(&transport, &theirs);
            })
            .expect("a thread");
        joined.recv().expect("the peer joins");
        Self {
            shared,
            thread: Some(thread),
        }
    }

    /// Looks at its state, or changes it.
    pub fn with<T>(&self, action: impl FnOnce(&mut S) -> T) -> T {
        self.shared.with(action)
    }
}

impl<S> Drop for Peer<S> {
    fn drop(&mut self) {
        self.shared.ends.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            // A test that fails already says more than this would.
            assert!(ended.is_ok() || std::thread::panicking(), "a peer panicked");
        }
    }
}
