//! A correction under way: its routine, its budget, and how it ends.

use super::{
    Step,
    edges::is_legal,
    pick::{self, Pick},
    place::{self, Place},
    scene::Scene,
    stuck::Stuck,
    waypoint::{Grip, Motion, recovery_action},
};
use crate::{
    gate::Routine,
    reason,
    signals::GripperState,
    wire::{Phase, SubPhase},
};

/// Most changes of step within one query.
const STEPS_A_QUERY: u32 = 4;

/// A step of a routine: an outcome, or another step in the same query.
pub(super) enum Flow<T> {
    Done(T),
    Again,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Running {
    Pick(Pick),
    Place(Place),
}

impl Running {
    pub(super) const fn sub_phase(&self) -> SubPhase {
        match self {
            Self::Pick(pick) => pick.sub_phase(),
            Self::Place(place) => place.sub_phase(),
        }
    }
}

/// A correction under way.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Active {
    running: Running,
    budget: u32,
    /// Queries of the budget that only a place may use.
    reserve: u32,
    stuck: Stuck,
}

impl Active {
    /// Starts a correction; at most `episode_left` queries.
    pub(super) fn begin(scene: &Scene<'_>, routine: Routine, episode_left: u32) -> Self {
        let p = &scene.params.recovery;
        let (running, budget, reserve) = match (routine, &scene.signals.target) {
            (Routine::Place, Some(target)) => (
                Running::Place(Place::begin(scene, target)),
                p.place_budget,
                0,
            ),
            _ => {
                let reserve = if scene.may_place() { p.place_budget } else { 0 };
                let pick = Pick::begin(scene, p.redescents);
                (
                    Running::Pick(pick),
                    p.pick_budget.saturating_add(reserve),
                    reserve,
                )
            }
        };
        debug_assert!(is_legal(SubPhase::Idle, running.sub_phase()));
        // The pick comes first: what the episode has left goes to it.
        let budget = budget.min(episode_left);
        let reserve = reserve.min(budget.saturating_sub(p.pick_budget));
        Self {
            running,
            budget,
            reserve,
            stuck: Stuck::NEVER,
        }
    }

    /// What runs.
    pub(super) const fn running(&self) -> &Running {
        &self.running
    }

    /// Queries left.
    pub(super) const fn budget(&self) -> u32 {
        self.budget
    }

    /// One query.
    pub(super) fn step(&mut self, scene: &Scene<'_>) -> Step {
        if let Some(end) = self.end(scene) {
            return Step::Bottom(end);
        }
        self.budget = self.budget.saturating_sub(1);
        self.stuck.look(scene.signals.ee_m);
        let scene = &Scene {
            blocked: self.stuck.is_blocked(scene.params.recovery.stuck_queries),
            ..*scene
        };
        let step = match self.stuck.back_out(scene) {
            Some(to_m) => act(scene, &Motion::to(to_m, self.grip(scene))),
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
                Flow::Done(pick::Outcome::Carried) if scene.may_place() => {
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

#[cfg(test)]
mod tests;
