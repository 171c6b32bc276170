//! One query: diagnosis, gate, route, and what the route leads to
//! (Algorithm 1, lines 7 to 40).

use kinematics::vector::Vector3;

use crate::{
    gate::{Authorisation, authorise},
    intake::{Refusal, grounding::GroundingIntake},
    message::{Action, Plan, SUBTASK_CAPACITY, StateSample},
    params::{Params, WhileRebinding},
    queue::{FillMode, effective_horizon},
    reason,
    recovery::{Step, episode_left},
    route::route,
    subtask::{Assessment, Rebind, Subtask},
    trace::Decision,
    verdicts::Verdicts,
    wire::{Diagnosis, Route},
};

/// Plan and budgets of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Episode {
    plan: Option<Plan>,
    queries: u64,
    correction_queries: u32,
    rebinds: u32,
}

impl Episode {
    pub(crate) const fn new() -> Self {
        Self {
            plan: None,
            queries: 0,
            correction_queries: 0,
            rebinds: 0,
        }
    }

    /// Queries so far.
    #[must_use]
    pub const fn queries(&self) -> u64 {
        self.queries
    }

    /// Queries in which a correction replaced the base policy's action.
    #[must_use]
    pub const fn correction_queries(&self) -> u32 {
        self.correction_queries
    }

    /// Queries in which a rebind, other than the first grounding, was committed.
    #[must_use]
    pub const fn rebinds(&self) -> u32 {
        self.rebinds
    }

    /// A new episode of the same plan.
    pub(crate) fn restart(&mut self) {
        *self = Self {
            plan: self.plan,
            ..Self::new()
        };
    }

    /// Takes a plan; true if it replaces another one.
    pub(crate) fn hear_plan(&mut self, plan: &Plan) -> Result<bool, Refusal> {
        let count = plan.subtask_count as usize;
        if count == 0 || count > SUBTASK_CAPACITY || plan.confidence_permille > 1000 {
            return Err(Refusal::BadPlan);
        }
        let replaces = self.plan.is_some_and(|p| p.id != plan.id);
        self.plan = Some(*plan);
        Ok(replaces)
    }

    /// Confidence of the plan; a single, certain subtask if none was given.
    fn plan_confidence(&self) -> f64 {
        self.plan
            .map_or(1.0, |p| f64::from(p.confidence_permille) / 1000.0)
    }

    fn has_subtask(&self, index: u32) -> bool {
        index < self.plan.map_or(1, |p| p.subtask_count)
    }
}

/// What a query leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Decided {
    /// A correction acts.
    Correct {
        /// Its action.
        action: Action,
        /// The waypoint behind it, m.
        waypoint_m: Option<Vector3>,
    },
    /// The base policy acts.
    Policy,
    /// The agents are asked; meanwhile the arm holds, or the base policy acts.
    AskAgents {
        /// The arm holds.
        hold: bool,
    },
}

/// A decided query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Query {
    pub(crate) decision: Decision,
    pub(crate) step: Decided,
    /// The grounding or the subtask changed: chunks of the old prompt are void.
    pub(crate) new_prompt: bool,
    /// The plan's next subtask is active from this query on.
    pub(crate) advanced: bool,
}

/// Decides one query.
pub(crate) fn decide(
    params: &Params,
    now_ns: u64,
    sample: &StateSample,
    episode: &mut Episode,
    subtask: &mut Subtask,
    grounding: &mut GroundingIntake,
    verdicts: &mut Verdicts,
) -> Query {
    episode.queries = episode.queries.saturating_add(1);
    let advanced = advance(params, episode, subtask, grounding, verdicts);
    let assessment = subtask.assess(
        params,
        now_ns,
        sample,
        verdicts,
        episode.plan_confidence(),
        episode.correction_queries,
    );
    if assessment.diagnosis == Diagnosis::Success {
        subtask.estimator.complete();
    }
    let phase = subtask.estimator.phase();
    let gate = authorise(&params.gate, &params.switches, &assessment.question);
    let route = route(subtask.recovery.is_pending(), gate);
    let other = subtask.other();
    let (step, reasons, new_prompt) = match route {
        Route::Base => (Decided::Policy, closed_reasons(gate), false),
        Route::Target => correct_target(params, now_ns, episode, subtask, grounding, gate),
        Route::Execution | Route::Pending => {
            correct_execution(params, sample, episode, subtask, &assessment, gate)
        }
    };
    let asks = matches!(step, Decided::AskAgents { .. });
    if !asks {
        // An open question keeps its evidence until it is answered.
        subtask.heed(assessment.diagnosis, assessment.evidence);
    }
    let mode = fill_mode(params, subtask, &step, new_prompt);
    let decision = Decision {
        kappa: assessment.kappa,
        evidence: assessment.evidence,
        phase,
        diagnosis: assessment.diagnosis,
        route,
        reasons,
        effective_horizon: effective_horizon(&params.chunk, &params.horizon, mode),
        other,
    };
    Query {
        decision,
        step,
        new_prompt: new_prompt || advanced,
        advanced,
    }
}

