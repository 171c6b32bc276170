//! What a correction sees in one query.

use kinematics::vector::{self, Vector3};

use super::geometry;
use crate::{
    message::{ObjectId, StateSample},
    params::Params,
    signals::{GripperState, Signals},
    wire::Phase,
};

/// What a recovery sees in one query.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// All parameters.
    pub params: &'a Params,
    /// The newest state.
    pub sample: &'a StateSample,
    /// The signals of this step.
    pub signals: &'a Signals,
    /// The phase.
    pub phase: Phase,
    /// The anchor object of the destination, 0 if none.
    pub destination_object: ObjectId,
    /// How far a wrongly held object was raised, m.
    pub held_other_rise_m: Option<f64>,
    /// The subtask's success was verified.
    pub success: bool,
    /// The lock is still trusted.
    pub lock_valid: bool,
    /// The arm stands still under command.
    pub blocked: bool,
}

impl<'a> Scene<'a> {
    /// A scene in which nothing blocks the arm.
    #[must_use]
    pub const fn new(params: &'a Params, sample: &'a StateSample, signals: &'a Signals) -> Self {
        Self {
            params,
            sample,
            signals,
            phase: Phase::Approach,
            destination_object: 0,
            held_other_rise_m: None,
            success: false,
            lock_valid: true,
            blocked: false,
        }
    }

    pub(super) fn is_open(&self) -> bool {
        let gripper = self.signals.gripper;
        gripper.state == GripperState::Open
            && gripper.width_m > 0.9 * self.params.gripper.open_width_m
    }

    pub(super) fn horizontal_to(&self, goal: Vector3) -> f64 {
        let [dx, dy, _] = vector::sub(goal, self.signals.ee_m);
        vector::norm([dx, dy, 0.0])
    }

    pub(super) const fn is_blocked(&self) -> bool {
        self.blocked
    }

    pub(super) fn at_joint_limit(&self) -> bool {
        let margin = self.params.recovery.joint_margin_rad;
        let limits = geometry::JOINT_LIMITS_RAD;
        self.sample
            .joint_position_rad
            .iter()
            .zip(limits)
            .any(|(&q, [lower, upper])| q < lower + margin || q > upper - margin)
    }

    /// A pick may be followed by a place of our own.
    pub(super) const fn may_place(&self) -> bool {
        self.params.switches.hard_place && self.destination_object != 0
    }
}

#[cfg(test)]
mod tests;
