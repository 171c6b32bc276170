//! The active subtask: everything that is remembered about it, and nothing of
//! the one before. A change of subtask is a construction.

use crate::{
    attempt::{Attempt, in_region},
    diagnosis::{self, DiagnosisHistory},
    evidence,
    gate::{self, Routine, Streaks},
    lock::{Destination, Lock},
    message::{GroundingRecord, ObjectId, StateSample},
    monitor::Monitor,
    params::Params,
    phase::{Carry, Change, PhaseEstimator, is_pick, is_place},
    recovery::{Recovery, Scene, episode_left},
    signals::{GripperState, GripperView, Memory, Signals},
    tracking::Tracking,
    verdicts::Verdicts,
    wire::{Diagnosis, SubPhase, Verdict},
};

/// Whether the target is being looked at again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rebind {
    /// No request is open.
    Idle,
    /// The agents were asked.
    Asked {
        /// When.
        since_ns: u64,
    },
    /// They did not answer in time; the binding stays as it is.
    Unanswered,
}

/// What the newest look says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assessment {
    /// Confidence of the lock.
    pub kappa: f64,
    /// Bits of [`evidence`], the unheeded included.
    pub evidence: u64,
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// What the gate is asked.
    pub question: gate::Question,
}

/// What is remembered about the active subtask.
#[derive(Clone, Debug, PartialEq)]
pub struct Subtask {
    index: u32,
    pub(crate) lock: Lock,
    pub(crate) estimator: PhaseEstimator,
    pub(crate) monitor: Monitor,
    pub(crate) attempt: Attempt,
    pub(crate) diagnoses: DiagnosisHistory,
    pub(crate) streaks: Streaks,
    pub(crate) recovery: Recovery,
    tracking: Tracking,
    pub(crate) rebind: Rebind,
    rebinds: u32,
    /// Policy steps since a rebind moved the lock.
    since_rebind: Option<u32>,
    signals: Option<Signals>,
    level_bits: u64,
}

impl Subtask {
    /// Subtask `index`, nothing seen; epochs go on from `epoch`.
    pub(crate) const fn fresh(index: u32, epoch: u64) -> Self {
        Self {
            index,
            lock: Lock::open(epoch),
            estimator: PhaseEstimator::new(),
            monitor: Monitor::new(),
            attempt: Attempt::first(),
            diagnoses: DiagnosisHistory::new(),
            streaks: Streaks::NONE,
            recovery: Recovery::new(),
            tracking: Tracking::new(),
            rebind: Rebind::Idle,
            rebinds: 0,
            since_rebind: None,
            signals: None,
            level_bits: 0,
        }
    }

    /// Its place in the plan, from 0.
    #[must_use]
    pub const fn index(&self) -> u32 {
        self.index
    }

    /// The lock on the target.
    #[must_use]
    pub const fn lock(&self) -> &Lock {
        &self.lock
    }

    /// The phase and what carries it.
    #[must_use]
    pub const fn estimator(&self) -> &PhaseEstimator {
        &self.estimator
    }

    /// The monitor.
    #[must_use]
    pub const fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// The attempt.
    #[must_use]
    pub const fn attempt(&self) -> &Attempt {
        &self.attempt
    }

    /// The last diagnoses.
    #[must_use]
    pub const fn diagnoses(&self) -> &DiagnosisHistory {
        &self.diagnoses
    }

    /// The streaks of the gate.
    #[must_use]
    pub const fn streaks(&self) -> &Streaks {
        &self.streaks
    }

    /// The correction.
    #[must_use]
    pub const fn recovery(&self) -> &Recovery {
        &self.recovery
    }

    /// The signals of the newest policy step.
    #[must_use]
    pub const fn signals(&self) -> Option<&Signals> {
        self.signals.as_ref()
    }

    /// Policy steps since a rebind moved the lock, if one did.
    #[must_use]
    pub const fn since_rebind(&self) -> Option<u32> {
        self.since_rebind
    }

