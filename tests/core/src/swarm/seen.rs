//! One tick, from both sides: what was so before, what was told, what came of it.

use fitmac_core::{
    Params, State,
    message::{Action, ObjectId, Output},
    wire::{Phase, Route, SubPhase},
};

use super::Told;

/// What was so before the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glimpse {
    /// The running action.
    pub action: Action,
    /// The phase.
    pub phase: Phase,
    /// The subtask's index.
    pub subtask: u32,
    /// The locked target, 0 for none.
    pub target: ObjectId,
    /// The committed grounding epoch.
    pub epoch: u64,
    /// A correction is pending.
    pub pending: bool,
    /// What is left of its budget, queries.
    pub budget: u32,
    /// Corrections of this subtask so far.
    pub activations: u32,
    /// Policy steps since the last correction handed back.
    pub since_hand_back: Option<u32>,
    /// [`Route`] of the last query.
    pub route: u8,
    /// Queries so far.
    pub query: u64,
    /// Failures in a row.
    pub failures: u8,
}

impl Glimpse {
    /// What a controller's state shows.
    #[must_use]
    pub fn of(state: &State) -> Self {
        let subtask = state.subtask();
        Self {
            action: *state.action(),
            phase: subtask.estimator().phase(),
            subtask: subtask.index(),
            target: subtask.lock().target(),
            epoch: subtask.lock().epoch(),
            pending: subtask.recovery().is_pending(),
            budget: subtask.recovery().budget(),
            activations: subtask.recovery().activations(),
            since_hand_back: subtask.recovery().since_hand_back(),
            route: state.decision().route.code(),
            query: state.episode().queries(),
            failures: subtask.streaks().failures(),
        }
    }
}

/// One tick, from both sides.
pub struct Seen<'a> {
    /// The run.
    pub seed: u64,
    /// The controller's parameters.
    pub params: &'a Params,
    /// What was so before.
    pub before: &'a Glimpse,
    /// What the controller was told.
    pub told: &'a Told,
    /// What it answered.
    pub output: &'a Output,
    /// What it remembers now.
    pub after: &'a State,
}

impl Seen<'_> {
    /// The recovery's step.
    ///
    /// # Panics
    /// If the command names none that is known.
    #[must_use]
    pub fn sub_phase(&self) -> SubPhase {
        self.output.command.sub_phase().expect("a known step")
    }

    /// A recovery's action started in this tick.
    #[must_use]
    pub fn starts_recovery_action(&self) -> bool {
        self.output.trace.is_some_and(|r| {
            r.sub_phase != SubPhase::Idle.code()
                && (r.route == Route::Execution.code() || r.route == Route::Pending.code())
        })
    }

    /// A query was decided in this tick.
    #[must_use]
    pub fn queried(&self) -> bool {
        self.after.episode().queries() > self.before.query
    }

    /// An operator or a plan may have begun an episode anew in this tick.
    #[must_use]
    pub fn may_have_restarted(&self) -> bool {
        self.told.request != 0 || self.told.plan.is_some()
    }

    /// The subtask is that of the tick before.
    #[must_use]
    pub fn same_subtask(&self) -> bool {
        self.before.subtask == self.after.subtask().index()
    }
}
