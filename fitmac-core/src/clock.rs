//! The core's notion of time: it is told, it never looks.

use crate::intake::ms_to_ns;

/// How one tick stands to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Time since the last tick, s; 0 at the first, and when time did not advance.
    pub dt_s: f64,
    /// Time ran backwards.
    pub backwards: bool,
    /// The gap is that of a suspended process.
    pub suspended: bool,
}

/// The last tick, and when the running policy step ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepClock {
    last_ns: Option<u64>,
    step_ends_ns: u64,
}

impl StepClock {
    pub(crate) const fn new() -> Self {
        Self {
            last_ns: None,
            step_ends_ns: 0,
        }
    }

    /// Notes a tick. Time that stands still or runs backwards advances nothing.
    pub(crate) fn advance(&mut self, now_ns: u64, gap_stop_ms: u32) -> Tick {
        let last = self.last_ns.unwrap_or(now_ns);
        let gap = now_ns.saturating_sub(last);
        self.last_ns = Some(last.max(now_ns));
        Tick {
            dt_s: gap as f64 * 1e-9,
            backwards: now_ns < last,
            suspended: gap > ms_to_ns(gap_stop_ms),
        }
    }

    /// True if the running policy step is over.
    #[must_use]
    pub const fn is_due(&self, now_ns: u64) -> bool {
        now_ns >= self.step_ends_ns
    }

    /// A step starts. The grid is kept while steps follow each other; after a
    /// pause a new one starts, and missed steps are not made up for.
    pub(crate) fn start_step(&mut self, now_ns: u64, step_ms: u32) {
        let step_ns = ms_to_ns(step_ms);
        let late = now_ns.saturating_sub(self.step_ends_ns);
        let begins = if late < step_ns / 2 {
            self.step_ends_ns
        } else {
            now_ns
        };
        let begins = if begins == 0 { now_ns } else { begins };
        self.step_ends_ns = begins.saturating_add(step_ns);
    }
}
