//! A subtask: the lock, the story, the queries, the corrections; and how a
//! query is judged (equation 7, appendix A.5, Algorithm 1).

use fitmac_core::{
    evidence,
    message::{GroundingRecord, StateSample},
    params::Params,
    reason,
    wire::{CriticLabel, DestinationKind, Diagnosis, PlaceRelation, Provenance, Route, Verdict},
};

use super::{
    arm::{Arm, Said, Scene},
    doors::{confidence, ms},
    sight::{Anchor, Look, Pads, Steady, pads, thing},
    space::apart,
    story::{Carry, Story, picks, places},
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goes {
    Nowhere,
    Somewhere,
    To(Anchor),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Binding {
    pub(super) target: u16,
    pub(super) prompt: u32,
    pub(super) goes: Goes,
    confirmed: bool,
    confidence: f64,
    compatible: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Asked {
    No,
    Since(u64),
    InVain,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Target,
    Execution,
}

/// What a correction would run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Routine {
    Pick,
    Place,
    /// Geometry alone can't.
    None,
}

/// What a query found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) kappa: f64,
    pub(super) evidence: u64,
    pub(super) diagnosis: Diagnosis,
    pub(super) gate: Gate,
    routine: Routine,
}

/// What the gate allows, and why or why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gate {
    Closed(u64),
    Target(u64),
    Execution(u64),
}

#[derive(Clone, Debug)]
pub(super) struct Task {
    pub(super) index: u32,
    pub(super) epoch: u64,
    pub(super) binding: Option<Binding>,
    flaps: u32,
    jumped: bool,
    pub(super) story: Story,
    steady: Steady,
    pub(super) look: Option<Look>,
    level: u64,
    /// Every query: its diagnosis and kappa.
    pub(super) queries: Vec<(Diagnosis, f64)>,
    streaks_from: usize,
    pub(super) arm: Option<Arm>,
    pub(super) activations: u32,
    /// Length of the story when it happened.
    handed_back: Option<usize>,
    rebound: Option<usize>,
    pub(super) asked: Asked,
    requests: u32,
}

fn kind(diagnosis: Diagnosis) -> Option<Kind> {
    match diagnosis {
        Diagnosis::TargetCorrection => Some(Kind::Target),
        Diagnosis::PickFailure | Diagnosis::PlaceFailure => Some(Kind::Execution),
        _ => None,
    }
}

fn bits(rules: &[(bool, u64)]) -> u64 {
    rules.iter().filter(|r| r.0).fold(0, |all, r| all | r.1)
}

fn at_most_255(n: usize) -> u32 {
    n.min(255) as u32
}

impl Task {
    pub(super) fn new(index: u32, epoch: u64) -> Self {
        Self {
            index,
            epoch,
            binding: None,
            flaps: 0,
            jumped: false,
            story: Story::new(),
            steady: Steady::default(),
            look: None,
            level: 0,
            queries: Vec::new(),
            streaks_from: 0,
            arm: None,
            activations: 0,
            handed_back: None,
            rebound: None,
            asked: Asked::No,
            requests: 0,
        }
    }

    pub(super) fn target(&self) -> u16 {
        self.binding.map_or(0, |b| b.target)
    }

    pub(super) fn anchor(&self) -> Option<Anchor> {
        match self.binding?.goes {
            Goes::To(anchor) => Some(anchor),
            _ => None,
        }
    }

    fn steps_since(&self, then: Option<usize>) -> Option<u32> {
        then.map(|then| (self.story.len() - then) as u32)
    }

    pub(super) fn since_hand_back(&self) -> Option<u32> {
        self.steps_since(self.handed_back)
    }

    pub(super) fn since_rebind(&self) -> Option<u32> {
        self.steps_since(self.rebound)
    }

