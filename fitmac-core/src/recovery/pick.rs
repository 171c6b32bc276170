//! Pick recovery: hover, descend, close, lift test; open again and re-descend
//! if the test fails.

use super::{
    active::Flow,
    geometry::{Side, better_side, grasp_point, levelling, path_top},
    scene::Scene,
    waypoint::{Grip, Motion},
};
use crate::{
    signals::{GripperState, TargetView},
    wire::SubPhase,
};

/// Most queries of turning the hand before a descent.
const TURN_QUERIES: u32 = 24;
/// Most queries of lowering a thing that is set down.
const SET_DOWN_QUERIES: u32 = 16;
/// Most queries of waiting for the gripper to open.
const OPEN_QUERIES: u32 = 10;

/// The step of a pick, with what only that step remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// Lowering what is held, then opening.
    SetDown {
        goal_z_m: f64,
        lowering: u32,
        opening: u32,
    },
    /// Moving above the target, open, level.
    Hover { turning: u32 },
    /// Down to the grasp point.
    Descend,
    /// Closing.
    Close { queries: u32 },
    /// Raising to see whether the object follows.
    LiftTest {
        ee_z_m: f64,
        object_z_m: f64,
        queries: u32,
        following: u32,
    },
    /// Opening and rising for another try.
    Reopen { queries: u32, goal_z_m: f64 },
}

/// A running pick.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pick {
    step: Step,
    redescents_left: u32,
    /// Where to grasp a rim, once that was chosen; each re-descent tries the
    /// other side.
    side: Option<Side>,
}

/// Whether the routine goes on.
pub(super) enum Outcome {
    Act(Motion),
    /// The object follows the gripper.
    Carried,
    /// No re-descent is left.
    Failed,
}

impl Pick {
    /// `redescents_left` further tries after the first.
    pub(super) fn begin(scene: &Scene<'_>, redescents_left: u32) -> Self {
        let gripper = scene.signals.gripper.state;
        let in_hand = scene.signals.target.is_some_and(|t| {
            gripper == GripperState::Holding && t.distance_m < scene.params.phase.grasp_xy_m
        });
        let ee_z = scene.signals.ee_m[2];
        let step = match (&scene.signals.target, gripper) {
            (Some(target), _) if in_hand => Step::lift_test(ee_z, target),
            (_, GripperState::Open) => Step::Hover { turning: 0 },
            _ => {
                let raised = scene.held_other_rise_m.unwrap_or(0.0).max(0.0);
                Step::SetDown {
                    goal_z_m: ee_z - raised,
                    lowering: 0,
                    opening: 0,
                }
            }
        };
        Self {
            step,
            redescents_left,
            side: None,
        }
    }

    pub(super) const fn redescents_left(&self) -> u32 {
        self.redescents_left
    }

    pub(super) const fn sub_phase(&self) -> SubPhase {
        match self.step {
            Step::SetDown { .. } => SubPhase::SetDown,
            Step::Hover { .. } => SubPhase::ApproachHover,
            Step::Descend => SubPhase::Descend,
            Step::Close { .. } => SubPhase::Close,
            Step::LiftTest { .. } => SubPhase::LiftTest,
            Step::Reopen { .. } => SubPhase::Reopen,
        }
    }

    /// Closing, or testing what the closed gripper holds.
    pub(super) const fn is_closing(&self) -> bool {
        matches!(self.step, Step::Close { .. } | Step::LiftTest { .. })
    }

    pub(super) fn step(&mut self, scene: &Scene<'_>, target: &TargetView) -> Flow<Outcome> {
        match self.step {
            Step::SetDown {
                goal_z_m,
                lowering,
                opening,
            } => self.set_down(scene, goal_z_m, lowering, opening),
            Step::Hover { turning } => self.hover(scene, target, turning),
            Step::Descend => self.descend(scene, target),
            Step::Close { queries } => self.close(scene, target, queries),
            Step::LiftTest {
                ee_z_m,
                object_z_m,
                queries,
                following,
            } => self.lift_test(scene, target, ee_z_m, object_z_m, queries, following),
            Step::Reopen { queries, goal_z_m } => self.reopen(scene, queries, goal_z_m),
        }
    }

    fn grasp_point(&mut self, scene: &Scene<'_>, target: &TargetView) -> [f64; 3] {
        let params = &scene.params.grasp;
        let side = *self
            .side
            .get_or_insert_with(|| better_side(params, scene.sample, target));
        grasp_point(params, scene.sample, target, side)
    }

    fn go(&mut self, step: Step) -> Flow<Outcome> {
        self.step = step;
        Flow::Again
    }

    fn set_down(
        &mut self,
        scene: &Scene<'_>,
        goal_z_m: f64,
        lowering: u32,
        opening: u32,
    ) -> Flow<Outcome> {
        let [x, y, z] = scene.signals.ee_m;
        if z - goal_z_m > scene.params.recovery.grasp_z_m && lowering < SET_DOWN_QUERIES {
            self.step = Step::SetDown {
                goal_z_m,
                lowering: lowering + 1,
                opening,
            };
            return Flow::Done(Outcome::Act(Motion::to([x, y, goal_z_m], Grip::Close)));
        }
        if !scene.is_open() && opening < OPEN_QUERIES {
            self.step = Step::SetDown {
                goal_z_m,
                lowering,
                opening: opening + 1,
            };
            return Flow::Done(Outcome::Act(Motion::to([x, y, z], Grip::Open)));
        }
        self.go(Step::Hover { turning: 0 })
    }

