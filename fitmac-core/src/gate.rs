//! The adaptive intervention gate (appendix A.5 and C.2): whether evidence is
//! persistent and trustworthy enough to act on.
//!
//! A diagnosis never authorises by itself. The gate is a pure function of a
//! small question, so that all of it can be enumerated.

use crate::{
    params::{Gate as GateParams, Switches},
    reason,
    wire::Diagnosis,
};

/// What a failure is a failure of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureKind {
    /// The binding.
    Target,
    /// The execution.
    Execution,
}

impl FailureKind {
    /// The kind of an actionable diagnosis.
    #[must_use]
    pub const fn of(diagnosis: Diagnosis) -> Option<Self> {
        match diagnosis {
            Diagnosis::TargetCorrection => Some(Self::Target),
            Diagnosis::PickFailure | Diagnosis::PlaceFailure => Some(Self::Execution),
            Diagnosis::None | Diagnosis::RecoveryInProgress | Diagnosis::Success => None,
        }
    }
}

/// The two streaks of the gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Streaks {
    failure: Option<(FailureKind, u8)>,
    confident: u8,
}

impl Streaks {
    /// No streak.
    pub const NONE: Self = Self {
        failure: None,
        confident: 0,
    };

    /// Consecutive actionable failures of one kind.
    #[must_use]
    pub fn failures(&self) -> u8 {
        self.failure.map_or(0, |(_, n)| n)
    }

    /// Consecutive failures of `kind`.
    #[must_use]
    pub fn failures_of(&self, kind: FailureKind) -> u8 {
        match self.failure {
            Some((k, n)) if k == kind => n,
            _ => 0,
        }
    }

    /// Consecutive queries with the target above the gate's confidence.
    #[must_use]
    pub const fn confident(&self) -> u8 {
        self.confident
    }

    /// Counts one query: a failure of another kind restarts the streak at 1,
    /// a query without one clears it.
    pub(crate) fn count(&mut self, params: &GateParams, diagnosis: Diagnosis, kappa: f64) {
        self.failure =
            FailureKind::of(diagnosis).map(|kind| (kind, self.failures_of(kind).saturating_add(1)));
        self.confident = if kappa >= params.confidence {
            self.confident.saturating_add(1)
        } else {
            0
        };
    }
}

/// Which routine an execution correction would run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Routine {
    /// Pick recovery.
    Pick,
    /// Place recovery, to a direct destination.
    Place,
    /// Placement that geometry alone can't do.
    Indirect,
}

/// What the gate decides on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// Some of the evidence is strong.
    pub strong: bool,
    /// No lock was ever committed for this subtask: the first grounding.
    pub initial: bool,
    /// The streaks, this query included.
    pub streaks: Streaks,
    /// Confidence of the lock.
    pub kappa: f64,
    /// The attempt is younger than `gate.rescue_min_step`.
    pub young: bool,
    /// Progress was seen within the progress guard.
    pub progress: bool,
    /// A hand-back was less than the cool-down ago.
    pub cooling: bool,
    /// Activations and queries are left.
    pub budget: bool,
    /// Rebind requests are left.
    pub rebinds: bool,
    /// The plan's parse is certain enough.
    pub plan_certain: bool,
    /// What a correction would run.
    pub routine: Routine,
}

/// The gate's output: Gamma.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Authorisation {
    /// Neither; the bits of [`reason`] say why the gate stays closed.
    Closed(u64),
    /// Target correction; the bits say why.
    Target(u64),
    /// Execution correction; the bits say why.
    Execution(u64),
}

/// Decides what the evidence authorises.
#[must_use]
pub fn authorise(params: &GateParams, switches: &Switches, q: &Question) -> Authorisation {
    match FailureKind::of(q.diagnosis) {
        None => Authorisation::Closed(0),
        Some(FailureKind::Target) => authorise_target(params, switches, q),
        Some(FailureKind::Execution) => authorise_execution(params, switches, q),
    }
}

fn authorise_target(params: &GateParams, switches: &Switches, q: &Question) -> Authorisation {
    if q.initial {
        return Authorisation::Target(reason::INITIAL_GROUNDING);
    }
    let mut closed = Bits(0);
    closed.add(!switches.target_corrector, reason::SWITCHED_OFF);
    closed.add(!q.rebinds, reason::BUDGET_SPENT);
    closed.add(!q.plan_certain, reason::PLAN_UNCERTAIN);
    let persists = u32::from(q.streaks.failures_of(FailureKind::Target)) >= params.failure_streak;
    closed.add(!persists && !q.strong, reason::STREAK_SHORT);
    if closed.0 != 0 {
        return Authorisation::Closed(closed.0);
    }
    let mut open = Bits(0);
    open.add(persists, reason::TARGET_STREAK);
    open.add(q.strong, reason::STRONG_EVIDENCE);
    Authorisation::Target(open.0)
}

fn authorise_execution(params: &GateParams, switches: &Switches, q: &Question) -> Authorisation {
    let enabled = switches.execution_corrector
        && match q.routine {
            Routine::Pick => switches.hard_pick,
            Routine::Place | Routine::Indirect => switches.hard_place,
        };
    let mut closed = Bits(0);
    closed.add(!enabled, reason::SWITCHED_OFF);
    closed.add(q.routine == Routine::Indirect, reason::DESTINATION_INDIRECT);
    closed.add(!q.budget, reason::BUDGET_SPENT);
    closed.add(q.cooling, reason::COOL_DOWN);
    closed.add(!q.plan_certain, reason::PLAN_UNCERTAIN);
    // Weak estimates of the target may never drive a waypoint; a NaN is weak.
    let weak = q.kappa.is_nan() || q.kappa < params.confidence;
    closed.add(weak, reason::CONFIDENCE_LOW);
    let persists =
        u32::from(q.streaks.failures_of(FailureKind::Execution)) >= params.failure_streak;
    let trusted = u32::from(q.streaks.confident()) >= params.confidence_streak;
    if !q.strong {
        closed.add(!persists, reason::STREAK_SHORT);
        closed.add(!trusted, reason::CONFIDENCE_STREAK_SHORT);
        closed.add(q.young, reason::ATTEMPT_YOUNG);
        closed.add(
            q.progress && params.progress_guard_steps > 0,
            reason::PROGRESS,
        );
    }
    if closed.0 != 0 {
        return Authorisation::Closed(closed.0);
    }
    let mut open = Bits(0);
    open.add(persists && trusted, reason::EXECUTION_STREAK);
    open.add(q.strong, reason::STRONG_EVIDENCE);
    Authorisation::Execution(open.0)
}

/// A set of reasons under construction.
struct Bits(u64);

impl Bits {
    fn add(&mut self, holds: bool, bit: u64) {
        if holds {
            self.0 |= bit;
        }
    }
}

#[cfg(test)]
mod tests;