    /// A policy step.
    pub(super) fn step(
        &mut self,
        p: &Params,
        sample: &StateSample,
        width_before: f64,
        told_closed: bool,
        verdict: Verdict,
    ) {
        let pads = pads(p, sample, width_before, told_closed);
        let anchor = self.anchor();
        let object = anchor.map_or(0, |a| a.object);
        let holding = pads == Pads::Holding;
        self.steady.step(p, sample, self.target(), object, holding);
        let look = self
            .steady
            .look(p, sample, pads, self.target(), anchor.as_ref());
        self.look = Some(look);
        self.level = self.story.turn(p, look, verdict);
    }

    /// The samples do not continue each other.
    pub(super) fn forget_motion(&mut self) {
        self.story.forget_motion();
        self.streaks_from = self.queries.len();
    }

    /// Two samples that continue each other: a target that leaps with no
    /// gripper near it.
    pub(super) fn watch(&mut self, p: &Params, before: &StateSample, after: &StateSample) {
        let at = |s: &StateSample| Some((thing(s, self.target())?.position_m, s.ee_position_m));
        if let Some(((a, hand_a), (b, hand_b))) = at(before).zip(at(after)) {
            let near = p.gripper.held_radius_m;
            let far = apart(hand_a, a) > near && apart(hand_b, b) > near;
            self.jumped |= far && apart(a, b) > p.lock.jump_m;
        }
    }

    /// Evidence on the committed binding.
    pub(super) fn hear(&mut self, r: &GroundingRecord) {
        if let Some(binding) = &mut self.binding {
            binding.compatible = fits(r, binding.target);
            if r.target == binding.target {
                binding.confidence = confidence(r.confidence);
            } else {
                self.flaps += 1;
            }
        }
    }

    /// The binding changes, in a query of target correction.
    pub(super) fn commit(&mut self, r: &GroundingRecord) {
        let (target, goes) = (self.target(), self.binding.map(|b| b.goes));
        let chosen = [Provenance::Resolver.code(), Provenance::Recheck.code()];
        self.epoch = r.epoch;
        (self.flaps, self.jumped, self.asked) = (0, false, Asked::No);
        self.binding = (r.target != 0).then(|| Binding {
            target: r.target,
            prompt: r.prompt_id,
            goes: destination(r),
            confirmed: chosen.contains(&r.provenance),
            confidence: confidence(r.confidence),
            compatible: fits(r, r.target),
        });
        if goes != self.binding.map(|b| b.goes) {
            self.story.forget_motion();
        }
        if target != self.target() {
            self.streaks_from = self.queries.len();
            self.story.retarget();
            self.steady = Steady::default();
            self.look = None;
            self.level = 0;
            self.rebound = (target != 0).then(|| self.story.len());
        }
    }

    pub(super) fn may_ask(&self, p: &Params) -> bool {
        self.requests < p.lock.rebinds
    }

    pub(super) fn ask(&mut self, now: u64) {
        self.requests += 1;
        self.asked = Asked::Since(now);
    }

    pub(super) fn succeeded(&self, p: &Params, verdict: Verdict) -> bool {
        let placed = || {
            self.story.rested() >= p.evidence.rest_steps as usize
                && self.look.and_then(|l| l.in_region()) == Some(true)
        };
        verdict == Verdict::Success || (verdict == Verdict::Unknown && placed())
    }

    fn kappa(&self, p: &Params, now: u64, sample: &StateSample) -> f64 {
        let Some(binding) = &self.binding else {
            return 0.0;
        };
        let seen = thing(sample, binding.target)
            .is_some_and(|o| now.saturating_sub(o.stamp_ns) <= ms(p.lock.pose_lost_ms));
        let bound = if seen || self.steady.carried() {
            binding.confidence
        } else {
            0.0
        };
        // The policy lifted what the agents mean, or we place it.
        let placing = self.arm.as_ref().is_some_and(|arm| !arm.picking());
        let agreed = placing || (self.steady.carried() && self.story.is_lifted());
        if bound > 0.0 && agreed {
            bound.max(p.lock.agreed)
        } else {
            bound
        }
    }

