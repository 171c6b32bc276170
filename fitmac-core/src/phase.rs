//! Phase estimation: which part of a pick-and-place attempt is going on.

use crate::{
    params::PhaseParams,
    signals::{GripperState, Signals},
    wire::Phase,
};

/// The legal changes of phase. A change from a place phase, or from a lift,
/// back to approach starts a new attempt.
pub const EDGES: &[(Phase, Phase)] = &[
    (Phase::Approach, Phase::Grasp),
    (Phase::Approach, Phase::Lift),
    (Phase::Grasp, Phase::Approach),
    (Phase::Grasp, Phase::Lift),
    (Phase::Lift, Phase::Approach),
    (Phase::Lift, Phase::Grasp),
    (Phase::Lift, Phase::Transport),
    (Phase::Transport, Phase::Approach),
    (Phase::Transport, Phase::Descend),
    (Phase::Transport, Phase::Release),
    (Phase::Descend, Phase::Approach),
    (Phase::Descend, Phase::Transport),
    (Phase::Descend, Phase::Release),
    (Phase::Release, Phase::Approach),
    (Phase::Release, Phase::Transport),
    (Phase::Release, Phase::Stabilise),
    (Phase::Stabilise, Phase::Approach),
    (Phase::Stabilise, Phase::Complete),
    (Phase::Release, Phase::Complete),
    (Phase::Descend, Phase::Complete),
    (Phase::Transport, Phase::Complete),
    (Phase::Approach, Phase::Complete),
    (Phase::Grasp, Phase::Complete),
    (Phase::Lift, Phase::Complete),
];

/// True if the phase may change from `from` to `to`.
#[must_use]
pub fn is_legal(from: Phase, to: Phase) -> bool {
    EDGES.contains(&(from, to))
}

/// True for approach, grasp and lift (the set Phi_pick).
#[must_use]
pub const fn is_pick(phase: Phase) -> bool {
    matches!(phase, Phase::Approach | Phase::Grasp | Phase::Lift)
}

/// True for transport, descend, release and stabilise (the set Phi_place).
#[must_use]
pub const fn is_place(phase: Phase) -> bool {
    matches!(
        phase,
        Phase::Transport | Phase::Descend | Phase::Release | Phase::Stabilise
    )
}

/// What a step of the estimator brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The phase goes on.
    None,
    /// A new phase of the same attempt.
    Phase,
    /// Back to picking: a new attempt.
    Attempt,
}

/// How the target relates to the attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Carry {
    /// Resting; its height is remembered.
    Resting {
        /// Height of its centre while the gripper was open, m.
        rest_z_m: Option<f64>,
        /// Steps that it was seen risen.
        risen_steps: u32,
    },
    /// Lifted by the gripper.
    Lifted {
        /// Highest centre since the lift, m.
        top_z_m: f64,
        /// Height of the end effector above its centre at the lift, m.
        grip_z_m: f64,
    },
    /// Let go after a lift.
    Released,
}

/// The estimator's memory.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseEstimator {
    phase: Phase,
    steps: u32,
    candidate: Option<(Phase, u32)>,
    carry: Carry,
}

impl PhaseEstimator {
    pub(crate) const fn new() -> Self {
        Self {
            phase: Phase::Approach,
            steps: 0,
            candidate: None,
            carry: Carry::Resting {
                rest_z_m: None,
                risen_steps: 0,
            },
        }
    }

    /// The phase.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// Policy steps in the phase.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// How the target relates to the attempt.
    #[must_use]
    pub const fn carry(&self) -> Carry {
        self.carry
    }

    /// True while the gripper carries the lifted target.
    #[must_use]
    pub const fn is_lifted(&self) -> bool {
        matches!(self.carry, Carry::Lifted { .. })
    }

    /// Success was verified.
    pub(crate) fn complete(&mut self) {
        if is_legal(self.phase, Phase::Complete) {
            *self = Self {
                phase: Phase::Complete,
                steps: 0,
                candidate: None,
                carry: self.carry,
            };
        }
    }

    /// Starts the attempt afresh: the target fell, or its release failed.
    pub(crate) fn restart(&mut self) -> Change {
        if self.phase == Phase::Complete {
            return Change::None;
        }
        *self = Self::new();
        Change::Attempt
    }

