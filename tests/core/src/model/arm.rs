//! The correction: pick, place, and the budgets of both.

use fitmac_core::{
    message::StateSample,
    params::Params,
    reason,
    wire::{GraspClass, Phase, PlaceRelation, SubPhase},
};

use super::{
    sight::{Look, Pads, Place, Target, grasp_z, half_height, rim, things},
    space::{Frame, Point, apart, flat, length, minus, plus},
};

/// What a query of a correction is decided on.
pub(super) struct Scene<'a> {
    pub(super) p: &'a Params,
    pub(super) sample: &'a StateSample,
    pub(super) look: Look,
    pub(super) phase: Phase,
    pub(super) anchor: u16,
    pub(super) other_rise: Option<f64>,
    pub(super) success: bool,
    pub(super) valid: bool,
}

/// What comes of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Said {
    Act([f64; 7], Option<Point>),
    Bottom(u64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    SetDown {
        goal_z: f64,
        lowering: u32,
        opening: u32,
    },
    Hover {
        turning: u32,
    },
    Down,
    Close {
        n: u32,
    },
    Test {
        ee_z: f64,
        object_z: f64,
        n: u32,
        follows: u32,
    },
    Reopen {
        n: u32,
        goal_z: f64,
    },
    Raise,
    Over,
    /// Lowering; so many queries of it low above a surface.
    Lower {
        low: u32,
    },
    Ready {
        at: Point,
    },
    Release {
        n: u32,
        at: Point,
    },
    Retreat {
        n: u32,
        goal: Point,
    },
    Settle {
        n: u32,
    },
}

/// One change of stage, or what the query gives.
enum Flow {
    To(Stage),
    Move(Stage, Point, Point, f64),
    Rise(Stage, f64),
    End(u64),
    Carried,
    Dropped,
    Again,
}

/// A running correction.
#[derive(Clone, Debug)]
pub(super) struct Arm {
    stage: Stage,
    pub(super) budget: u32,
    reserve: u32,
    tries: u32,
    /// +1 or -1: which point of a rim.
    side: Option<f64>,
    /// The object's place in the hand.
    grip: Point,
    pushed_from: Option<Point>,
    standing: u32,
    backing: u32,
}

const OPEN: f64 = -1.0;
const CLOSE: f64 = 1.0;
const STILL: Point = [0.0; 3];

