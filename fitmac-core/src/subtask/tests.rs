//! What the active subtask tells a recovery, and what a rebind leaves of it.

use super::*;
use crate::{
    message::{CANDIDATE_CAPACITY, Candidate},
    signals::OtherView,
    stand::{hand, surface, target},
    wire::{DestinationKind, Phase, PlaceRelation},
};

/// A record that names this target and a place on object 3, `offset_m` from its middle.
fn record(target: ObjectId, offset_m: f64) -> GroundingRecord {
    let mut candidates = [Candidate::default(); CANDIDATE_CAPACITY];
    candidates[0] = Candidate {
        id: target,
        compatible: 1,
        ..Candidate::default()
    };
    GroundingRecord {
        epoch: 1,
        target,
        destination: 3,
        destination_kind: DestinationKind::Direct.code(),
        relation: PlaceRelation::On.code(),
        region_offset_m: [offset_m, 0.0, 0.0],
        confidence: 1.0,
        candidate_count: 1,
        candidates,
        ..GroundingRecord::default()
    }
}

fn assessed(kappa: f64, diagnosis: Diagnosis) -> Assessment {
    Assessment {
        kappa,
        evidence: 0,
        diagnosis,
        question: gate::Question {
            diagnosis,
            strong: false,
            initial: false,
            streaks: Streaks::NONE,
            kappa,
            young: false,
            progress: false,
            cooling: false,
            budget: true,
            rebinds: true,
            plan_certain: true,
            routine: Routine::Pick,
        },
    }
}

#[test]
fn a_recovery_is_told_the_phase_the_trust_in_the_lock_and_where_to() {
    let params = Params::guarded();
    let sample = StateSample::default();
    let signals = hand([0.0; 3], GripperState::Open);
    let mut subtask = Subtask::fresh(0, 0);
    let least = params.gate.confidence;
    let told = |subtask: &Subtask, kappa, diagnosis| {
        let assessment = assessed(kappa, diagnosis);
        let scene = subtask.scene(&params, &sample, &signals, &assessment);
        (
            scene.phase,
            scene.lock_valid,
            scene.success,
            scene.destination_object,
        )
    };
    let failure = Diagnosis::PickFailure;
    let open = told(&subtask, least, failure);
    assert_eq!(open, (Phase::Approach, true, false, 0));
    subtask.commit(&record(1, 0.0));
    subtask.estimator.complete();
    let complete = told(&subtask, least - 1e-9, Diagnosis::Success);
    assert_eq!(complete, (Phase::Complete, false, true, 3));
    assert!(!told(&subtask, f64::NAN, failure).1);
}

#[test]
fn the_other_object_is_named_while_there_is_evidence_of_it() {
    let mut subtask = Subtask::fresh(0, 0);
    let look = |latched: u64, other: Option<OtherView>, subtask: &mut Subtask| {
        subtask.attempt = Attempt::first().with(latched);
        subtask.signals = Some(Signals {
            other,
            ..hand([0.0; 3], GripperState::Open)
        });
        subtask.other()
    };
    let other = Some(OtherView {
        id: 7,
        distance_m: 0.1,
        position_m: [0.0; 3],
    });
    for wrong in [evidence::WRONG_TARGET, evidence::WRONG_OBJECT_HELD] {
        assert_eq!(look(wrong | evidence::STALL, other, &mut subtask), 7);
        assert_eq!(look(wrong, None, &mut subtask), 0);
    }
    assert_eq!(look(evidence::STALL, other, &mut subtask), 0);
}

#[test]
fn a_rebind_to_another_target_leaves_nothing_of_the_old_one() {
    let params = Params::guarded();
    let mut subtask = Subtask::fresh(0, 0);
    let sample = StateSample::default();
    let observe = |subtask: &mut Subtask| {
        subtask.observe(&params, &sample, 0.08, false, Verdict::Unknown);
    };
    subtask.commit(&record(1, 0.0));
    assert_eq!(subtask.since_rebind(), None, "the first binding is none");
    observe(&mut subtask);
    observe(&mut subtask);
    let seen = subtask.clone();
    // The same once more, then to another place on the same object.
    subtask.commit(&record(1, 0.0));
    assert_eq!(subtask, seen);
    subtask.commit(&record(1, 0.5));
    assert!(subtask.monitor.history().is_empty());
    assert_eq!(subtask.attempt, seen.attempt);
    assert_eq!(subtask.signals, seen.signals);
    subtask.commit(&record(2, 0.5));
    assert_eq!(
        (subtask.lock.target(), subtask.since_rebind()),
        (2, Some(0))
    );
    assert_eq!(subtask.attempt.id(), seen.attempt.id() + 1);
    assert!(subtask.monitor.history().is_empty() && subtask.signals.is_none());
    assert_eq!(subtask.estimator, PhaseEstimator::new());
    assert_eq!(subtask.tracking, Tracking::new());
    observe(&mut subtask);
    assert_eq!(subtask.since_rebind(), Some(1));
}

