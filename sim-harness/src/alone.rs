//! The policy alone: what it says goes to the robot untouched, as in LIBERO's evaluations.
//!
//! Time passes as in [`Lockstep`](crate::lockstep::Lockstep): ten steps of standing still, a
//! query whenever the queue is empty, the latency of the answer, then so many actions of it. With
//! the same seed the policy draws the same noise, so an episode alone and one with the controller
//! are a pair.

use std::collections::VecDeque;

use crate::action::{Action, SUBSTEPS, WAIT};
use crate::backbone::{Backbone, Observation};
use crate::error::SimError;
use crate::lockstep::{Outcome, TICK_NS};
use crate::predicate::{Goal, Judge};
use crate::sim::Sim;

/// Policy steps of standing still before the first query, while objects settle.
pub const SETTLE_STEPS: u64 = 10;
/// An answer that has not come after this long is asked for again, ticks.
const LOST_TICKS: u64 = 1_000_000_000 / TICK_NS;

/// What an episode consists of.
pub struct AloneSetup {
    /// The world.
    pub sim: Sim,
    /// What decides success.
    pub goal: Goal,
    /// What the robot is told.
    pub instruction: String,
    /// Who acts.
    pub backbone: Box<dyn Backbone>,
    /// Actions of a chunk that are played before the next query.
    pub open_loop: u32,
    /// Draws the policy's noise.
    pub seed: u64,
    /// Policy steps until the episode is over, those of standing still included.
    pub max_steps: u64,
}

/// An episode of the policy alone.
pub struct Alone {
    setup: AloneSetup,
    judge: Judge,
    tick: u64,
    step: u64,
    due: u64,
    queue: VecDeque<Action>,
    /// Actions on their way, and the tick at which they are there.
    waiting: Option<(u64, Vec<Action>)>,
    outcome: Option<Outcome>,
}

impl Alone {
    /// Everything at the start of an episode.
    #[must_use]
    pub fn new(mut setup: AloneSetup) -> Self {
        setup.backbone.reset(setup.seed);
        Self {
            judge: Judge::new(setup.goal),
            setup,
            tick: 0,
            step: 0,
            due: 0,
            queue: VecDeque::new(),
            waiting: None,
            outcome: None,
        }
    }

    /// The world.
    #[must_use]
    pub fn sim(&self) -> &Sim {
        &self.setup.sim
    }

    /// The world, for pictures.
    pub fn sim_mut(&mut self) -> &mut Sim {
        &mut self.setup.sim
    }

    /// The world, when the episode is over.
    #[must_use]
    pub fn into_sim(self) -> Sim {
        self.setup.sim
    }

    /// Policy steps that were begun.
    #[must_use]
    pub fn policy_step(&self) -> u64 {
        self.step
    }

    /// How the episode ended, once it has.
    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    /// One physics step; the action that began with it, if one did.
    ///
    /// # Errors
    /// [`SimError::Diverged`] if the physics fails.
    pub fn step(&mut self) -> Result<Option<Action>, SimError> {
        let action = if self.tick >= self.due {
            self.next_action()
        } else {
            None
        };
        if let Some(action) = &action {
            self.step += 1;
            // Steps that follow each other keep the grid.
            let on_time = self.tick.saturating_sub(self.due) < u64::from(SUBSTEPS) / 2;
            let begins = if on_time { self.due } else { self.tick };
            self.due = begins + u64::from(SUBSTEPS);
            self.setup.sim.apply(action)?;
        }
        self.setup.sim.step_physics();
        self.tick += 1;
        self.judge();
        Ok(action)
    }

    fn next_action(&mut self) -> Option<Action> {
        if self.step < SETTLE_STEPS {
            return Some(WAIT);
        }
        if self.queue.is_empty() {
            self.fill();
        }
        // A robot takes no action that is not a number; it goes on with the last one.
        while let Some(action) = self.queue.pop_front() {
            if action.iter().all(|a| a.is_finite()) {
                return Some(action);
            }
        }
        None
    }

    /// Moves the answer into the queue if it is there, and asks for one if none is on its way.
    fn fill(&mut self) {
        match self.waiting.take() {
            Some((there, actions)) if there <= self.tick => {
                let played = self.setup.open_loop as usize;
                self.queue.extend(actions.into_iter().take(played));
            }
            Some(still) => self.waiting = Some(still),
            None => self.ask(),
        }
    }

    fn ask(&mut self) {
        let setup = &mut self.setup;
        let seen = Observation::of(&setup.sim, &setup.instruction, self.step);
        let answer = setup.backbone.infer(&seen);
        let late_ns = (answer.latency_s.max(0.0) * 1e9) as u64;
        let lost = answer.copies == 0;
        let late = if lost {
            LOST_TICKS
        } else {
            late_ns.div_ceil(TICK_NS)
        };
        // Actions travel as 32-bit numbers.
        let travel = |action: &Action| action.map(|a| f64::from(a as f32));
        let actions = if lost {
            Vec::new()
        } else {
            answer.actions.iter().map(travel).collect()
        };
        self.waiting = Some((self.tick + late.max(1), actions));
    }

    fn judge(&mut self) {
        if !self.tick.is_multiple_of(u64::from(SUBSTEPS)) {
            return;
        }
        let setup = &self.setup;
        self.outcome = if self.judge.look(&setup.sim) {
            Some(Outcome::Success)
        } else {
            Outcome::at(self.step, self.tick, setup.max_steps)
        };
    }
}
