//! Intake: the only door for messages. Each is copied once and validated on
//! the copy; what does not pass is refused by name and counted.

pub mod chunk;
pub mod grounding;
mod refusal;
pub mod robot;

pub use refusal::{Refusal, RefusalCounts};

/// Nanoseconds in a millisecond.
const NS_PER_MS: u64 = 1_000_000;

/// `ms` milliseconds in nanoseconds.
#[must_use]
pub const fn ms_to_ns(ms: u32) -> u64 {
    ms as u64 * NS_PER_MS
}

/// How old `stamp_ns` is at `now_ns`; a stamp in the future has age 0.
#[must_use]
pub const fn age_ns(now_ns: u64, stamp_ns: u64) -> u64 {
    now_ns.saturating_sub(stamp_ns)
}

/// True if `sequence` comes after `last` (wrapping).
#[must_use]
pub const fn is_newer(sequence: u64, last: u64) -> bool {
    let ahead = sequence.wrapping_sub(last);
    ahead != 0 && ahead < 1 << 63
}

/// A confidence as the core uses it: what is no number in [0, 1] is none.
#[must_use]
pub fn confidence(value: f64) -> f64 {
    if (0.0..=1.0).contains(&value) {
        value
    } else {
        0.0
    }
}