/// An estimator that saw the target lifted and carried, and let go then.
fn carried(params: &Params, let_go: bool) -> PhaseEstimator {
    let mut estimator = PhaseEstimator::new();
    let mut step = |state, z_m| {
        let signals = sees(state, z_m);
        estimator.step(&params.phase, &signals);
    };
    step(GripperState::Open, 0.0);
    for _ in 0..20 {
        step(GripperState::Holding, 0.3);
    }
    if let_go {
        step(GripperState::Open, 0.3);
    }
    estimator
}

/// A hand above a target at this height.
fn sees(state: GripperState, z_m: f64) -> Signals {
    Signals {
        target: Some(target([0.4, 0.0, z_m])),
        ..hand([0.4, 0.0, z_m + 0.2], state)
    }
}

#[test]
fn what_is_carried_is_placed_where_its_destination_is_seen() {
    let mut params = Params::guarded();
    let mut subtask = Subtask::fresh(0, 0);
    subtask.commit(&record(1, 0.0));
    let mut seen = sees(GripperState::Holding, 0.3);
    subtask.signals = Some(seen);
    assert_eq!(subtask.routine(&params), Routine::Pick);
    subtask.estimator = carried(&params, false);
    assert_eq!(subtask.estimator.phase(), Phase::Transport);
    assert_eq!(subtask.routine(&params), Routine::Indirect, "not seen");
    params.switches.hard_place = false;
    assert_eq!(
        subtask.routine(&params),
        Routine::Place,
        "for the gate to say no"
    );
    params.switches.hard_place = true;
    seen.destination = Some(surface([0.6, 0.0, 0.0]));
    subtask.signals = Some(seen);
    assert_eq!(subtask.routine(&params), Routine::Place);
}

/// A subtask whose pick recovery has come to this step.
fn recovering(params: &Params, to: SubPhase) -> Subtask {
    let mut subtask = Subtask::fresh(0, 0);
    let mut sample = StateSample::default();
    let mut seen = sees(GripperState::Open, 0.03);
    subtask
        .recovery
        .start(&Scene::new(params, &sample, &seen), Routine::Pick, 100);
    for _ in 0..50 {
        if subtask.recovery.sub_phase() == to {
            break;
        }
        // The hand is at once where it is sent.
        let step = subtask.recovery.step(&Scene::new(params, &sample, &seen));
        if let crate::recovery::Step::Act {
            waypoint_m: Some(at_m),
            ..
        } = step
        {
            (seen.ee_m, sample.ee_position_m) = (at_m, at_m);
        }
    }
    assert_eq!(subtask.recovery.sub_phase(), to);
    subtask
}

#[test]
fn a_pick_begins_a_new_attempt_with_an_open_hand_or_where_the_target_was_let_go() {
    let params = Params::guarded();
    let begins = |at: SubPhase, estimator: PhaseEstimator| {
        let mut subtask = recovering(&params, at);
        subtask.estimator = estimator;
        let before = subtask.attempt.id();
        subtask.follow_recovery();
        let fresh = subtask.estimator == PhaseEstimator::new();
        assert!(subtask.attempt.id() == before || fresh);
        subtask.attempt.id() > before
    };
    let (held, gone) = (carried(&params, false), carried(&params, true));
    assert_eq!(gone.carry(), Carry::Released);
    for open_handed in [SubPhase::ApproachHover, SubPhase::Descend] {
        assert!(begins(open_handed, held.clone()), "{open_handed}");
        assert!(begins(open_handed, gone.clone()), "{open_handed}");
        assert!(!begins(open_handed, PhaseEstimator::new()), "{open_handed}");
    }
    assert!(!begins(SubPhase::Close, held), "it is in the hand");
    assert!(begins(SubPhase::Close, gone));
}