    /// Failures in a row of the kind of the last one.
    pub(super) fn failures(&self) -> u32 {
        let queries = &self.queries[self.streaks_from..];
        let last = queries.last().and_then(|q| kind(q.0));
        let same = |q: &&(Diagnosis, f64)| last.is_some() && kind(q.0) == last;
        at_most_255(queries.iter().rev().take_while(same).count())
    }

    fn failures_of(&self, wanted: Kind) -> u32 {
        let last = self.queries.last().and_then(|q| kind(q.0));
        if last == Some(wanted) {
            self.failures()
        } else {
            0
        }
    }

    /// Queries in a row with a target that is certain enough.
    pub(super) fn confident(&self, p: &Params) -> u32 {
        let queries = &self.queries[self.streaks_from..];
        let sure = queries
            .iter()
            .rev()
            .take_while(|q| q.1 >= p.gate.confidence);
        at_most_255(sure.count())
    }

    /// The lock is settled: another look would not help, or can't be had.
    fn settled(&self, p: &Params) -> bool {
        self.binding.is_some_and(|b| {
            b.confirmed
                || self.asked == Asked::InVain
                || !p.switches.target_corrector
                || (self.asked == Asked::No && !self.may_ask(p))
        })
    }

    fn routine(&self, p: &Params) -> Routine {
        let denied = self.story.latched() & evidence::VERIFIER_NEGATIVE != 0;
        let known = self.look.and_then(|l| l.in_region()).is_some();
        if self.story.carry() == Carry::Released && !denied && !known {
            return Routine::None;
        }
        if !(self.story.is_lifted() && places(self.story.phase)) {
            return Routine::Pick;
        }
        let reachable = self.anchor().is_some() && self.look.is_some_and(|l| l.place.is_some());
        if reachable || !p.switches.hard_place {
            Routine::Place
        } else {
            Routine::None
        }
    }

    /// Judges a query.
    #[expect(clippy::too_many_arguments, reason = "what a query is judged by")]
    pub(super) fn judge(
        &mut self,
        p: &Params,
        now: u64,
        sample: &StateSample,
        verdict: Verdict,
        critic: Option<CriticLabel>,
        plan: f64,
        spent: u32,
    ) -> Found {
        use evidence as e;
        let kappa = self.kappa(p, now, sample);
        let lock = match &self.binding {
            None => e::NO_LOCK,
            Some(b) => bits(&[
                (kappa < p.lock.kappa_min, e::KAPPA_LOW),
                (!b.compatible, e::LOCK_INCOMPATIBLE),
                (self.jumped, e::LOCK_JUMPED),
                (self.flaps >= p.lock.flaps, e::FLAPPING),
            ]),
        };
        let rules = self.level | self.story.latched() | lock;
        let young = (self.story.attempt_steps() as u32) < p.gate.rescue_min_step;
        let time = e::STALL | e::TIMEOUT | e::REVERSAL | e::MOVING_AWAY;
        let counted = if young { rules & !time } else { rules };
        let wrong = counted & (e::WRONG_TARGET | e::WRONG_OBJECT_HELD);
        let doubts =
            e::KAPPA_LOW | e::LOCK_INCOMPATIBLE | e::LOCK_JUMPED | e::NO_LOCK | e::FLAPPING;
        let slips = e::EMPTY_GRASP | e::DROPPED | e::VERIFIER_NEGATIVE | e::MISPLACED;
        let settled = self.settled(p);
        let on_target = (counted & doubts != 0) || (wrong != 0 && !settled);
        let on_arm =
            counted & (time | slips | e::WRONG_DESTINATION) != 0 || (wrong != 0 && settled);
        let phase = self.story.phase;
        let diagnosis = if self.succeeded(p, verdict) {
            Diagnosis::Success
        } else if self.arm.is_some() {
            Diagnosis::RecoveryInProgress
        } else if on_target {
            Diagnosis::TargetCorrection
        } else if on_arm && picks(phase) {
            Diagnosis::PickFailure
        } else if on_arm && places(phase) {
            Diagnosis::PlaceFailure
        } else {
            Diagnosis::None
        };
        self.queries.push((diagnosis, kappa));
        let strong = e::WRONG_TARGET
            | e::WRONG_OBJECT_HELD
            | e::EMPTY_GRASP
            | e::DROPPED
            | e::VERIFIER_NEGATIVE
            | e::WRONG_DESTINATION
            | e::NO_LOCK;
        let routine = self.routine(p);
        let gate = match kind(diagnosis) {
            None => Gate::Closed(0),
            Some(Kind::Target) => self.gate_to_target(p, counted & strong != 0, plan),
            Some(Kind::Execution) => {
                let left = spent < p.recovery.episode_budget;
                let strong = counted & strong != 0;
                self.gate_to_arm(p, strong, young, kappa, plan, left, routine)
            }
        };
        let said = match critic {
            Some(CriticLabel::TargetFailure) => e::CRITIC_TARGET,
            Some(CriticLabel::ExecutionFailure) => e::CRITIC_EXECUTION,
            _ => 0,
        };
        Found {
            kappa,
            evidence: rules | said,
            diagnosis,
            gate,
            routine,
        }
    }