    /// Observes one policy step.
    pub(crate) fn observe(
        &mut self,
        params: &Params,
        sample: &StateSample,
        width_before_m: f64,
        commanded_closed: bool,
        verdict: Verdict,
    ) {
        let gripper = GripperView::new(&params.gripper, sample, width_before_m, commanded_closed);
        let holding = gripper.state == GripperState::Holding;
        let anchor = self.lock.anchor().map_or(0, |a| a.object);
        self.tracking
            .step(params, sample, self.lock.target(), anchor, holding);
        let memory = Memory {
            lock: &self.lock,
            gripper,
            tracking: &self.tracking,
        };
        let signals = Signals::new(params, sample, &memory);
        match self.estimator.step(&params.phase, &signals) {
            Change::None => {}
            Change::Phase => self.monitor.enter_phase(),
            Change::Attempt => self.next_attempt(),
        }
        let (phase, steps) = (self.estimator.phase(), self.estimator.steps());
        self.level_bits = self.monitor.step(params, phase, steps, &signals);
        // What was let go in its region may still roll: time alone doesn't speak against it.
        if self.estimator.carry() == Carry::Released && in_region(&signals) == Some(true) {
            self.level_bits &= !evidence::TIME_BASED;
        }
        self.attempt.step(
            params,
            &signals,
            &self.estimator,
            self.monitor.history(),
            verdict,
        );
        if self.attempt.latched() & evidence::DROPPED != 0 && self.estimator.is_lifted() {
            self.restart_attempt();
        }
        self.since_rebind = self.since_rebind.map(|n| n.saturating_add(1));
        self.recovery.count_step();
        self.signals = Some(signals);
    }

    fn next_attempt(&mut self) {
        self.attempt.next();
        self.monitor.enter_phase();
    }

    /// The attempt has failed: its next one starts with an approach.
    pub(crate) fn restart_attempt(&mut self) {
        if self.estimator.restart() == Change::Attempt {
            self.next_attempt();
        }
    }

    /// The signals of earlier steps do not continue in the next sample.
    pub(crate) fn forget_motion(&mut self) {
        self.monitor.forget();
        self.streaks = Streaks::NONE;
    }

    /// True if the subtask's success is known.
    #[must_use]
    pub fn succeeded(&self, params: &Params, verdict: Verdict) -> bool {
        match verdict {
            Verdict::Success => true,
            Verdict::Fail => false,
            Verdict::Unknown => self
                .signals
                .as_ref()
                .is_some_and(|s| self.attempt.is_placed(&params.evidence, s)),
        }
    }

    /// Judges the evidence at a query; counts the streaks.
    pub(crate) fn assess(
        &mut self,
        params: &Params,
        now_ns: u64,
        sample: &StateSample,
        verdicts: &Verdicts,
        plan_confidence: f64,
        episode_queries: u32,
    ) -> Assessment {
        let carried = self.tracking.is_carried();
        let bound = self.lock.kappa(&params.lock, now_ns, Some(sample), carried);
        let in_hand = carried && self.estimator.is_lifted();
        let kappa = if bound > 0.0 && (in_hand || self.recovery.is_placing()) {
            bound.max(params.lock.agreed)
        } else {
            bound
        };
        let rules =
            self.level_bits | self.attempt.latched() | self.lock.evidence(&params.lock, kappa);
        let critic = verdicts.critic_evidence(&params.evidence);
        let young = self.attempt.steps() < params.gate.rescue_min_step;
        let asked = diagnosis::Question {
            evidence: rules,
            phase: self.estimator.phase(),
            success: self.succeeded(params, verdicts.verdict()),
            pending: self.recovery.is_pending(),
            young,
            binding_settled: self.binding_settled(params),
        };
        let diagnosis = asked.diagnose();
        self.diagnoses.push(diagnosis);
        self.streaks.count(&params.gate, diagnosis, kappa);
        let counted = asked.against_target() | asked.against_execution();
        let guard = params.gate.progress_guard_steps;
        let question = gate::Question {
            diagnosis,
            strong: counted & evidence::STRONG != 0,
            initial: self.lock.binding().is_none(),
            streaks: self.streaks,
            kappa,
            young,
            progress: self.monitor.since_progress() < guard,
            cooling: self
                .recovery
                .since_hand_back()
                .is_some_and(|n| n < params.gate.cool_down_steps),
            budget: self.recovery.activations() < params.gate.activations
                && episode_left(&params.recovery, episode_queries) > 0,
            rebinds: self.may_ask(params) || self.rebind != Rebind::Idle,
            plan_certain: plan_confidence >= params.gate.plan_confidence,
            routine: self.routine(params),
        };
        Assessment {
            kappa,
            evidence: rules | critic,
            diagnosis,
            question,
        }
    }

    /// Looking again would not help, or can't be asked for, or comes too late:
    /// from now on a wrong object speaks against the execution.
    fn binding_settled(&self, params: &Params) -> bool {
        let Some(binding) = self.lock.binding() else {
            return false;
        };
        binding.confirmed
            || self.rebind == Rebind::Unanswered
            || !params.switches.target_corrector
            || (self.rebind == Rebind::Idle && !self.may_ask(params))
    }

    /// Requests to the agents are left.
    pub(crate) const fn may_ask(&self, params: &Params) -> bool {
        self.rebinds < params.lock.rebinds
    }

