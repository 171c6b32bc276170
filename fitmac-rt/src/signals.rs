//! An orderly end: the first signal asks for it, the second forces it.
#![allow(unsafe_code)]

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use signal_hook::{
    consts::{SIGINT, SIGTERM, SIGUSR1},
    flag, low_level,
};

/// Exit status after the second signal: 128 + SIGINT, as shells count.
const FORCED_EXIT: i32 = 130;

/// What signals asked for.
#[derive(Clone, Debug, Default)]
pub struct Signals {
    stop: Arc<AtomicBool>,
    report: Arc<AtomicBool>,
}

impl Signals {
    /// Signals of nobody: for loops that something else ends.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Listens to SIGTERM and SIGINT (end in order; the second one exits at
    /// once) and SIGUSR1 (report the cadence so far).
    ///
    /// # Errors
    /// If the handlers cannot be installed.
    pub fn listen() -> io::Result<Self> {
        let signals = Self::default();
        for signal in [SIGTERM, SIGINT] {
            let stop = Arc::clone(&signals.stop);
            let asked = move || {
                // One step, for two threads may handle two signals at once.
                if stop.swap(true, Ordering::Relaxed) {
                    low_level::exit(FORCED_EXIT);
                }
            };
            // SAFETY: in a handler, as here, an atomic may be swapped and the
            // process left without any clean-up; nothing is allocated or locked.
            unsafe { low_level::register(signal, asked) }?;
        }
        flag::register(SIGUSR1, Arc::clone(&signals.report))?;
        Ok(signals)
    }

    /// Asks for an orderly end, as a signal would.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for.
    #[must_use]
    pub fn stop_requested(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Whether a report was asked for since the last call.
    #[must_use]
    pub fn take_report_request(&self) -> bool {
        self.report.swap(false, Ordering::Relaxed)
    }
}