    fn gate_to_target(&self, p: &Params, strong: bool, plan: f64) -> Gate {
        if self.binding.is_none() {
            return Gate::Target(reason::INITIAL_GROUNDING);
        }
        let persists = self.failures_of(Kind::Target) >= p.gate.failure_streak;
        let left = self.may_ask(p) || self.asked != Asked::No;
        let shut = bits(&[
            (!p.switches.target_corrector, reason::SWITCHED_OFF),
            (!left, reason::BUDGET_SPENT),
            (plan < p.gate.plan_confidence, reason::PLAN_UNCERTAIN),
            (!persists && !strong, reason::STREAK_SHORT),
        ]);
        let open = bits(&[
            (persists, reason::TARGET_STREAK),
            (strong, reason::STRONG_EVIDENCE),
        ]);
        if shut == 0 {
            Gate::Target(open)
        } else {
            Gate::Closed(shut)
        }
    }

    #[expect(clippy::too_many_arguments, reason = "each is one rule of the gate")]
    fn gate_to_arm(
        &self,
        p: &Params,
        strong: bool,
        young: bool,
        kappa: f64,
        plan: f64,
        left: bool,
        routine: Routine,
    ) -> Gate {
        let (g, s) = (&p.gate, &p.switches);
        let hard = if routine == Routine::Pick {
            s.hard_pick
        } else {
            s.hard_place
        };
        let persists = self.failures_of(Kind::Execution) >= g.failure_streak;
        let trusted = self.confident(p) >= g.confidence_streak;
        let rested = self
            .since_hand_back()
            .is_none_or(|n| n >= g.cool_down_steps);
        let budget = self.activations < g.activations && left;
        let guard = g.progress_guard_steps as usize;
        let moves = self.story.since_progress().is_some_and(|n| n < guard);
        let shut = bits(&[
            (!(s.execution_corrector && hard), reason::SWITCHED_OFF),
            (routine == Routine::None, reason::DESTINATION_INDIRECT),
            (!budget, reason::BUDGET_SPENT),
            (!rested, reason::COOL_DOWN),
            (plan < g.plan_confidence, reason::PLAN_UNCERTAIN),
            (kappa < g.confidence, reason::CONFIDENCE_LOW),
            (!persists && !strong, reason::STREAK_SHORT),
            (!trusted && !strong, reason::CONFIDENCE_STREAK_SHORT),
            (young && !strong, reason::ATTEMPT_YOUNG),
            (moves && !strong, reason::PROGRESS),
        ]);
        let open = bits(&[
            (persists && trusted, reason::EXECUTION_STREAK),
            (strong, reason::STRONG_EVIDENCE),
        ]);
        if shut == 0 {
            Gate::Execution(open)
        } else {
            Gate::Closed(shut)
        }
    }