    pub(crate) fn step(&mut self, params: &PhaseParams, signals: &Signals) -> Change {
        self.steps = self.steps.saturating_add(1);
        if self.phase == Phase::Complete {
            return Change::None;
        }
        self.follow(params, signals);
        let estimate = self.estimate(params, signals);
        self.settle_on(params, estimate)
    }

    /// Updates how the target relates to the attempt.
    fn follow(&mut self, params: &PhaseParams, signals: &Signals) {
        let z = signals.target.map(|t| t.position_m[2]);
        let open = signals.gripper.state == GripperState::Open;
        self.carry = match (self.carry, z) {
            // An open hand carries nothing, whether the target is seen or not.
            // Let go before the carry began: the lift has failed.
            (Carry::Lifted { .. }, _) if open && is_pick(self.phase) => Carry::Resting {
                rest_z_m: None,
                risen_steps: 0,
            },
            (Carry::Lifted { .. }, _) if open => Carry::Released,
            (carry, None) => carry,
            (Carry::Resting { rest_z_m, .. }, Some(z)) if open || rest_z_m.is_none() => {
                Carry::Resting {
                    rest_z_m: Some(z),
                    risen_steps: 0,
                }
            }
            (
                Carry::Resting {
                    rest_z_m,
                    risen_steps,
                },
                Some(z),
            ) => {
                let risen = rest_z_m.is_some_and(|rest| z - rest > params.lifted_m)
                    && signals.gripper.is_closed();
                let steps = if risen { risen_steps + 1 } else { 0 };
                if steps >= params.hysteresis_steps {
                    Carry::Lifted {
                        top_z_m: z,
                        grip_z_m: signals.ee_m[2] - z,
                    }
                } else {
                    Carry::Resting {
                        rest_z_m,
                        risen_steps: steps,
                    }
                }
            }
            (Carry::Lifted { top_z_m, grip_z_m }, Some(z)) => Carry::Lifted {
                top_z_m: top_z_m.max(z),
                grip_z_m,
            },
            (Carry::Released, _) => Carry::Released,
        };
    }

    fn estimate(&self, params: &PhaseParams, signals: &Signals) -> Phase {
        match self.carry {
            Carry::Released if self.phase == Phase::Release || self.phase == Phase::Stabilise => {
                Phase::Stabilise
            }
            Carry::Released => Phase::Release,
            // An odd grasp shows only in the lift: it has no grasp phase.
            Carry::Lifted { .. } if matches!(self.phase, Phase::Approach | Phase::Grasp) => {
                Phase::Lift
            }
            Carry::Lifted { .. } => match &signals.destination {
                Some(d)
                    if d.distance_xy_m <= params.descend_xy_m
                        && d.clearance_m <= params.descend_clearance_m =>
                {
                    Phase::Descend
                }
                _ => Phase::Transport,
            },
            Carry::Resting { .. } => self.estimate_pick(params, signals),
        }
    }

    fn estimate_pick(&self, params: &PhaseParams, signals: &Signals) -> Phase {
        let Some(target) = &signals.target else {
            return self.phase;
        };
        let near =
            target.distance_xy_m < params.grasp_xy_m && target.height_m < params.grasp_height_m;
        match signals.gripper.state {
            GripperState::Holding | GripperState::Empty if near => Phase::Lift,
            GripperState::Open | GripperState::Closing if near => Phase::Grasp,
            _ if target.distance_m > params.approach_distance_m => Phase::Approach,
            // Between the two thresholds the phase stays, if it is one of a pick.
            _ if is_pick(self.phase) => self.phase,
            _ => Phase::Approach,
        }
    }

    /// A new phase must persist before it counts.
    fn settle_on(&mut self, params: &PhaseParams, estimate: Phase) -> Change {
        if estimate == self.phase || !is_legal(self.phase, estimate) {
            self.candidate = None;
            return Change::None;
        }
        let seen = match self.candidate {
            Some((phase, seen)) if phase == estimate => seen.saturating_add(1),
            _ => 1,
        };
        // A release is latched already: it needs no second look.
        if seen < params.hysteresis_steps && estimate != Phase::Release {
            self.candidate = Some((estimate, seen));
            return Change::None;
        }
        let from = self.phase;
        self.phase = estimate;
        self.steps = 0;
        self.candidate = None;
        let failed_lift = from == Phase::Lift && estimate == Phase::Approach;
        if failed_lift || (is_place(from) && is_pick(estimate)) {
            Change::Attempt
        } else {
            Change::Phase
        }
    }
}

#[cfg(test)]
mod tests;