impl Scene<'_> {
    fn open(&self) -> bool {
        self.look.pads == Pads::Open && self.look.width > 0.9 * self.p.gripper.open_width_m
    }

    fn beside(&self, goal: Point) -> f64 {
        flat(minus(goal, self.look.ee))
    }

    pub(super) fn may_place(&self) -> bool {
        self.p.switches.hard_place && self.anchor != 0
    }

    fn at_joint_limit(&self) -> bool {
        // Franka, "Robot and interface specifications".
        const LIMITS: [(f64, f64); 7] = [
            (-2.8973, 2.8973),
            (-1.7628, 1.7628),
            (-2.8973, 2.8973),
            (-3.0718, -0.0698),
            (-2.8973, 2.8973),
            (-0.0175, 3.7525),
            (-2.8973, 2.8973),
        ];
        let margin = self.p.recovery.joint_margin_rad;
        let joints = self.sample.joint_position_rad.iter().zip(LIMITS);
        joints
            .into_iter()
            .any(|(q, (lo, hi))| *q < lo + margin || *q > hi - margin)
    }

    /// Highest top of what stands within the hand's sweep on a way.
    fn top_on_way(&self, from: Point, to: Point, except: &[u16]) -> Option<f64> {
        let [dx, dy, _] = minus(to, from);
        let square = dx * dx + dy * dy;
        things(self.sample)
            .iter()
            .filter(|o| !except.contains(&o.id))
            .filter(|o| {
                let [ox, oy, _] = minus(o.position_m, from);
                let share = if square > 1e-12 {
                    ((ox * dx + oy * dy) / square).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let (rx, ry) = (ox - share * dx, oy - share * dy);
                let reach = o.half_extent_m[0].max(o.half_extent_m[1]) + 0.06;
                rx * rx + ry * ry < reach * reach
            })
            .map(|o| o.position_m[2] + half_height(o))
            .reduce(f64::max)
    }

    /// A grasp point: at the axis, or at one side of a rim.
    fn grasp_at(&self, t: &Target, side: f64) -> Point {
        let z = grasp_z(&self.p.grasp, t);
        let radius = rim(&self.p.grasp, t.class, t.half);
        let [ax, ay, _] = Frame::new(self.sample.ee_orientation).outwards([0.0, 1.0, 0.0]);
        let long = flat([ax, ay, 0.0]);
        if radius <= 0.0 || long < 1e-6 {
            [t.at[0], t.at[1], z]
        } else {
            let by = side * radius / long;
            [t.at[0] + ax * by, t.at[1] + ay * by, z]
        }
    }

    /// The side that fewer things crowd, the nearer one of equals.
    fn better_side(&self, t: &Target) -> f64 {
        let crowd = |at: Point| {
            things(self.sample)
                .iter()
                .filter(|o| o.id != t.id)
                .filter(|o| o.position_m[2] + half_height(o) > at[2] - 0.02)
                .filter(|o| {
                    let [dx, dy, _] = minus(o.position_m, at);
                    let reach = o.half_extent_m[0].max(o.half_extent_m[1]) + 0.02;
                    dx * dx + dy * dy < reach * reach
                })
                .count()
        };
        let [plus_side, minus_side] = [1.0, -1.0].map(|side| self.grasp_at(t, side));
        let by_crowd = crowd(minus_side).cmp(&crowd(plus_side));
        let ee = self.sample.ee_position_m;
        let by_way = apart(minus_side, ee).total_cmp(&apart(plus_side, ee));
        if by_crowd.then(by_way).is_lt() {
            -1.0
        } else {
            1.0
        }
    }

    /// The turn that levels the hand and brings the fingers along a box.
    fn levelling(&self, t: &Target, begun: bool) -> Point {
        let p = &self.p.recovery;
        let share = if begun { 0.25 } else { 1.0 };
        let hand = Frame::new(self.sample.ee_orientation);
        let mut turn = STILL;
        if p.level_rad > 0.0 {
            let [x, y, z] = hand.outwards([0.0, 0.0, 1.0]);
            // The axis that is square to the approach and to straight down.
            let axis = [-y, x, 0.0];
            let sine = length(axis);
            let angle = sine.atan2(-z);
            if sine >= 1e-9 && angle > share * p.level_rad {
                turn = axis.map(|a| a * angle / sine);
            }
        }
        if p.align_yaw_rad > 0.0 && t.class == GraspClass::Box {
            let closing = hand.outwards([0.0, 1.0, 0.0]);
            let boxed = Frame::new(t.quaternion);
            let fits = |half: f64| 2.0 * half < 0.9 * self.p.gripper.open_width_m;
            let yaws: Vec<f64> = [(t.half[0], [1.0, 0.0, 0.0]), (t.half[1], [0.0, 1.0, 0.0])]
                .into_iter()
                .filter(|(half, _)| fits(*half))
                .map(|(_, axis)| {
                    let side = boxed.outwards(axis);
                    let cross = closing[0] * side[1] - closing[1] * side[0];
                    let dot = closing[0] * side[0] + closing[1] * side[1];
                    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
                    (sign * cross).atan2(sign * dot)
                })
                .collect();
            let yaw = yaws
                .into_iter()
                .reduce(|a, b| if a.abs() <= b.abs() { a } else { b });
            if let Some(yaw) = yaw.filter(|y| y.abs() > share * p.align_yaw_rad) {
                turn[2] += yaw;
            }
        }
        turn
    }

    /// Equations 8 and 9.
    fn action(&self, goal: Point, turn: Point, grip: f64) -> Option<[f64; 7]> {
        let (a, f) = (&self.p.action, &self.p.filter);
        let box_ = [
            (f.workspace_min_x_m, f.workspace_max_x_m),
            (f.workspace_min_y_m, f.workspace_max_y_m),
            (f.workspace_min_z_m, f.workspace_max_z_m),
        ];
        if !goal
            .iter()
            .zip(box_)
            .all(|(x, (lo, hi))| (lo..=hi).contains(x))
        {
            return None;
        }
        let [dx, dy, dz] = minus(goal, self.look.ee);
        let (xy, z) = (a.recovery_divisor_xy_m, a.recovery_divisor_z_m);
        let way = [dx / xy, dy / xy, dz / z];
        let turn = turn.map(|r| r / a.rotation_rad);
        let all = [way, turn].concat();
        if !all.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut action = [grip; 7];
        for (slot, x) in action.iter_mut().zip(all) {
            *slot = x.clamp(-1.0, 1.0);
        }
        Some(action)
    }
}

