//! F. The lock and the grounding.

use fitmac_core::{
    Controller, Params,
    intake::Refusal,
    lock::closest_candidate,
    message::{Candidate, GroundingRecord, Input, StateSample},
    wire::{EventKind, Route},
};
use fitmac_core_tests::world::{
    Agent, Answer, Behaviour, CAN, OTHER, Policy, Scene, Session, Verifier,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::stand::{session, swarms};

#[test]
fn inv_51_the_lock_moves_only_in_a_target_query_or_with_the_subtask() {
    let mut moved = 0;
    swarms(|seen| {
        let lock = seen.after.subtask().lock();
        let restarted = seen.told.request != 0 || seen.told.plan.is_some();
        let same_subtask = seen.before.subtask == seen.after.subtask().index();
        if lock.target() != seen.before.target && same_subtask && !restarted {
            let queried = seen.after.episode().queries() > seen.before.query;
            let target = seen.after.decision().route == Route::Target;
            assert!(queried && target, "seed {}", seen.seed);
            moved += 1;
        }
    });
    assert!(moved > 30, "{moved}");
}

#[test]
fn inv_52_a_pending_correction_keeps_the_lock() {
    swarms(|seen| {
        let pending = seen.after.subtask().recovery().is_pending();
        if seen.before.pending && pending && seen.before.subtask == seen.after.subtask().index() {
            let lock = seen.after.subtask().lock();
            let same = (lock.target(), lock.epoch()) == (seen.before.target, seen.before.epoch);
            assert!(same, "seed {}", seen.seed);
        }
    });
}

/// Two subtasks: the can goes on the plate, then it does so again from where
/// it is put.
fn two_subtasks() -> Session {
    let mut run = session(Params::guarded(), &Scene::can_to_plate(), Behaviour::Frozen);
    run.verifier = Verifier::Absent;
    run.plan = Some(fitmac_core::message::Plan {
        id: 1,
        subtask_count: 2,
        confidence_permille: 1000,
    });
    run
}

#[test]
fn inv_53_the_next_subtask_begins_with_nothing_of_the_last() {
    let mut run = two_subtasks();
    let second = run.run_until(400, |s| s.controller.state().subtask().index() == 1);
    assert!(second, "the first was verified by geometry");
    let changed = EventKind::SubtaskChanged.code();
    assert!(
        run.events.iter().any(|e| e.kind == changed),
        "and it was told"
    );
    let state = run.controller.state();
    let subtask = state.subtask();
    assert_eq!(subtask.lock().binding(), None);
    assert!(!subtask.recovery().is_pending());
    assert_eq!(subtask.recovery().activations(), 0);
    assert_eq!(subtask.recovery().since_hand_back(), None);
    assert_eq!(subtask.attempt().id(), 1);
    assert_eq!(subtask.estimator().steps(), 0);
    assert!(subtask.monitor().history().is_empty());
    assert!(subtask.signals().is_none());
    assert!(state.queue().is_empty());
    // One query has judged it: all that it can have counted is this one.
    assert_eq!(subtask.streaks().failures(), 1, "no target yet");
    assert_eq!(subtask.lock().epoch(), 1, "epochs go on");
}

#[test]
fn inv_54_epochs_rise_and_no_chunk_of_another_is_played() {
    swarms(|seen| {
        let restarted = seen.told.request != 0 || seen.told.plan.is_some();
        let epoch = seen.after.subtask().lock().epoch();
        assert!(
            epoch >= seen.before.epoch || restarted,
            "seed {}",
            seen.seed
        );
        if let Some(query) = &seen.output.query {
            assert!(query.epoch <= epoch, "seed {}", seen.seed);
        }
    });
}

fn sample_of(places: &[(u16, [f64; 3])]) -> StateSample {
    let mut sample = StateSample::default();
    for (slot, &(id, position_m)) in sample.objects.iter_mut().zip(places) {
        slot.id = id;
        slot.position_m = position_m;
        sample.object_count += 1;
    }
    sample
}

#[test]
fn inv_55_the_closest_candidate_is_the_arg_min_and_ties_go_to_the_lowest_id() {
    let mut rng = ChaCha8Rng::seed_from_u64(55);
    let params = Params::guarded().lock;
    // A coarse grid, so that ties happen.
    let grid = |rng: &mut ChaCha8Rng| f64::from(rng.random_range(-3..=3)) / 8.0;
    let mut ties = 0;
    for _ in 0..20_000 {
        let n = rng.random_range(0..8);
        let mut places = Vec::new();
        let mut candidates = Vec::new();
        for _ in 0..n {
            let id = rng.random_range(1..6);
            let mut p = [grid(&mut rng), grid(&mut rng), grid(&mut rng)];
            if rng.random_bool(0.1) {
                p[rng.random_range(0..3)] = f64::NAN;
            }
            if !places.iter().any(|&(i, _)| i == id) {
                places.push((id, p));
            }
            candidates.push(Candidate {
                id: rng.random_range(0..7),
                compatible: u8::from(rng.random_bool(0.8)),
                ..Candidate::default()
            });
        }
        let sample = sample_of(&places);
        let mut scored: Vec<(f64, u16)> = candidates
            .iter()
            .filter(|c| c.compatible == 1)
            .filter_map(|c| Some((c.id, places.iter().find(|(id, _)| *id == c.id)?.1)))
            .map(|(id, [x, y, z])| ((x * x + y * y).sqrt() + 0.5 * z.abs(), id))
            .filter(|(score, _)| score.is_finite())
            .collect();
        scored.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        ties +=
            u32::from(scored.len() > 1 && scored[0].0 == scored[1].0 && scored[0].1 != scored[1].1);
        let found = closest_candidate(&params, &sample, &candidates);
        assert_eq!(
            found,
            scored.first().map(|&(_, id)| id),
            "{places:?} {candidates:?}"
        );
    }
    assert!(ties > 100);
}

#[test]
fn inv_56_a_choice_outside_the_candidates_is_refused() {
    for count in 0..=u8::MAX {
        for target in [0, 1, 2, 9] {
            let mut record = GroundingRecord {
                sequence: 1,
                session: 1,
                epoch: 1,
                target,
                provenance: 1,
                candidate_count: count,
                ..GroundingRecord::default()
            };
            for (i, slot) in record.candidates.iter_mut().enumerate() {
                slot.id = i as u16 + 1;
            }
            let input = Input {
                grounding: Some(&record),
                ..Input::default()
            };
            let params = Params::guarded().validate().expect("valid");
            let mut controller = Controller::new(params);
            controller.tick(1, &input);
            let refusals = controller.state().refusals();
            let chosen = target == 0 || target <= u16::from(count);
            assert_eq!(refusals.of(Refusal::TooLong) == 1, count > 16, "{count}");
            assert_eq!(
                refusals.of(Refusal::NotACandidate) == 1,
                count <= 16 && !chosen,
                "{count} {target}"
            );
        }
    }
}

#[test]
fn inv_38_after_a_rebind_no_step_of_the_old_target_counts() {
    // The arm runs towards the other can, which is the first binding; the
    // second look moves the lock. Progress needs Delta steps of the new one.
    let scene = Scene::can_to_plate();
    let agent = Agent::new([
        Answer::Target {
            id: OTHER,
            kappa: 0.28,
            provenance: fitmac_core::wire::Provenance::Rules,
        },
        Answer::Target {
            id: CAN,
            kappa: 0.9,
            provenance: fitmac_core::wire::Provenance::Recheck,
        },
    ]);
    let policy = Policy::new(Behaviour::Competent);
    let mut run = Session::new(Params::paper(), scene, policy, agent);
    let delta = run.controller.params().get().progress.delta_steps as usize;
    assert!(
        run.run_until(100, |s| s.controller.state().subtask().lock().target()
            == CAN)
    );
    assert!(
        run.controller
            .state()
            .subtask()
            .monitor()
            .history()
            .is_empty()
    );
    let mut last = 0;
    run.run_until(40, |s| {
        let monitor = s.controller.state().subtask().monitor();
        let steps = monitor.history().len();
        if steps <= delta {
            assert_eq!(monitor.since_progress(), u32::MAX, "after {steps} steps");
        }
        last = steps;
        steps > delta
    });
    assert!(last > delta);
}
