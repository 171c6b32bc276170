//! The real-time loop: absolute deadlines, no bursts.

use std::sync::atomic::Ordering::Relaxed;

use fitmac_core::{message::Command, wire::Mode};

use crate::{
    clock,
    counters::{Cadence, add},
    cycle::{Cycle, Demand, TickTime},
    ring::Record,
    signals::Signals,
    transport::Transport,
};

/// Slowest and fastest loop, ns: 250 Hz and 2 kHz.
pub const PERIOD_RANGE_NS: core::ops::RangeInclusive<u64> = 500_000..=4_000_000;
/// A tick is rehearsed if there is so much time until it is due, ns: with
/// nothing in the caches it takes 10 to 20 us.
const REHEARSAL_NS: u64 = 40_000;
/// The receivers' counts are published once in this many ticks.
const COUNTS_EVERY: u64 = 128;

/// How the loop keeps time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopOptions {
    /// Time between two ticks, ns. Default 1 ms.
    pub period_ns: u64,
    /// What starts a tick.
    pub trigger: Trigger,
    /// Overruns in a row after which the robot is stopped. Default 20, as
    /// Franka's control interface tolerates 20 lost packets.
    pub overruns_in_a_row_max: u32,
    /// How long a controlled stop at the end may take, ns. Default 2 s.
    pub shutdown_max_ns: u64,
    /// End after this many ticks; none to go on until a signal.
    pub ticks_max: Option<u64>,
}

/// What starts a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// The clock: sleep, then spin the last part.
    Deadline {
        /// How long to spin before the deadline, ns. 0 sleeps to the end.
        spin_ns: u64,
    },
    /// The robot's sample: sleep until shortly before it is due, then poll for
    /// it. The loop follows the robot's clock, and answers at once.
    State {
        /// How long before the sample is due to begin polling, ns.
        lead_ns: u64,
        /// How long after that to tick without it, ns.
        patience_ns: u64,
    },
}

impl Default for LoopOptions {
    fn default() -> Self {
        Self {
            period_ns: 1_000_000,
            trigger: Trigger::Deadline { spin_ns: 0 },
            overruns_in_a_row_max: 20,
            shutdown_max_ns: 2_000_000_000,
            ticks_max: None,
        }
    }
}

/// Options that the loop cannot run with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LoopOptionsError {
    /// The period is out of range.
    #[error("a period of {0} ns is out of range: choose a rate from 250 to 2000 Hz")]
    Period(u64),
    /// The loop would only spin.
    #[error(
        "spinning for {spin_ns} ns leaves no sleep in a period of {period_ns} ns: the kernel would throttle the loop; spin for at most half of the period"
    )]
    Spin {
        /// What was asked for.
        spin_ns: u64,
        /// The period.
        period_ns: u64,
    },
}

impl LoopOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// What is out of range.
    pub fn validate(&self) -> Result<(), LoopOptionsError> {
        if !PERIOD_RANGE_NS.contains(&self.period_ns) {
            return Err(LoopOptionsError::Period(self.period_ns));
        }
        let spin_ns = match self.trigger {
            Trigger::Deadline { spin_ns } => spin_ns,
            Trigger::State {
                lead_ns,
                patience_ns,
            } => lead_ns.saturating_add(patience_ns),
        };
        if spin_ns > self.period_ns / 2 {
            return Err(LoopOptionsError::Spin {
                spin_ns,
                period_ns: self.period_ns,
            });
        }
        Ok(())
    }
}

/// Why the loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// It was asked to, and the robot had come to a stop.
    Stopped,
    /// It was asked to, but the stop took too long.
    StopTimedOut,
}

