//! The attempt monitor: progress, stall, time-out and oscillation
//! (equations 3, 5 and 6). It reads and never commands.

use kinematics::vector::{self, Vector3};

use crate::{
    evidence,
    oscillation::Oscillation,
    params::{Params, Patience, Progress, Timeout},
    phase::is_pick,
    signals::Signals,
    wire::Phase,
};

/// Steps that the history holds: the longest Delta, and the newest.
const HISTORY: usize = 9;

/// What one step left behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Tool centre point, base frame, m.
    pub ee_m: Vector3,
    /// Target centre, base frame, m.
    pub object_m: Option<Vector3>,
    /// End effector to target, m (equation 2).
    pub target_distance_m: Option<f64>,
    /// Object to destination, m (equation 2).
    pub destination_distance_m: Option<f64>,
}

impl Step {
    fn new(signals: &Signals) -> Self {
        Self {
            ee_m: signals.ee_m,
            object_m: signals.target.map(|t| t.position_m),
            target_distance_m: signals.target.map(|t| t.distance_m),
            destination_distance_m: signals.destination.map(|d| d.distance_m),
        }
    }
}

/// The last steps, newest first.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    steps: [Option<Step>; HISTORY],
}

impl History {
    const fn new() -> Self {
        Self {
            steps: [None; HISTORY],
        }
    }

    fn push(&mut self, step: Step) {
        self.steps.rotate_right(1);
        if let Some(newest) = self.steps.first_mut() {
            *newest = Some(step);
        }
    }

    /// The step `ago` steps before the newest.
    #[must_use]
    pub fn ago(&self, ago: u32) -> Option<&Step> {
        self.steps.get(ago as usize).and_then(Option::as_ref)
    }

    /// Steps at hand.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps.iter().flatten().count()
    }

    /// True if nothing is at hand.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The monitor's memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Monitor {
    history: History,
    idle_steps: u32,
    since_progress: u32,
    oscillation: Oscillation,
}

impl Monitor {
    pub(crate) const fn new() -> Self {
        Self {
            history: History::new(),
            idle_steps: 0,
            since_progress: u32::MAX,
            oscillation: Oscillation::new(),
        }
    }

    /// The last steps.
    #[must_use]
    pub const fn history(&self) -> &History {
        &self.history
    }

    /// Steps since the last progress in this attempt.
    #[must_use]
    pub const fn since_progress(&self) -> u32 {
        self.since_progress
    }

    /// The phase changed: its windows start anew, differences still hold.
    pub(crate) fn enter_phase(&mut self) {
        self.idle_steps = 0;
        self.oscillation = Oscillation::new();
    }

    /// The target changed, or the arm was elsewhere: no difference holds.
    pub(crate) fn forget(&mut self) {
        *self = Self::new();
    }

    /// Judges one policy step; returns bits of [`evidence`].
    pub(crate) fn step(
        &mut self,
        params: &Params,
        phase: Phase,
        phase_steps: u32,
        signals: &Signals,
    ) -> u64 {
        self.history.push(Step::new(signals));
        let mut bits = 0;
        self.since_progress = self.since_progress.saturating_add(1);
        match progress(&params.progress, phase, &self.history) {
            Some(true) => {
                self.idle_steps = 0;
                self.since_progress = 0;
                bits |= evidence::PROGRESS;
            }
            Some(false) => self.idle_steps = self.idle_steps.saturating_add(1),
            // A missing pose is no progress and no stall either.
            None => {}
        }
        if self.idle_steps >= patience(&params.patience, phase) {
            bits |= evidence::STALL;
        }
        if phase_steps > timeout(&params.timeout, phase) {
            bits |= evidence::TIMEOUT;
        }
        let distance_m = if is_pick(phase) {
            signals.target.map(|t| t.distance_m)
        } else {
            signals.destination.map(|d| d.distance_m)
        };
        if self
            .oscillation
            .step(&params.progress, signals.ee_m, distance_m)
        {
            bits |= evidence::REVERSAL;
        }
        bits
    }
}

/// Progress of the newest step against the one Delta steps earlier
/// (equation 5); `None` if either lacks a pose.
fn progress(params: &Progress, phase: Phase, history: &History) -> Option<bool> {
    let (now, then) = (history.ago(0)?, history.ago(params.delta_steps)?);
    if is_pick(phase) {
        let approach = then.target_distance_m? - now.target_distance_m?;
        let moved = vector::distance(now.ee_m, then.ee_m);
        return Some(approach > params.target_m || moved > params.end_effector_m);
    }
    let moved = vector::distance(now.object_m?, then.object_m?);
    let approach = match (then.destination_distance_m, now.destination_distance_m) {
        (Some(then), Some(now)) => then - now,
        // Without a direct destination only the object's motion tells.
        _ => 0.0,
    };
    Some(approach > params.destination_m || moved > params.object_m)
}

/// Patience W of a phase, steps.
#[must_use]
pub const fn patience(params: &Patience, phase: Phase) -> u32 {
    match phase {
        Phase::Approach => params.approach_steps,
        Phase::Grasp => params.grasp_steps,
        Phase::Lift => params.lift_steps,
        Phase::Transport => params.transport_steps,
        Phase::Descend => params.descend_steps,
        Phase::Release => params.release_steps,
        Phase::Stabilise => params.stabilise_steps,
        Phase::Complete => u32::MAX,
    }
}

/// Time-out T of a phase, steps.
#[must_use]
pub const fn timeout(params: &Timeout, phase: Phase) -> u32 {
    match phase {
        Phase::Approach => params.approach_steps,
        Phase::Grasp => params.grasp_steps,
        Phase::Lift => params.lift_steps,
        Phase::Transport => params.transport_steps,
        Phase::Descend => params.descend_steps,
        Phase::Release => params.release_steps,
        Phase::Stabilise => params.stabilise_steps,
        Phase::Complete => u32::MAX,
    }
}

#[cfg(test)]
mod tests;
