//! An arm that stands still under command, and its way out of a joint limit.

use kinematics::vector::{self, Vector3};

use super::scene::Scene;
use crate::message::Action;

/// Command above which an arm that stands still is stuck.
const PUSHING: f64 = 0.3;
/// Motion below which an arm stands still, m a policy step.
const STANDING_M: f64 = 0.002;
/// How far the arm backs out of a joint limit: towards the base and up, m.
const BACK_OUT_M: [f64; 2] = [0.08, 0.05];

/// Notices an arm that stands still under command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stuck {
    pushed_from_m: Option<Vector3>,
    queries: u32,
    backing_out: u32,
}

impl Stuck {
    pub(super) const NEVER: Self = Self {
        pushed_from_m: None,
        queries: 0,
        backing_out: 0,
    };

    pub(super) fn look(&mut self, ee_m: Vector3) {
        let still = self
            .pushed_from_m
            .is_some_and(|p| vector::distance(p, ee_m) < STANDING_M);
        self.queries = if still {
            self.queries.saturating_add(1)
        } else {
            0
        };
    }

    pub(super) fn note(&mut self, ee_m: Vector3, [x, y, z, ..]: &Action) {
        self.pushed_from_m = (vector::norm([*x, *y, *z]) > PUSHING).then_some(ee_m);
    }

    /// The arm has stood still under command for as long as it may.
    pub(super) const fn is_blocked(&self, patience: u32) -> bool {
        self.queries >= patience
    }

    /// At a joint limit the arm freezes under a saturated command: retract
    /// towards the base and up for a few queries. Gives the waypoint, m.
    pub(super) fn back_out(&mut self, scene: &Scene<'_>) -> Option<Vector3> {
        if scene.is_blocked() && self.backing_out == 0 && scene.at_joint_limit() {
            self.backing_out = scene.params.recovery.back_out_queries;
        }
        self.backing_out = self.backing_out.checked_sub(1)?;
        let [x, y, z] = scene.signals.ee_m;
        let reach = vector::norm([x, y, 0.0]);
        let [inwards, up] = BACK_OUT_M;
        let share = if reach > 1e-6 {
            (reach - inwards).max(0.0) / reach
        } else {
            1.0
        };
        Some([x * share, y * share, z + up])
    }
}

#[cfg(test)]
mod tests;