impl Arm {
    pub(super) fn pick(scene: &Scene<'_>, left: u32) -> Self {
        let p = &scene.p.recovery;
        let reserve = if scene.may_place() { p.place_budget } else { 0 };
        let budget = (p.pick_budget + reserve).min(left);
        let mut arm = Self::begun(begin_pick(scene), budget);
        arm.tries = p.redescents;
        arm.reserve = reserve.min(budget.saturating_sub(p.pick_budget));
        arm
    }

    pub(super) fn place(scene: &Scene<'_>, target: &Target, left: u32) -> Self {
        let mut arm = Self::begun(Stage::Raise, scene.p.recovery.place_budget.min(left));
        arm.grip = minus(target.at, scene.look.ee);
        arm
    }

    fn begun(stage: Stage, budget: u32) -> Self {
        Self {
            stage,
            budget,
            reserve: 0,
            tries: 0,
            side: None,
            grip: STILL,
            pushed_from: None,
            standing: 0,
            backing: 0,
        }
    }

    pub(super) fn step_name(&self) -> SubPhase {
        match self.stage {
            Stage::SetDown { .. } => SubPhase::SetDown,
            Stage::Hover { .. } => SubPhase::ApproachHover,
            Stage::Down => SubPhase::Descend,
            Stage::Close { .. } => SubPhase::Close,
            Stage::Test { .. } => SubPhase::LiftTest,
            Stage::Reopen { .. } => SubPhase::Reopen,
            Stage::Raise => SubPhase::LiftCarry,
            Stage::Over => SubPhase::MoveAbove,
            Stage::Lower { .. } => SubPhase::Lower,
            Stage::Ready { .. } => SubPhase::ReleaseReady,
            Stage::Release { .. } => SubPhase::ReleaseHold,
            Stage::Retreat { .. } => SubPhase::Retreat,
            Stage::Settle { .. } => SubPhase::Settle,
        }
    }

    pub(super) fn picking(&self) -> bool {
        self.step_name() <= SubPhase::Reopen
    }

    /// Placing, and the gripper was not told to open yet.
    fn carrying(&self) -> bool {
        matches!(self.stage, Stage::Raise | Stage::Over | Stage::Lower { .. })
    }

    pub(super) fn redescents(&self) -> u32 {
        if self.picking() { self.tries } else { 0 }
    }

    /// Why the correction is over before it acts.
    fn over(&self, scene: &Scene<'_>) -> Option<u64> {
        let gone =
            scene.phase == Phase::Complete || (self.carrying() && scene.phase == Phase::Stabilise);
        let kept = if self.picking() { self.reserve } else { 0 };
        let reasons = [
            (scene.success, reason::CORRECTED),
            (
                !scene.valid || scene.look.target.is_none(),
                reason::VALIDITY_LOST,
            ),
            (gone, reason::PHASE_INCOMPATIBLE),
            (self.budget <= kept, reason::BUDGET_EXHAUSTED),
        ];
        reasons
            .iter()
            .find(|(holds, _)| *holds)
            .map(|(_, why)| *why)
    }

    /// One query.
    pub(super) fn query(&mut self, scene: &Scene<'_>) -> Said {
        if let Some(why) = self.over(scene) {
            return Said::Bottom(why);
        }
        self.budget -= 1;
        let ee = scene.look.ee;
        let stands = self.pushed_from.is_some_and(|from| apart(from, ee) < 0.002);
        self.standing = if stands { self.standing + 1 } else { 0 };
        let blocked = self.standing >= scene.p.recovery.stuck_queries;
        if blocked && self.backing == 0 && scene.at_joint_limit() {
            self.backing = scene.p.recovery.back_out_queries;
        }
        let said = if self.backing > 0 {
            self.backing -= 1;
            self.back_out(scene)
        } else {
            self.run(scene, blocked)
        };
        if let Said::Act(a, _) = &said {
            let pushes = length([a[0], a[1], a[2]]) > 0.3;
            self.pushed_from = pushes.then_some(ee);
        }
        said
    }

