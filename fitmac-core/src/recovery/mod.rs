//! Execution correction (section 3.5 and appendix C.2): takes the arm for a
//! bounded pick or place, and hands it back.
//!
//! Every correction ends: each query costs one unit of a budget that never
//! grows while the correction runs.

mod edges;
pub mod geometry;
mod pick;
mod place;
pub mod waypoint;

pub use edges::{EDGES, is_legal};

use kinematics::vector::{self, Vector3};

use crate::{
    gate::Routine,
    message::{Action, ObjectId, StateSample},
    params::{Params, RecoveryParams},
    reason,
    signals::{GripperState, Signals},
    wire::{Phase, SubPhase},
};
use pick::Pick;
use place::Place;
use waypoint::{Grip, Motion, recovery_action};

/// Most changes of step within one query.
const STEPS_A_QUERY: u32 = 4;
/// Command above which an arm that stands still is stuck.
const PUSHING: f64 = 0.3;
/// Motion below which an arm stands still, m a policy step.
const STANDING_M: f64 = 0.002;
/// How far the arm backs out of a joint limit: towards the base and up, m.
const BACK_OUT_M: [f64; 2] = [0.08, 0.05];

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

    fn is_open(&self) -> bool {
        let gripper = self.signals.gripper;
        gripper.state == GripperState::Open
            && gripper.width_m > 0.9 * self.params.gripper.open_width_m
    }

    fn horizontal_to(&self, goal: Vector3) -> f64 {
        let [dx, dy, _] = vector::sub(goal, self.signals.ee_m);
        vector::norm([dx, dy, 0.0])
    }

    const fn is_blocked(&self) -> bool {
        self.blocked
    }

    fn at_joint_limit(&self) -> bool {
        let margin = self.params.recovery.joint_margin_rad;
        let limits = geometry::JOINT_LIMITS_RAD;
        self.sample
            .joint_position_rad
            .iter()
            .zip(limits)
            .any(|(&q, [lower, upper])| q < lower + margin || q > upper - margin)
    }
}

/// A step of a routine: an outcome, or another step in the same query.
enum Flow<T> {
    Done(T),
    Again,
}

/// What a query of the correction gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// An action, and the waypoint behind it.
    Act {
        /// The action.
        action: Action,
        /// The waypoint, base frame, m.
        waypoint_m: Option<Vector3>,
    },
    /// No action (the paper's bottom): the correction has ended, the base
    /// policy acts; the bits of [`reason`] say why.
    Bottom(u64),
}

#[derive(Clone, Debug, PartialEq)]
enum Running {
    Pick(Pick),
    Place(Place),
}

impl Running {
    const fn sub_phase(&self) -> SubPhase {
        match self {
            Self::Pick(pick) => pick.sub_phase(),
            Self::Place(place) => place.sub_phase(),
        }
    }
}

/// A correction under way.
#[derive(Clone, Debug, PartialEq)]
struct Active {
    running: Running,
    budget: u32,
    /// Queries of the budget that only a place may use.
    reserve: u32,
    stuck: Stuck,
}

/// Notices an arm that stands still under command.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stuck {
    pushed_from_m: Option<Vector3>,
    queries: u32,
    backing_out: u32,
}

impl Stuck {
    const NEVER: Self = Self {
        pushed_from_m: None,
        queries: 0,
        backing_out: 0,
    };

    fn look(&mut self, ee_m: Vector3) {
        let still = self
            .pushed_from_m
            .is_some_and(|p| vector::distance(p, ee_m) < STANDING_M);
        self.queries = if still {
            self.queries.saturating_add(1)
        } else {
            0
        };
    }

    fn note(&mut self, ee_m: Vector3, [x, y, z, ..]: &Action) {
        self.pushed_from_m = (vector::norm([*x, *y, *z]) > PUSHING).then_some(ee_m);
    }
}

/// The correction state R of Algorithm 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovery {
    active: Option<Active>,
    activations: u32,
    /// Policy steps since the last hand-back.
    handed_back: Option<u32>,
}

impl Recovery {
    pub(crate) const fn new() -> Self {
        Self {
            active: None,
            activations: 0,
            handed_back: None,
        }
    }

    /// True while a correction is pending.
    #[must_use]
    pub const fn is_pending(&self) -> bool {
        self.active.is_some()
    }

    /// True while a place is pending, up to its end.
    #[must_use]
    pub const fn is_placing(&self) -> bool {
        matches!(
            &self.active,
            Some(Active {
                running: Running::Place(_),
                ..
            })
        )
    }