/// On to the next subtask once this one's success was verified.
fn advance(
    params: &Params,
    episode: &Episode,
    subtask: &mut Subtask,
    grounding: &mut GroundingIntake,
    verdicts: &mut Verdicts,
) -> bool {
    let next = subtask.index().saturating_add(1);
    let advances = subtask.succeeded(params, verdicts.verdict()) && episode.has_subtask(next);
    if advances {
        *subtask = Subtask::fresh(next, subtask.lock().epoch());
        grounding.keep_only(next);
        verdicts.forget();
    }
    advances
}

const fn closed_reasons(gate: Authorisation) -> u64 {
    match gate {
        Authorisation::Closed(bits) => bits,
        Authorisation::Target(_) | Authorisation::Execution(_) => 0,
    }
}

const fn open_reasons(gate: Authorisation) -> u64 {
    match gate {
        Authorisation::Target(bits) | Authorisation::Execution(bits) => bits,
        Authorisation::Closed(_) => 0,
    }
}

/// Target correction: commits what the agents propose, or asks them. The
/// action is the base policy's in either case.
fn correct_target(
    params: &Params,
    now_ns: u64,
    episode: &mut Episode,
    subtask: &mut Subtask,
    grounding: &mut GroundingIntake,
    gate: Authorisation,
) -> (Decided, u64, bool) {
    let reasons = open_reasons(gate);
    if let Some(record) = grounding.take() {
        if subtask.lock().binding().is_some() {
            episode.rebinds = episode.rebinds.saturating_add(1);
        }
        subtask.commit(&record);
        return (Decided::Policy, reasons, true);
    }
    let waited_ns = match subtask.rebind {
        Rebind::Asked { since_ns } => now_ns.saturating_sub(since_ns),
        Rebind::Unanswered => return (Decided::Policy, reasons | reason::AWAITING_REBIND, false),
        // Nothing was found, twice: act without, and wait to be told.
        Rebind::Idle if !subtask.may_ask(params) => {
            return (Decided::Policy, reasons | reason::BUDGET_SPENT, false);
        }
        Rebind::Idle => {
            subtask.ask_rebind(now_ns);
            let hold = params.while_rebinding == WhileRebinding::Hold && !params.switches.none();
            return (Decided::AskAgents { hold }, reasons, false);
        }
    };
    if waited_ns > crate::intake::ms_to_ns(params.lock.rebind_wait_ms) {
        subtask.rebind = Rebind::Unanswered;
    }
    (Decided::Policy, reasons | reason::AWAITING_REBIND, false)
}

/// Execution correction: one action a query, or bottom, and then the base
/// policy acts in the same query.
fn correct_execution(
    params: &Params,
    sample: &StateSample,
    episode: &mut Episode,
    subtask: &mut Subtask,
    assessment: &Assessment,
    gate: Authorisation,
) -> (Decided, u64, bool) {
    let Some(signals) = subtask.signals().copied() else {
        subtask.recovery.cancel();
        return (Decided::Policy, reason::NO_ACTION, false);
    };
    if !subtask.recovery.is_pending() {
        subtask.begin_correction(assessment.question.routine);
    }
    let scene = subtask.scene(params, sample, &signals, assessment);
    let mut reasons = reason::CORRECTION_PENDING;
    if !subtask.recovery.is_pending() {
        reasons = open_reasons(gate);
        let left = episode_left(&params.recovery, episode.correction_queries);
        subtask
            .recovery
            .start(&scene, assessment.question.routine, left);
    }
    match subtask.recovery.step(&scene) {
        Step::Act { action, waypoint_m } => {
            episode.correction_queries = episode.correction_queries.saturating_add(1);
            subtask.follow_recovery();
            (Decided::Correct { action, waypoint_m }, reasons, false)
        }
        Step::Bottom(why) => (Decided::Policy, reasons | why, false),
    }
}

/// In which mode the queue is filled (the rows of the horizon table).
fn fill_mode(params: &Params, subtask: &Subtask, step: &Decided, rebound: bool) -> FillMode {
    let recent = |n: Option<u32>| n.is_some_and(|n| n < params.horizon.hand_back_steps);
    if matches!(step, Decided::Correct { .. }) {
        FillMode::Correction
    } else if params.switches.none() {
        FillMode::Base
    } else if subtask.streaks.failures() > 0 && subtask.lock().binding().is_some() {
        FillMode::Armed
    } else if (rebound && subtask.since_rebind().is_some()) || recent(subtask.since_rebind()) {
        FillMode::Rebound
    } else if recent(subtask.recovery.since_hand_back()) {
        FillMode::HandedBack
    } else {
        FillMode::Base
    }
}

#[cfg(test)]
mod tests;