    fn idle_grip(&self, scene: &Scene<'_>) -> f64 {
        let shut =
            self.carrying() || matches!(self.stage, Stage::Close { .. } | Stage::Test { .. });
        if !shut && scene.look.pads == Pads::Open {
            OPEN
        } else {
            CLOSE
        }
    }

    /// Towards the base and up.
    fn back_out(&self, scene: &Scene<'_>) -> Said {
        let [x, y, z] = scene.look.ee;
        let reach = flat([x, y, 0.0]);
        let share = if reach > 1e-6 {
            (reach - 0.08).max(0.0) / reach
        } else {
            1.0
        };
        say(
            scene,
            [x * share, y * share, z + 0.05],
            STILL,
            self.idle_grip(scene),
        )
    }

    fn run(&mut self, scene: &Scene<'_>, blocked: bool) -> Said {
        let Some(target) = scene.look.target else {
            return Said::Bottom(reason::VALIDITY_LOST);
        };
        for _ in 0..4 {
            let flow = if self.picking() {
                self.pick_on(scene, &target, blocked)
            } else {
                match scene.look.place {
                    Some(place) => self.place_on(scene, &target, &place, blocked),
                    None => Flow::End(reason::VALIDITY_LOST),
                }
            };
            match flow {
                Flow::To(stage) => self.stage = stage,
                Flow::Move(stage, goal, turn, grip) => {
                    self.stage = stage;
                    return say(scene, goal, turn, grip);
                }
                Flow::Rise(stage, up) => {
                    self.stage = stage;
                    return Said::Act([0.0, 0.0, up, 0.0, 0.0, 0.0, OPEN], None);
                }
                Flow::End(why) => return Said::Bottom(why),
                Flow::Carried if scene.may_place() => {
                    self.stage = Stage::Raise;
                    self.grip = minus(target.at, scene.look.ee);
                }
                Flow::Carried => return Said::Bottom(reason::CORRECTED),
                Flow::Dropped if scene.p.switches.hard_pick => {
                    self.reserve = 0;
                    (self.tries, self.side) = (1, None);
                    self.stage = begin_pick(scene);
                }
                Flow::Dropped => return Said::Bottom(reason::VALIDITY_LOST),
                Flow::Again => match self.tries.checked_sub(1) {
                    None => return Said::Bottom(reason::BUDGET_EXHAUSTED),
                    Some(left) => {
                        self.tries = left;
                        self.side = self.side.map(|side| -side);
                        let goal_z = scene.look.ee[2] + 0.5 * scene.p.recovery.hover_m;
                        self.stage = Stage::Reopen { n: 0, goal_z };
                    }
                },
            }
        }
        say(scene, scene.look.ee, STILL, self.idle_grip(scene))
    }