    fn hover(&mut self, scene: &Scene<'_>, target: &TargetView, turning: u32) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        let goal = self.grasp_point(scene, target);
        let [gx, gy, _] = goal;
        let [x, y, z] = scene.signals.ee_m;
        let top = target.position_m[2] + target.half_height_m;
        let hover_z = top + p.hover_m;
        let far = scene.horizontal_to(goal) > scene.params.phase.approach_distance_m;
        // A sideways move below this height would sweep things away.
        let clear_z = path_top(scene.sample, scene.signals.ee_m, goal, &[target.id])
            .map_or(f64::NEG_INFINITY, |h| h + p.clearance_m);
        let travel_z = hover_z.max(clear_z);
        let rotation_rad = levelling(scene.params, scene.sample, target, turning > 0);
        let turns = rotation_rad != [0.0; 3] && turning < TURN_QUERIES;
        let waypoint_m = if far && z < clear_z - p.grasp_z_m {
            [x, y, travel_z]
        } else if far {
            [gx, gy, travel_z]
        } else {
            [gx, gy, hover_z]
        };
        let there = scene.horizontal_to(goal) <= p.hover_xy_m && (z - hover_z).abs() <= p.hover_z_m;
        if there && !turns && scene.is_open() {
            return self.go(Step::Descend);
        }
        self.step = Step::Hover {
            turning: if turns { turning + 1 } else { turning },
        };
        let rotation_rad = if turns { rotation_rad } else { [0.0; 3] };
        Flow::Done(Outcome::Act(Motion {
            waypoint_m,
            rotation_rad,
            grip: Grip::Open,
        }))
    }

    fn descend(&mut self, scene: &Scene<'_>, target: &TargetView) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        let goal = self.grasp_point(scene, target);
        let off_m = scene.horizontal_to(goal);
        if off_m > 2.0 * p.hover_xy_m {
            // The object was pushed, or never stood there: line up again.
            return self.go(Step::Hover { turning: 0 });
        }
        let reached =
            off_m <= p.grasp_xy_m && (scene.signals.ee_m[2] - goal[2]).abs() <= p.grasp_z_m;
        if reached || scene.is_blocked() {
            return self.go(Step::Close { queries: 0 });
        }
        Flow::Done(Outcome::Act(Motion::to(goal, Grip::Open)))
    }

    fn close(&mut self, scene: &Scene<'_>, target: &TargetView, queries: u32) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        let gripper = scene.signals.gripper;
        let settled = queries >= p.close_min && gripper.is_closed();
        if settled || queries >= p.close_max {
            return if gripper.state == GripperState::Empty {
                self.try_again(scene)
            } else {
                self.go(Step::lift_test(scene.signals.ee_m[2], target))
            };
        }
        self.step = Step::Close {
            queries: queries + 1,
        };
        Flow::Done(Outcome::Act(Motion::to(scene.signals.ee_m, Grip::Close)))
    }

    fn lift_test(
        &mut self,
        scene: &Scene<'_>,
        target: &TargetView,
        ee_z_m: f64,
        object_z_m: f64,
        queries: u32,
        following: u32,
    ) -> Flow<Outcome> {
        let p = &scene.params.recovery;
        let [x, y, z] = scene.signals.ee_m;
        let (raised, object_raised) = (z - ee_z_m, target.position_m[2] - object_z_m);
        let follows =
            object_raised > p.lift_pass_m && (object_raised - raised).abs() < p.lift_follow_m;
        let following = if follows { following + 1 } else { 0 };
        if following >= p.lift_queries {
            return Flow::Done(Outcome::Carried);
        }
        if queries >= p.lift_timeout || scene.signals.gripper.state == GripperState::Empty {
            return self.try_again(scene);
        }
        self.step = Step::LiftTest {
            ee_z_m,
            object_z_m,
            queries: queries + 1,
            following,
        };
        Flow::Done(Outcome::Act(Motion::to(
            [x, y, ee_z_m + p.lift_test_m],
            Grip::Close,
        )))
    }

    fn try_again(&mut self, scene: &Scene<'_>) -> Flow<Outcome> {
        let Some(left) = self.redescents_left.checked_sub(1) else {
            return Flow::Done(Outcome::Failed);
        };
        self.redescents_left = left;
        self.side = self.side.map(Side::other);
        let goal_z_m = scene.signals.ee_m[2] + 0.5 * scene.params.recovery.hover_m;
        self.go(Step::Reopen {
            queries: 0,
            goal_z_m,
        })
    }

    fn reopen(&mut self, scene: &Scene<'_>, queries: u32, goal_z_m: f64) -> Flow<Outcome> {
        if scene.is_open() || queries >= OPEN_QUERIES {
            return self.go(Step::Hover { turning: 0 });
        }
        self.step = Step::Reopen {
            queries: queries + 1,
            goal_z_m,
        };
        let [x, y, z] = scene.signals.ee_m;
        // First open where the hand is, then rise: what is half held must not be thrown.
        let z = if queries < OPEN_QUERIES / 2 {
            z
        } else {
            goal_z_m
        };
        Flow::Done(Outcome::Act(Motion::to([x, y, z], Grip::Open)))
    }
}

impl Step {
    const fn lift_test(ee_z_m: f64, target: &TargetView) -> Self {
        let [_, _, object_z_m] = target.position_m;
        Self::LiftTest {
            ee_z_m,
            object_z_m,
            queries: 0,
            following: 0,
        }
    }
}

#[cfg(test)]
mod tests;