/// Runs the loop on the calling thread until it is asked to end; then stops
/// the robot in a controlled way, and sends a last command flagged as such.
///
/// # Errors
/// If the options are out of range.
pub fn run<Tr: Transport, R: Record>(
    cycle: &mut Cycle<Tr, R>,
    options: &LoopOptions,
    cadence: &Cadence,
    signals: &Signals,
) -> Result<Ended, LoopOptionsError> {
    options.validate()?;
    let mut pace = Pace {
        deadline_ns: clock::now_ns() + options.period_ns,
        skipped: 0,
        overruns_in_a_row: 0,
    };
    let mut ending: Option<u64> = None;
    let mut busy_before_ns = 0;
    let mut end = None;
    loop {
        let begin_ns = pace.wait(cycle, options, cadence);
        let time = TickTime {
            now_ns: begin_ns,
            lateness_ns: begin_ns.saturating_sub(pace.deadline_ns),
            busy_before_ns,
            skipped: core::mem::take(&mut pace.skipped),
        };
        cadence.lateness.record(time.lateness_ns);
        let demand = match (end, ending) {
            (Some(_), _) => Demand::Last,
            (None, Some(_)) => Demand::Stop,
            (None, None) if pace.overruns_in_a_row > options.overruns_in_a_row_max => Demand::Stop,
            (None, None) => Demand::None,
        };
        let ticked = cycle.tick(time, demand);
        let done_ns = clock::now_ns();
        if let Some(sent_ns) = ticked.state_sent_ns {
            cadence.response.record(done_ns.saturating_sub(sent_ns));
        }
        busy_before_ns = done_ns.saturating_sub(begin_ns);
        cadence.busy.record(busy_before_ns);
        add(&cadence.counters.ticks, 1);
        add(
            &cadence.counters.publish_faults,
            u64::from(ticked.sent.is_err()),
        );
        let ticks = cadence.counters.ticks.load(Relaxed);
        if demand == Demand::Last || ticks.is_multiple_of(COUNTS_EVERY) {
            cadence.publish_receivers(&cycle.endpoint().counts());
            cadence.publish_refusals(cycle.core().state().refusals());
        }
        if let (Demand::Last, Some(end)) = (demand, end) {
            return Ok(end);
        }
        pace.advance(done_ns, options, cadence);

        let asked = signals.stop_requested() || options.ticks_max.is_some_and(|n| ticks >= n);
        if ending.is_none() && asked {
            ending = Some(done_ns + options.shutdown_max_ns);
        }
        if let Some(limit_ns) = ending {
            end = match (stands(&ticked.output.command), done_ns >= limit_ns) {
                (true, _) => Some(Ended::Stopped),
                (false, true) => Some(Ended::StopTimedOut),
                (false, false) => None,
            };
        }
    }
}

/// Whether the robot was told to stop and the setpoint stands.
fn stands(command: &Command) -> bool {
    /// 1 mm/s: a setpoint that is this slow stands for all practical purposes.
    const STANDING_M_S: f64 = 1e-3;
    command.mode() == Some(Mode::Stop)
        && command.action[..6].iter().all(|a| *a == 0.0)
        && command
            .setpoint_velocity_m_s
            .iter()
            .all(|v| v.abs() < STANDING_M_S)
}

struct Pace {
    deadline_ns: u64,
    skipped: u64,
    overruns_in_a_row: u32,
}

impl Pace {
    /// Waits for the tick's beginning and returns that time.
    fn wait<Tr: Transport, R: Record>(
        &mut self,
        cycle: &mut Cycle<Tr, R>,
        options: &LoopOptions,
        cadence: &Cadence,
    ) -> u64 {
        let lead_ns = match options.trigger {
            Trigger::Deadline { spin_ns } => spin_ns,
            Trigger::State { lead_ns, .. } => lead_ns,
        };
        let wake_ns = self.deadline_ns.saturating_sub(lead_ns);
        clock::sleep_until(wake_ns);
        let mut now_ns = clock::now_ns();
        cadence.wake.record(now_ns.saturating_sub(wake_ns));
        match options.trigger {
            Trigger::Deadline { .. } => {
                if now_ns + REHEARSAL_NS < self.deadline_ns {
                    cycle.rehearse(self.deadline_ns);
                    now_ns = clock::now_ns();
                }
                while now_ns < self.deadline_ns {
                    core::hint::spin_loop();
                    now_ns = clock::now_ns();
                }
            }
            Trigger::State { patience_ns, .. } => {
                let limit_ns = self.deadline_ns + patience_ns;
                let mut arrived = cycle.endpoint().poll_state();
                if !arrived && now_ns + REHEARSAL_NS < self.deadline_ns {
                    cycle.rehearse(self.deadline_ns);
                }
                while !arrived && now_ns < limit_ns {
                    cycle.endpoint().poll_next();
                    arrived = cycle.endpoint().poll_state();
                    now_ns = clock::now_ns();
                }
                if let Some(sent_ns) = cycle.endpoint().state_sent_ns() {
                    now_ns = clock::now_ns();
                    // The sender's own stamp carries its rhythm, without our
                    // delay in noticing; unless it is no time of this moment.
                    let plausible = now_ns.saturating_sub(options.period_ns)..=now_ns;
                    self.deadline_ns = if plausible.contains(&sent_ns) {
                        sent_ns
                    } else {
                        now_ns
                    };
                }
            }
        }
        now_ns
    }

    /// Sets the next deadline: on the grid, and in the future.
    fn advance(&mut self, done_ns: u64, options: &LoopOptions, cadence: &Cadence) {
        self.deadline_ns += options.period_ns;
        if done_ns < self.deadline_ns {
            self.overruns_in_a_row = 0;
            return;
        }
        let skipped = (done_ns - self.deadline_ns) / options.period_ns + 1;
        self.deadline_ns += skipped * options.period_ns;
        self.skipped = skipped;
        self.overruns_in_a_row = self.overruns_in_a_row.saturating_add(1);
        add(&cadence.counters.overruns, 1);
        add(&cadence.counters.skipped, skipped);
    }
}