    fn pick_on(&mut self, scene: &Scene<'_>, t: &Target, blocked: bool) -> Flow {
        let p = &scene.p.recovery;
        let ee = scene.look.ee;
        let [x, y, z] = ee;
        match self.stage {
            Stage::SetDown {
                goal_z,
                lowering,
                opening,
            } => {
                if z - goal_z > p.grasp_z_m && lowering < 16 {
                    let stage = Stage::SetDown {
                        goal_z,
                        lowering: lowering + 1,
                        opening,
                    };
                    Flow::Move(stage, [x, y, goal_z], STILL, CLOSE)
                } else if !scene.open() && opening < 10 {
                    let stage = Stage::SetDown {
                        goal_z,
                        lowering,
                        opening: opening + 1,
                    };
                    Flow::Move(stage, ee, STILL, OPEN)
                } else {
                    Flow::To(Stage::Hover { turning: 0 })
                }
            }
            Stage::Hover { turning } => self.hover(scene, t, turning),
            Stage::Down => {
                let goal = self.goal(scene, t);
                let off = scene.beside(goal);
                let there = off <= p.grasp_xy_m && (z - goal[2]).abs() <= p.grasp_z_m;
                if off > 2.0 * p.hover_xy_m {
                    Flow::To(Stage::Hover { turning: 0 })
                } else if there || blocked {
                    Flow::To(Stage::Close { n: 0 })
                } else {
                    Flow::Move(Stage::Down, goal, STILL, OPEN)
                }
            }
            Stage::Close { n } => {
                let over = n >= p.close_max || (n >= p.close_min && scene.look.closed());
                if !over {
                    Flow::Move(Stage::Close { n: n + 1 }, ee, STILL, CLOSE)
                } else if scene.look.pads == Pads::Empty {
                    Flow::Again
                } else {
                    Flow::To(test(scene, t))
                }
            }
            Stage::Test {
                ee_z,
                object_z,
                n,
                follows,
            } => {
                let (hand, object) = (z - ee_z, t.at[2] - object_z);
                let with = object > p.lift_pass_m && (object - hand).abs() < p.lift_follow_m;
                let follows = if with { follows + 1 } else { 0 };
                if follows >= p.lift_queries {
                    Flow::Carried
                } else if n >= p.lift_timeout || scene.look.pads == Pads::Empty {
                    Flow::Again
                } else {
                    let stage = Stage::Test {
                        ee_z,
                        object_z,
                        n: n + 1,
                        follows,
                    };
                    Flow::Move(stage, [x, y, ee_z + p.lift_test_m], STILL, CLOSE)
                }
            }
            Stage::Reopen { n, goal_z } => {
                if scene.open() || n >= 10 {
                    return Flow::To(Stage::Hover { turning: 0 });
                }
                let z = if n < 5 { z } else { goal_z };
                Flow::Move(Stage::Reopen { n: n + 1, goal_z }, [x, y, z], STILL, OPEN)
            }
            _ => unreachable!("a stage of a place"),
        }
    }

    fn goal(&mut self, scene: &Scene<'_>, t: &Target) -> Point {
        let side = *self.side.get_or_insert_with(|| scene.better_side(t));
        scene.grasp_at(t, side)
    }

    fn hover(&mut self, scene: &Scene<'_>, t: &Target, turning: u32) -> Flow {
        let p = &scene.p.recovery;
        let goal = self.goal(scene, t);
        let [x, y, z] = scene.look.ee;
        let hover_z = t.at[2] + t.half_height + p.hover_m;
        let clear_z = scene
            .top_on_way(scene.look.ee, goal, &[t.id])
            .map(|top| top + p.clearance_m);
        let travel_z = clear_z.map_or(hover_z, |c| hover_z.max(c));
        let beside = scene.beside(goal);
        let far = beside > scene.p.phase.approach_distance_m;
        let turn = scene.levelling(t, turning > 0);
        let turns = turn != STILL && turning < 24;
        let there = beside <= p.hover_xy_m && (z - hover_z).abs() <= p.hover_z_m;
        if there && !turns && scene.open() {
            return Flow::To(Stage::Down);
        }
        let low = clear_z.is_some_and(|c| z < c - p.grasp_z_m);
        let way = match (far, low) {
            (true, true) => [x, y, travel_z],
            (true, false) => [goal[0], goal[1], travel_z],
            (false, _) => [goal[0], goal[1], hover_z],
        };
        let (turning, turn) = if turns {
            (turning + 1, turn)
        } else {
            (turning, STILL)
        };
        Flow::Move(Stage::Hover { turning }, way, turn, OPEN)
    }

