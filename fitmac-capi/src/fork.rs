//! Notices a fork: two processes must not command one robot.

use core::sync::atomic::{AtomicU32, Ordering};

static GENERATION: AtomicU32 = AtomicU32::new(0);
static REGISTRATION: AtomicU32 = AtomicU32::new(UNREGISTERED);

const UNREGISTERED: u32 = 0;
const REGISTERED: u32 = 1;

extern "C" fn in_child() {
    GENERATION.fetch_add(1, Ordering::Relaxed);
}

/// How many forks lie between the first process and this one. The first call
/// registers the handler that counts.
pub(crate) fn watch() -> u32 {
    if REGISTRATION.swap(REGISTERED, Ordering::Relaxed) == UNREGISTERED {
        // SAFETY: the handler touches an atomic only, which is safe in a
        // forked child. If there is no room for it, forks go unnoticed.
        unsafe { libc::pthread_atfork(None, None, Some(in_child)) };
    }
    generation()
}

pub(crate) fn generation() -> u32 {
    GENERATION.load(Ordering::Relaxed)
}
