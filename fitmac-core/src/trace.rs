//! Trace records: what the core saw and decided, in plain data.

use crate::{
    intake::Refusal,
    message::{ACTION_DIM, Action, TraceRecord},
    params::Params,
    subtask::Subtask,
    wire::{Diagnosis, EventKind, Mode, Phase, Route, Verdict},
};

/// What was decided at a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Confidence of the lock.
    pub kappa: f64,
    /// Evidence at hand.
    pub evidence: u64,
    /// The phase that was diagnosed.
    pub phase: Phase,
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// The route.
    pub route: Route,
    /// Why: what opened the gate, or keeps it closed.
    pub reasons: u64,
    /// Actions that the query may execute.
    pub effective_horizon: u32,
    /// Object that the arm approached or held instead of the target.
    pub other: u16,
}

impl Decision {
    /// Before the first query.
    pub const NONE: Self = Self {
        kappa: 0.0,
        evidence: 0,
        phase: Phase::Approach,
        diagnosis: Diagnosis::None,
        route: Route::Base,
        reasons: 0,
        effective_horizon: 0,
        other: 0,
    };
}

/// When and where in the episode a record is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    pub(crate) stamp_ns: u64,
    pub(crate) query: u64,
    pub(crate) policy_step: u64,
    pub(crate) mode: Mode,
    pub(crate) verdict: Verdict,
}

/// No number.
const NONE_M: [f64; 3] = [f64::NAN; 3];

/// A record of `kind`, with what the subtask knows at `moment`.
pub(crate) fn record(
    kind: EventKind,
    moment: &Moment,
    params: &Params,
    subtask: &Subtask,
    decision: &Decision,
) -> TraceRecord {
    let signals = subtask.signals();
    let target = signals.and_then(|s| s.target);
    let streaks = subtask.streaks;
    // What a query leads to may begin a new attempt; its record shows the
    // phase that was judged.
    let phase = match kind {
        EventKind::Query => decision.phase,
        _ => subtask.estimator.phase(),
    };
    TraceRecord {
        stamp_ns: moment.stamp_ns,
        query: moment.query,
        policy_step: moment.policy_step,
        evidence: decision.evidence,
        reasons: decision.reasons,
        epoch: subtask.lock().epoch(),
        attempt: subtask.attempt.id(),
        phase_steps: subtask.estimator.steps(),
        budget: subtask.recovery.budget(),
        effective_horizon: decision.effective_horizon,
        attempt_steps: subtask.attempt.steps(),
        subtask: subtask.index(),
        detail: 0,
        target: subtask.lock().target(),
        other: decision.other,
        kind: kind.code(),
        phase: phase.code(),
        diagnosis: decision.diagnosis.code(),
        route: decision.route.code(),
        mode: moment.mode.code(),
        sub_phase: subtask.recovery.sub_phase().code(),
        verdict: moment.verdict.code(),
        failure_streak: streaks.failures(),
        confidence_streak: streaks.confident(),
        redescents: u8::try_from(subtask.recovery.redescents()).unwrap_or(u8::MAX),
        gripper_closed: u8::from(signals.is_some_and(|s| s.gripper.is_closed())),
        lifted: u8::from(subtask.estimator.is_lifted()),
        kappa: decision.kappa,
        target_distance_m: target.map_or(f64::NAN, |t| t.distance_m),
        destination_distance_m: signals
            .and_then(|s| s.destination)
            .map_or(f64::NAN, |d| d.distance_m),
        gripper_width_m: signals.map_or(params.gripper.open_width_m, |s| s.gripper.width_m),
        ee_position_m: signals.map_or(NONE_M, |s| s.ee_m),
        target_position_m: target.map_or(NONE_M, |t| t.position_m),
        waypoint_m: NONE_M,
        base_action: [f64::NAN; ACTION_DIM],
        action: [f64::NAN; ACTION_DIM],
    }
}

/// The record of an action that starts.
pub(crate) fn with_action(
    mut record: TraceRecord,
    action: &Action,
    base_action: Option<&Action>,
    waypoint_m: Option<[f64; 3]>,
) -> TraceRecord {
    record.action = *action;
    if let Some(base) = base_action {
        record.base_action = *base;
    }
    if let Some(waypoint) = waypoint_m {
        record.waypoint_m = waypoint;
    }
    record
}

/// The record of a refused message.
pub(crate) fn with_refusal(mut record: TraceRecord, refusal: Refusal) -> TraceRecord {
    record.detail = refusal.code();
    record
}
