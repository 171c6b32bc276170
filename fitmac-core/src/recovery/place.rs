//! Place recovery: raise to the carry height, move above the destination,
//! lower, release, retreat, settle.

use kinematics::vector::{self, Vector3};

use super::{
    active::Flow,
    geometry::path_top,
    scene::Scene,
    waypoint::{Grip, Motion},
};
use crate::{
    attempt::in_region,
    signals::{DestinationView, GripperState, TargetView},
    wire::{PlaceRelation, SubPhase},
};

/// Most queries of waiting for the gripper to open.
const OPEN_QUERIES: u32 = 10;
/// Most queries of rising after the release.
const RETREAT_QUERIES: u32 = 8;
/// Height above a surface that the object is lowered to, or below it where the touch is felt for, m.
const TOUCH_M: f64 = 0.005;
/// A way on which the arm rises faster than it arrives, m.
const LONG_WAY_M: f64 = 0.20;
/// Change of the carried object's place in the hand that is a drop, m.
const SLIP_M: f64 = 0.06;

/// The step of a place, with what only that step remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    LiftCarry,
    MoveAbove,
    /// Lowering; so many queries of it within reach of the surface.
    Lower {
        touching: u32,
    },
    /// The gripper was told to open, once.
    ReleaseReady {
        at_m: Vector3,
    },
    ReleaseHold {
        queries: u32,
        at_m: Vector3,
    },
    Retreat {
        queries: u32,
        goal_m: Vector3,
    },
    Settle {
        queries: u32,
    },
}

/// A running place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    step: Step,
    grip_m: Vector3,
}

/// Whether the routine goes on.
pub(super) enum Outcome {
    Act(Motion),
    /// A command without a waypoint: up by this share of the action box.
    Rise(f64),
    /// The object is no longer in the hand.
    Dropped,
    /// Released, settled, and judged.
    Finished,
}

impl Place {
    pub(super) fn begin(scene: &Scene<'_>, target: &TargetView) -> Self {
        Self {
            step: Step::LiftCarry,
            grip_m: vector::sub(target.position_m, scene.signals.ee_m),
        }
    }

    pub(super) const fn sub_phase(&self) -> SubPhase {
        match self.step {
            Step::LiftCarry => SubPhase::LiftCarry,
            Step::MoveAbove => SubPhase::MoveAbove,
            Step::Lower { .. } => SubPhase::Lower,
            Step::ReleaseReady { .. } => SubPhase::ReleaseReady,
            Step::ReleaseHold { .. } => SubPhase::ReleaseHold,
            Step::Retreat { .. } => SubPhase::Retreat,
            Step::Settle { .. } => SubPhase::Settle,
        }
    }

    /// True until the gripper was told to open.
    pub(super) const fn is_carrying(&self) -> bool {
        matches!(
            self.step,
            Step::LiftCarry | Step::MoveAbove | Step::Lower { .. }
        )
    }

    pub(super) fn step(
        &mut self,
        scene: &Scene<'_>,
        target: &TargetView,
        destination: &DestinationView,
    ) -> Flow<Outcome> {
        if self.is_carrying() && !self.carries(scene, target) {
            return Flow::Done(Outcome::Dropped);
        }
        match self.step {
            Step::LiftCarry => self.lift_carry(scene, target, destination),
            Step::MoveAbove => self.move_above(scene, target, destination),
            Step::Lower { touching } => self.lower(scene, target, destination, touching),
            Step::ReleaseReady { at_m } => self.go(Step::ReleaseHold { queries: 1, at_m }),
            Step::ReleaseHold { queries, at_m } => self.release_hold(scene, queries, at_m),
            Step::Retreat { queries, goal_m } => self.retreat(scene, queries, goal_m),
            Step::Settle { queries } => self.settle(scene, queries),
        }
    }

    fn go(&mut self, step: Step) -> Flow<Outcome> {
        self.step = step;
        Flow::Again
    }

    fn carries(&self, scene: &Scene<'_>, target: &TargetView) -> bool {
        let moved = vector::distance(
            vector::sub(target.position_m, scene.signals.ee_m),
            self.grip_m,
        );
        scene.signals.gripper.state != GripperState::Empty && moved < SLIP_M
    }

    /// Height of the tool centre point for carrying: the object's underside
    /// clears the destination and everything on the way.
    fn carry_z(scene: &Scene<'_>, target: &TargetView, destination: &DestinationView) -> f64 {
        let p = &scene.params.recovery;
        let hangs = scene.signals.ee_m[2] - (target.position_m[2] - target.half_height_m);
        let over_destination = destination.position_m[2] + p.carry_m;
        let path = path_top(
            scene.sample,
            target.position_m,
            destination.position_m,
            &[target.id, scene.destination_object],
        );
        path.map_or(over_destination, |h| {
            over_destination.max(h + p.clearance_m)
        }) + hangs
    }

