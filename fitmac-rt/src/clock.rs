//! The only clock of the project: `CLOCK_MONOTONIC`, in nanoseconds.
//!
//! Wall-clock time is never read: a step of the wall clock cannot reach a
//! decision.

use rustix::{
    io::Errno,
    thread::clock_nanosleep_absolute,
    time::{ClockId, Timespec, clock_gettime},
};

/// Nanoseconds of the monotonic clock (answered by the vDSO: no system call).
#[must_use]
pub fn now_ns() -> u64 {
    to_ns(clock_gettime(ClockId::Monotonic))
}

/// Sleeps to an absolute time; a signal ends the sleep early. Returns at once
/// if the time has passed.
pub fn sleep_until(deadline_ns: u64) {
    // The only other error is an invalid time, which `to_timespec` cannot make.
    let slept = clock_nanosleep_absolute(ClockId::Monotonic, &to_timespec(deadline_ns));
    debug_assert!(matches!(slept, Ok(()) | Err(Errno::INTR)));
}

fn to_ns(t: Timespec) -> u64 {
    // The monotonic clock starts near zero at boot: neither part is negative.
    (t.tv_sec as u64)
        .wrapping_mul(1_000_000_000)
        .wrapping_add(t.tv_nsec as u64)
}

fn to_timespec(ns: u64) -> Timespec {
    Timespec {
        tv_sec: (ns / 1_000_000_000) as _,
        tv_nsec: (ns % 1_000_000_000) as _,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversion_keeps_every_nanosecond() {
        for ns in [0, 1, 999_999_999, 1_000_000_000, 86_400_123_456_789] {
            assert_eq!(to_ns(to_timespec(ns)), ns);
        }
    }
}