    /// Corrections started in this subtask.
    #[must_use]
    pub const fn activations(&self) -> u32 {
        self.activations
    }

    /// Policy steps since the last hand-back, if there was one.
    #[must_use]
    pub const fn since_hand_back(&self) -> Option<u32> {
        self.handed_back
    }

    /// Queries left to the running correction.
    #[must_use]
    pub fn budget(&self) -> u32 {
        self.active.as_ref().map_or(0, |a| a.budget)
    }

    /// Re-descents left to the running correction.
    #[must_use]
    pub fn redescents(&self) -> u32 {
        match &self.active {
            Some(Active {
                running: Running::Pick(pick),
                ..
            }) => pick.redescents_left(),
            _ => 0,
        }
    }

    /// The running correction's step.
    #[must_use]
    pub fn sub_phase(&self) -> SubPhase {
        self.active
            .as_ref()
            .map_or(SubPhase::Idle, |a| a.running.sub_phase())
    }

    /// A policy step went by.
    pub(crate) fn count_step(&mut self) {
        self.handed_back = self.handed_back.map(|n| n.saturating_add(1));
    }

    /// Starts a correction; at most `episode_left` queries.
    pub(crate) fn start(&mut self, scene: &Scene<'_>, routine: Routine, episode_left: u32) {
        let p = &scene.params.recovery;
        let (running, budget, reserve) = match (routine, &scene.signals.target) {
            (Routine::Place, Some(target)) => (
                Running::Place(Place::begin(scene, target)),
                p.place_budget,
                0,
            ),
            _ => {
                let reserve = if may_place(scene) { p.place_budget } else { 0 };
                let pick = Pick::begin(scene, p.redescents);
                (
                    Running::Pick(pick),
                    p.pick_budget.saturating_add(reserve),
                    reserve,
                )
            }
        };
        debug_assert!(is_legal(SubPhase::Idle, running.sub_phase()));
        self.activations = self.activations.saturating_add(1);
        // The pick comes first: what the episode has left goes to it.
        let budget = budget.min(episode_left);
        let reserve = reserve.min(budget.saturating_sub(p.pick_budget));
        self.active = Some(Active {
            running,
            budget,
            reserve,
            stuck: Stuck::NEVER,
        });
    }

    /// Ends a running correction without an action.
    pub(crate) fn cancel(&mut self) {
        if self.active.take().is_some() {
            self.handed_back = Some(0);
        }
    }

    /// One query of the running correction.
    pub(crate) fn step(&mut self, scene: &Scene<'_>) -> Step {
        let step = match &mut self.active {
            None => Step::Bottom(reason::NO_ACTION),
            Some(active) => active.step(scene),
        };
        if let Step::Bottom(_) = step {
            self.cancel();
        }
        step
    }
}

/// A pick may be followed by a place of our own.
fn may_place(scene: &Scene<'_>) -> bool {
    scene.params.switches.hard_place && scene.destination_object != 0
}

impl Active {
    fn step(&mut self, scene: &Scene<'_>) -> Step {
        if let Some(end) = self.end(scene) {
            return Step::Bottom(end);
        }
        self.budget = self.budget.saturating_sub(1);
        self.stuck.look(scene.signals.ee_m);
        let scene = &Scene {
            blocked: self.stuck.queries >= scene.params.recovery.stuck_queries,
            ..*scene
        };
        let step = match self.back_out(scene) {
            Some(motion) => act(scene, &motion),
            None => self.run(scene),
        };
        if let Step::Act { action, .. } = &step {
            self.stuck.note(scene.signals.ee_m, action);
        }
        step
    }

    /// Why the correction ends before it acts again.
    fn end(&self, scene: &Scene<'_>) -> Option<u64> {
        let reserve = match &self.running {
            Running::Pick(_) => self.reserve,
            Running::Place(_) => 0,
        };
        if scene.success {
            Some(reason::CORRECTED)
        } else if !scene.lock_valid || scene.signals.target.is_none() {
            Some(reason::VALIDITY_LOST)
        } else if !self.fits(scene.phase) {
            Some(reason::PHASE_INCOMPATIBLE)
        } else if self.budget <= reserve {
            Some(reason::BUDGET_EXHAUSTED)
        } else {
            None
        }
    }

    /// A place that still carries does not fit a phase in which the object was
    /// let go; nothing fits a completed subtask.
    fn fits(&self, phase: Phase) -> bool {
        match &self.running {
            Running::Place(place) if place.is_carrying() => {
                !matches!(phase, Phase::Stabilise | Phase::Complete)
            }
            Running::Pick(_) | Running::Place(_) => phase != Phase::Complete,
        }
    }