    /// What an execution correction would run now.
    fn routine(&self, params: &Params) -> Routine {
        if self.estimator.carry() == Carry::Released && self.outcome_unknown() {
            return Routine::Indirect;
        }
        let carrying = self.estimator.is_lifted() && is_place(self.estimator.phase());
        if !carrying {
            return Routine::Pick;
        }
        match self.lock.binding().map(|b| b.destination) {
            Some(Destination::Direct(_)) if self.has_destination() => Routine::Place,
            _ if params.switches.hard_place => Routine::Indirect,
            _ => Routine::Place,
        }
    }

    /// Released, and nobody can say where it should lie: geometry knows no
    /// direct destination and the verifier did not deny it. A thing that may
    /// lie right is left alone.
    fn outcome_unknown(&self) -> bool {
        let denied = self.attempt.latched() & evidence::VERIFIER_NEGATIVE != 0;
        !denied && self.signals.as_ref().and_then(in_region).is_none()
    }

    fn has_destination(&self) -> bool {
        self.signals.is_some_and(|s| s.destination.is_some())
    }

    /// The query has used the evidence.
    pub(crate) fn heed(&mut self, diagnosis: Diagnosis, evidence: u64) {
        self.attempt.clear_latched();
        let misplaced =
            evidence & evidence::VERIFIER_NEGATIVE != 0 && diagnosis == Diagnosis::PlaceFailure;
        if misplaced && !self.recovery.is_pending() {
            self.restart_attempt();
        }
    }

    /// A pick that follows a release, a drop or a misplaced object begins a new
    /// attempt: the place that failed is over.
    pub(crate) fn begin_correction(&mut self, routine: Routine) {
        if routine == Routine::Pick && is_place(self.estimator.phase()) {
            self.restart_attempt();
        }
    }

    /// A pick recovery begins a new attempt, whatever the policy's attempt came
    /// to: once its hand is open, and at once if the target had been let go.
    pub(crate) fn follow_recovery(&mut self) {
        let open_handed = matches!(
            self.recovery.sub_phase(),
            SubPhase::ApproachHover | SubPhase::Descend | SubPhase::Reopen
        );
        let closed = matches!(
            self.recovery.sub_phase(),
            SubPhase::Close | SubPhase::LiftTest
        );
        let let_go = self.estimator.carry() == Carry::Released;
        if (open_handed && !is_pick(self.estimator.phase())) || (closed && let_go) {
            self.restart_attempt();
        }
    }

    /// Asks the agents to look again.
    pub(crate) fn ask_rebind(&mut self, now_ns: u64) {
        self.rebinds = self.rebinds.saturating_add(1);
        self.rebind = Rebind::Asked { since_ns: now_ns };
    }

    /// Commits a proposal in a query whose route is target correction. If the
    /// target moves, every window that used the old one is cleared.
    pub(crate) fn commit(&mut self, record: &GroundingRecord) {
        let before = self.lock.target();
        let destination = self.lock.binding().map(|b| b.destination);
        self.lock.commit(record);
        self.rebind = Rebind::Idle;
        if destination != self.lock.binding().map(|b| b.destination) {
            self.monitor.forget();
        }
        if before != self.lock.target() {
            self.monitor.forget();
            self.streaks = Streaks::NONE;
            self.attempt.next();
            self.attempt.clear_latched();
            self.estimator = PhaseEstimator::new();
            self.tracking = Tracking::new();
            self.signals = None;
            self.level_bits = 0;
            self.since_rebind = (before != 0).then_some(0);
        }
    }

    /// The scene for a recovery's query; `None` before the first observation.
    pub(crate) fn scene<'a>(
        &self,
        params: &'a Params,
        sample: &'a StateSample,
        signals: &'a Signals,
        assessment: &Assessment,
    ) -> Scene<'a> {
        let anchor = self.lock.anchor().map_or(0, |a| a.object);
        Scene {
            phase: self.estimator.phase(),
            destination_object: anchor,
            held_other_rise_m: self.held_other_rise_m(signals),
            success: assessment.diagnosis == Diagnosis::Success,
            lock_valid: assessment.kappa >= params.gate.confidence,
            ..Scene::new(params, sample, signals)
        }
    }

    fn held_other_rise_m(&self, signals: &Signals) -> Option<f64> {
        let (id, z_at_grasp_m) = self.attempt.held_other()?;
        let other = signals.other.filter(|o| o.id == id)?;
        Some(other.position_m[2] - z_at_grasp_m)
    }

    /// The object that the arm approaches or holds instead of the target.
    #[must_use]
    pub fn other(&self) -> ObjectId {
        let wrong = self.attempt.latched() & evidence::WRONG_OBJECT != 0;
        self.signals
            .and_then(|s| s.other)
            .filter(|_| wrong)
            .map_or(0, |o| o.id)
    }
}

#[cfg(test)]
mod tests;