    pub(super) fn route(&self, gate: Gate) -> Route {
        match gate {
            _ if self.arm.is_some() => Route::Pending,
            Gate::Target(_) => Route::Target,
            Gate::Execution(_) => Route::Execution,
            Gate::Closed(_) => Route::Base,
        }
    }

    /// The object that the arm approaches or holds instead.
    pub(super) fn other(&self) -> u16 {
        let wrong = evidence::WRONG_TARGET | evidence::WRONG_OBJECT_HELD;
        let other = self.look.and_then(|l| l.other);
        let noticed = self.story.latched() & wrong != 0;
        other.filter(|_| noticed).map_or(0, |o| o.id)
    }

    pub(super) fn heed(&mut self, found: &Found) {
        self.story.heed();
        let failed = found.diagnosis == Diagnosis::PlaceFailure;
        if failed && found.evidence & evidence::VERIFIER_NEGATIVE != 0 && self.arm.is_none() {
            self.story.restart();
        }
    }

    pub(super) fn cancel(&mut self) {
        if self.arm.take().is_some() {
            self.handed_back = Some(self.story.len());
        }
    }

    /// One query of a correction, begun if none runs. `None` without signals.
    pub(super) fn correct(
        &mut self,
        p: &Params,
        sample: &StateSample,
        found: &Found,
        spent: u32,
    ) -> Option<Said> {
        let Some(look) = self.look else {
            self.cancel();
            return None;
        };
        let starts = self.arm.is_none();
        if starts && found.routine == Routine::Pick && places(self.story.phase) {
            self.story.restart();
        }
        let rise = self.story.held_other(p).and_then(|(id, z)| {
            let other = look.other.filter(|o| o.id == id)?;
            Some(other.at[2] - z)
        });
        let scene = Scene {
            p,
            sample,
            look,
            phase: self.story.phase,
            anchor: self.anchor().map_or(0, |a| a.object),
            other_rise: rise,
            success: found.diagnosis == Diagnosis::Success,
            valid: found.kappa >= p.gate.confidence,
        };
        if starts {
            let left = p.recovery.episode_budget.saturating_sub(spent);
            self.activations += 1;
            self.arm = Some(match (found.routine, look.target) {
                (Routine::Place, Some(target)) => Arm::place(&scene, &target, left),
                _ => Arm::pick(&scene, left),
            });
        }
        let said = self.arm.as_mut()?.query(&scene);
        if let Said::Bottom(_) = said {
            self.cancel();
        }
        if let (Said::Act(..), Some(arm)) = (said, &self.arm) {
            use fitmac_core::wire::SubPhase as S;
            let step = arm.step_name();
            let open = [S::ApproachHover, S::Descend, S::Reopen].contains(&step);
            let closed = [S::Close, S::LiftTest].contains(&step);
            let let_go = self.story.carry() == Carry::Released;
            if (open && !picks(self.story.phase)) || (closed && let_go) {
                self.story.restart();
            }
        }
        Some(said)
    }
}

fn fits(r: &GroundingRecord, target: u16) -> bool {
    let named = r.candidates.iter().take(usize::from(r.candidate_count));
    named
        .into_iter()
        .any(|c| c.id == target && c.compatible == 1)
}

fn destination(r: &GroundingRecord) -> Goes {
    let relation = PlaceRelation::try_from(r.relation).ok();
    let direct = r.destination_kind == DestinationKind::Direct.code() && r.destination != 0;
    match relation.filter(|_| direct) {
        Some(relation) => Goes::To(Anchor {
            object: r.destination,
            relation,
            offset: r.region_offset_m,
            half: r.region_half_extent_m,
        }),
        None if r.destination_kind == DestinationKind::Relational.code() => Goes::Somewhere,
        None => Goes::Nowhere,
    }
}
