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
        // A step that a fault starts before the last one was over begins now:
        // a fault that flickers must not push the grid into the future.
        let on_grid = now_ns
            .checked_sub(self.step_ends_ns)
            .is_some_and(|late| late < step_ns / 2);
        let begins = if on_grid { self.step_ends_ns } else { now_ns };
        let begins = if begins == 0 { now_ns } else { begins };
        self.step_ends_ns = begins.saturating_add(step_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn steps_that_are_cut_short_do_not_push_the_grid_ahead() {
        let mut clock = StepClock::new();
        for cut in 0..100 {
            clock.start_step((1000 + cut) * MS, 50);
        }
        assert!(!clock.is_due(1148 * MS));
        assert!(clock.is_due(1149 * MS));
    }

    #[test]
    fn steps_in_a_row_keep_the_grid_and_a_pause_starts_a_new_one() {
        let mut clock = StepClock::new();
        clock.start_step(1000 * MS, 50);
        clock.start_step(1060 * MS, 50);
        assert!(!clock.is_due(1099 * MS) && clock.is_due(1100 * MS));
        clock.start_step(1130 * MS, 50);
        assert!(!clock.is_due(1179 * MS) && clock.is_due(1180 * MS));
    }

    #[test]
    fn a_gap_of_a_suspended_process_is_longer_than_the_bound() {
        let mut clock = StepClock::new();
        assert!(!clock.advance(1000 * MS, 500).suspended, "the first");
        assert!(!clock.advance(1500 * MS, 500).suspended, "the bound itself");
        let late = clock.advance(2000 * MS + 1, 500);
        assert!(late.suspended && (late.dt_s - 0.500_000_001).abs() < 1e-12);
        let back = clock.advance(2000 * MS, 500);
        assert!(back.backwards && !back.suspended && back.dt_s == 0.0);
    }
}