    fn place_on(&self, scene: &Scene<'_>, t: &Target, d: &Place, blocked: bool) -> Flow {
        let p = &scene.p.recovery;
        let ee = scene.look.ee;
        let [x, y, z] = ee;
        let slipped = apart(minus(t.at, ee), self.grip) >= 0.06;
        if self.carrying() && (slipped || scene.look.pads == Pads::Empty) {
            return Flow::Dropped;
        }
        let hangs = z - (t.at[2] - t.half_height);
        let carry_z = || {
            let over = d.at[2] + p.carry_m;
            let way = scene.top_on_way(t.at, d.at, &[t.id, scene.anchor]);
            way.map_or(over, |top| over.max(top + p.clearance_m)) + hangs
        };
        let centred = |z: f64| [x + d.at[0] - t.at[0], y + d.at[1] - t.at[1], z];
        // Onto a surface it presses on for a while, unless it opens above it.
        let feels = p.touch_queries > 0 && d.relation == PlaceRelation::On;
        let (align, low_m, goal) = match d.relation {
            PlaceRelation::On if feels => (p.align_on_m, p.release_on_m, -0.005),
            PlaceRelation::On => (p.align_on_m, p.release_on_m, 0.005),
            PlaceRelation::In => (p.align_in_m, 0.005 - p.release_in_m, -p.release_in_m),
        };
        match self.stage {
            Stage::Raise => {
                let left = carry_z() - z;
                let long_way = d.beside > 0.20 && left < p.rise_under_way_m;
                if left <= p.hover_z_m || long_way || blocked {
                    Flow::To(Stage::Over)
                } else {
                    Flow::Move(Stage::Raise, [x, y, carry_z()], STILL, CLOSE)
                }
            }
            Stage::Over if d.beside <= align => Flow::To(Stage::Lower { low: 0 }),
            Stage::Over => Flow::Move(Stage::Over, centred(carry_z()), STILL, CLOSE),
            Stage::Lower { .. } if d.beside > 2.0 * align => Flow::To(Stage::Over),
            Stage::Lower { low } => {
                let is_low = d.clearance <= low_m;
                let touches = !feels || low >= p.touch_queries || d.clearance <= 0.0;
                let landed = blocked && d.clearance < p.release_on_m + 0.04;
                if ((is_low && touches) || landed) && d.beside <= align {
                    Flow::Move(Stage::Ready { at: ee }, ee, STILL, OPEN)
                } else {
                    let z = z + goal - d.clearance;
                    let low = if is_low { low + 1 } else { 0 };
                    Flow::Move(Stage::Lower { low }, centred(z), STILL, CLOSE)
                }
            }
            Stage::Ready { at } => Flow::To(Stage::Release { n: 1, at }),
            Stage::Release { n, at } => {
                let long = n >= p.release_hold && scene.open();
                if long || n >= p.release_hold.max(10) {
                    let goal = plus(ee, [0.0, 0.0, p.retreat_m]);
                    Flow::To(Stage::Retreat { n: 0, goal })
                } else {
                    Flow::Move(Stage::Release { n: n + 1, at }, at, STILL, OPEN)
                }
            }
            Stage::Retreat { n, goal } => {
                if goal[2] - z <= p.hover_z_m || n >= 8 {
                    Flow::To(Stage::Settle { n: 0 })
                } else {
                    Flow::Move(Stage::Retreat { n: n + 1, goal }, goal, STILL, OPEN)
                }
            }
            Stage::Settle { n } => {
                let up = if n < p.settle { p.settle_up } else { 0.0 };
                let astray = up == 0.0 && scene.look.in_region() == Some(false);
                if n >= p.settle + p.verify || astray {
                    Flow::End(reason::CORRECTED)
                } else {
                    Flow::Rise(Stage::Settle { n: n + 1 }, up)
                }
            }
            _ => unreachable!("a stage of a pick"),
        }
    }
}

fn begin_pick(scene: &Scene<'_>) -> Stage {
    let look = &scene.look;
    let in_hand = look
        .target
        .filter(|t| look.pads == Pads::Holding && t.distance < scene.p.phase.grasp_xy_m);
    match in_hand {
        Some(target) => test(scene, &target),
        None if look.pads == Pads::Open => Stage::Hover { turning: 0 },
        None => Stage::SetDown {
            goal_z: look.ee[2] - scene.other_rise.unwrap_or(0.0).max(0.0),
            lowering: 0,
            opening: 0,
        },
    }
}

fn test(scene: &Scene<'_>, t: &Target) -> Stage {
    Stage::Test {
        ee_z: scene.look.ee[2],
        object_z: t.at[2],
        n: 0,
        follows: 0,
    }
}

fn say(scene: &Scene<'_>, goal: Point, turn: Point, grip: f64) -> Said {
    match scene.action(goal, turn, grip) {
        Some(action) => Said::Act(action, Some(goal)),
        None => Said::Bottom(reason::NO_ACTION),
    }
}