    fn lift_carry(
        &mut self,
        scene: &Scene<'_>,
        target: &TargetView,
        d: &DestinationView,
    ) -> Flow<Outcome> {
        let [x, y, z] = scene.signals.ee_m;
        let carry_z = Self::carry_z(scene, target, d);
        let left_m = carry_z - z;
        // On a long way the rest of the rise is made under way.
        let may_travel = left_m <= scene.params.recovery.hover_z_m
            || (d.distance_xy_m > LONG_WAY_M && left_m < scene.params.recovery.rise_under_way_m);
        if may_travel || scene.is_blocked() {
            return self.go(Step::MoveAbove);
        }
        Flow::Done(Outcome::Act(Motion::to([x, y, carry_z], Grip::Close)))
    }

    fn move_above(
        &mut self,
        scene: &Scene<'_>,
        target: &TargetView,
        d: &DestinationView,
    ) -> Flow<Outcome> {
        if d.distance_xy_m <= Self::align(scene, d) {
            return self.go(Step::Lower { touching: 0 });
        }
        let [x, y, _] = aligned(scene, target, d);
        let z = Self::carry_z(scene, target, d);
        Flow::Done(Outcome::Act(Motion::to([x, y, z], Grip::Close)))
    }

    fn lower(
        &mut self,
        scene: &Scene<'_>,
        target: &TargetView,
        d: &DestinationView,
        touching: u32,
    ) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        let align = Self::align(scene, d);
        if d.distance_xy_m > 2.0 * align {
            return self.go(Step::MoveAbove);
        }
        let (low_enough, goal_clearance, patience) = match d.relation {
            PlaceRelation::On if p.touch_queries > 0 => (p.release_on_m, -TOUCH_M, p.touch_queries),
            PlaceRelation::On => (p.release_on_m, TOUCH_M, 0),
            PlaceRelation::In => (-p.release_in_m + TOUCH_M, -p.release_in_m, 0),
        };
        let low = d.clearance_m <= low_enough;
        // Noise may hide the touch: patience ends the wait for it.
        let touches = touching >= patience || d.clearance_m <= 0.0;
        let landed = scene.is_blocked() && d.clearance_m < p.release_on_m + 0.04;
        if ((low && touches) || landed) && d.distance_xy_m <= align {
            let at_m = scene.signals.ee_m;
            self.step = Step::ReleaseReady { at_m };
            return Flow::Done(Outcome::Act(Motion::to(at_m, Grip::Open)));
        }
        self.step = Step::Lower {
            touching: if low { touching.saturating_add(1) } else { 0 },
        };
        let [x, y, _] = aligned(scene, target, d);
        let z = scene.signals.ee_m[2] + goal_clearance - d.clearance_m;
        Flow::Done(Outcome::Act(Motion::to([x, y, z], Grip::Close)))
    }

    fn release_hold(&mut self, scene: &Scene<'_>, queries: u32, at_m: Vector3) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        let held_long_enough = queries >= p.release_hold && scene.is_open();
        if held_long_enough || queries >= p.release_hold.max(OPEN_QUERIES) {
            let [x, y, z] = scene.signals.ee_m;
            return self.go(Step::Retreat {
                queries: 0,
                goal_m: [x, y, z + p.retreat_m],
            });
        }
        self.step = Step::ReleaseHold {
            queries: queries + 1,
            at_m,
        };
        Flow::Done(Outcome::Act(Motion::to(at_m, Grip::Open)))
    }

    fn retreat(&mut self, scene: &Scene<'_>, queries: u32, goal_m: Vector3) -> Flow<Outcome> {
        let there = goal_m[2] - scene.signals.ee_m[2] <= scene.params.recovery.hover_z_m;
        if there || queries >= RETREAT_QUERIES {
            return self.go(Step::Settle { queries: 0 });
        }
        self.step = Step::Retreat {
            queries: queries + 1,
            goal_m,
        };
        Flow::Done(Outcome::Act(Motion::to(goal_m, Grip::Open)))
    }

    fn settle(&mut self, scene: &Scene<'_>, queries: u32) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        if queries >= p.settle.saturating_add(p.verify) {
            return Flow::Done(Outcome::Finished);
        }
        self.step = Step::Settle {
            queries: queries + 1,
        };
        let up = if queries < p.settle { p.settle_up } else { 0.0 };
        if up == 0.0 && in_region(scene.signals) == Some(false) {
            return Flow::Done(Outcome::Finished);
        }
        Flow::Done(Outcome::Rise(up))
    }

    const fn align(scene: &Scene<'_>, d: &DestinationView) -> f64 {
        match d.relation {
            PlaceRelation::On => scene.params.recovery.align_on_m,
            PlaceRelation::In => scene.params.recovery.align_in_m,
        }
    }
}

/// The tool centre point's place that brings the object's centre over the
/// destination, at the present height.
fn aligned(scene: &Scene<'_>, target: &TargetView, d: &DestinationView) -> Vector3 {
    let [dx, dy, _] = vector::sub(d.position_m, target.position_m);
    vector::add(scene.signals.ee_m, [dx, dy, 0.0])
}

#[cfg(test)]
mod tests;