    fn run(&mut self, scene: &Scene<'_>) -> Step {
        for _ in 0..STEPS_A_QUERY {
            let before = self.running.sub_phase();
            let flow = self.advance(scene);
            let now = self.running.sub_phase();
            debug_assert!(before == now || is_legal(before, now), "{before} to {now}");
            match flow {
                Flow::Done(step) => return step,
                Flow::Again => {}
            }
        }
        // More changes than a query may make: stand still, go on in the next.
        act(scene, &Motion::to(scene.signals.ee_m, self.grip(scene)))
    }

    /// The gripper as the running step has it.
    fn grip(&self, scene: &Scene<'_>) -> Grip {
        match &self.running {
            Running::Place(place) if place.is_carrying() => Grip::Close,
            Running::Pick(pick) if pick.is_closing() => Grip::Close,
            _ if scene.signals.gripper.state != GripperState::Open => Grip::Close,
            _ => Grip::Open,
        }
    }

    fn advance(&mut self, scene: &Scene<'_>) -> Flow<Step> {
        let Some(target) = &scene.signals.target else {
            return Flow::Done(Step::Bottom(reason::VALIDITY_LOST));
        };
        match &mut self.running {
            Running::Pick(pick) => match pick.step(scene, target) {
                Flow::Again => Flow::Again,
                Flow::Done(pick::Outcome::Act(motion)) => Flow::Done(act(scene, &motion)),
                Flow::Done(pick::Outcome::Failed) => {
                    Flow::Done(Step::Bottom(reason::BUDGET_EXHAUSTED))
                }
                Flow::Done(pick::Outcome::Carried) if may_place(scene) => {
                    self.running = Running::Place(Place::begin(scene, target));
                    Flow::Again
                }
                Flow::Done(pick::Outcome::Carried) => Flow::Done(Step::Bottom(reason::CORRECTED)),
            },
            Running::Place(place) => {
                let Some(destination) = &scene.signals.destination else {
                    return Flow::Done(Step::Bottom(reason::VALIDITY_LOST));
                };
                match place.step(scene, target, destination) {
                    Flow::Again => Flow::Again,
                    Flow::Done(place::Outcome::Act(motion)) => Flow::Done(act(scene, &motion)),
                    Flow::Done(place::Outcome::Rise(up)) => Flow::Done(Step::Act {
                        action: [0.0, 0.0, up, 0.0, 0.0, 0.0, Grip::Open.value()],
                        waypoint_m: None,
                    }),
                    Flow::Done(place::Outcome::Finished) => {
                        Flow::Done(Step::Bottom(reason::CORRECTED))
                    }
                    Flow::Done(place::Outcome::Dropped) => self.pick_up_again(scene),
                }
            }
        }
    }

    /// The object slipped: pick it up again, within the budget that is left.
    fn pick_up_again(&mut self, scene: &Scene<'_>) -> Flow<Step> {
        if !scene.params.switches.hard_pick {
            return Flow::Done(Step::Bottom(reason::VALIDITY_LOST));
        }
        self.reserve = 0;
        self.running = Running::Pick(Pick::begin(scene, 1));
        Flow::Again
    }

    /// At a joint limit the arm freezes under a saturated command: retract
    /// towards the base and up for a few queries.
    fn back_out(&mut self, scene: &Scene<'_>) -> Option<Motion> {
        if scene.blocked && self.stuck.backing_out == 0 && scene.at_joint_limit() {
            self.stuck.backing_out = scene.params.recovery.back_out_queries;
        }
        self.stuck.backing_out = self.stuck.backing_out.checked_sub(1)?;
        let [x, y, z] = scene.signals.ee_m;
        let reach = vector::norm([x, y, 0.0]);
        let [inwards, up] = BACK_OUT_M;
        let share = if reach > 1e-6 {
            (reach - inwards).max(0.0) / reach
        } else {
            1.0
        };
        let grip = self.grip(scene);
        Some(Motion::to([x * share, y * share, z + up], grip))
    }
}

fn act(scene: &Scene<'_>, motion: &Motion) -> Step {
    let p = &scene.params;
    match recovery_action(&p.action, &p.filter, scene.signals.ee_m, motion) {
        Some(action) => Step::Act {
            action,
            waypoint_m: Some(motion.waypoint_m),
        },
        None => Step::Bottom(reason::NO_ACTION),
    }
}

/// Whether the episode's recovery budget has queries left.
#[must_use]
pub const fn episode_left(params: &RecoveryParams, used: u32) -> u32 {
    params.episode_budget.saturating_sub(used)
}
