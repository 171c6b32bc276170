//! E. Phases and the steps of a recovery.

use std::collections::BTreeSet;

use fitmac_core::{
    Params,
    intake::Refusal,
    lock::Destination,
    message::Input,
    phase::{EDGES, is_legal, is_pick, is_place},
    recovery,
    wire::{
        ActionFrame, ActionSpace, CriticLabel, DestinationKind, Diagnosis, EventKind, GraspClass,
        GripperConvention, Mode, Phase, PlaceRelation, Provenance, Request, Route, SubPhase,
        UnknownCode, Verdict,
    },
};
use fitmac_core_tests::world::{Behaviour, Scene, Session};

use super::stand::{failures, run_to_correction, session, swarms};

#[test]
fn inv_43_the_phase_changes_along_declared_edges_only() {
    let mut taken = BTreeSet::new();
    swarms(|seen| {
        let (from, to) = (seen.before.phase, seen.after.subtask().estimator().phase());
        let same_subtask = seen.before.subtask == seen.after.subtask().index();
        let fresh = seen.told.request != 0
            || seen.told.plan.is_some()
            || seen.before.target != seen.after.subtask().lock().target()
            || !same_subtask;
        if from != to && !fresh {
            assert!(is_legal(from, to), "seed {}: {from} to {to}", seen.seed);
            taken.insert((from, to));
        }
    });
    assert!(taken.len() > 12, "{taken:?}");
}

/// The steps that follow from `from` within `edges` edges.
fn reached(from: SubPhase, edges: u32) -> BTreeSet<SubPhase> {
    let mut reached = BTreeSet::from([from]);
    for _ in 0..edges {
        let next: Vec<_> = recovery::EDGES
            .iter()
            .filter(|(a, _)| reached.contains(a))
            .map(|&(_, b)| b)
            .collect();
        reached.extend(next);
    }
    reached
}

/// The core asserts each single change by itself in a build with debug
/// assertions, as this one; a query may take up to four.
#[test]
fn inv_43_a_recovery_steps_along_declared_edges_only() {
    let mut taken = BTreeSet::new();
    let mut last = (u64::MAX, SubPhase::Idle);
    swarms(|seen| {
        let to = seen.sub_phase();
        let from = if last.0 == seen.seed {
            last.1
        } else {
            SubPhase::Idle
        };
        last = (seen.seed, to);
        if from != to && to != SubPhase::Idle {
            let legal = reached(from, 4).contains(&to);
            assert!(legal, "seed {}: {from} to {to}", seen.seed);
            taken.insert((from, to));
        }
    });
    assert!(taken.len() > 15, "{taken:?}");
}

#[test]
fn inv_43_the_steps_of_a_recovery_are_connected_and_bounded() {
    assert_eq!(reached(SubPhase::Idle, 20).len(), SubPhase::ALL.len());
    for &step in SubPhase::ALL {
        let leaves = recovery::EDGES.iter().any(|&(from, _)| from == step);
        assert!(leaves || step == SubPhase::Settle, "{step} leads on");
    }
    // What was released is not picked up by the same correction.
    assert!(!reached(SubPhase::ReleaseReady, 20).contains(&SubPhase::ApproachHover));
    assert!(!reached(SubPhase::Idle, 2).contains(&SubPhase::ReleaseReady));
}

#[test]
fn inv_43_the_table_of_edges_is_well_formed() {
    let distinct: BTreeSet<_> = EDGES.iter().collect();
    assert_eq!(distinct.len(), EDGES.len(), "no edge twice");
    for &(from, to) in EDGES {
        assert_ne!(from, to);
        assert_ne!(from, Phase::Complete, "nothing follows completion");
    }
    for &phase in Phase::ALL {
        assert_eq!(
            [is_pick(phase), is_place(phase), phase == Phase::Complete]
                .iter()
                .filter(|&&x| x)
                .count(),
            1,
            "{phase} is of one kind"
        );
        if phase != Phase::Complete {
            assert!(is_legal(phase, Phase::Complete), "success ends {phase}");
        }
    }
}

#[test]
fn inv_44_a_place_phase_needs_carrying_evidence() {
    let mut entered = 0;
    swarms(|seen| {
        let (from, to) = (seen.before.phase, seen.after.subtask().estimator().phase());
        if is_pick(from) && is_place(to) {
            assert!(
                seen.after.subtask().estimator().is_lifted(),
                "seed {}",
                seen.seed
            );
            let signals = seen.after.subtask().signals().expect("observed");
            assert!(signals.gripper.is_closed(), "seed {}", seen.seed);
            entered += 1;
        }
    });
    assert!(entered > 10, "{entered}");
}

#[test]
fn inv_45_a_recovery_opens_the_hand_only_where_it_may() {
    let mut opened = BTreeSet::new();
    swarms(|seen| {
        if seen.starts_recovery_action() && seen.output.command.action[6] < 0.0 {
            let step = seen.sub_phase();
            let may = matches!(
                step,
                SubPhase::SetDown
                    | SubPhase::ApproachHover
                    | SubPhase::Descend
                    | SubPhase::Reopen
                    | SubPhase::ReleaseReady
                    | SubPhase::ReleaseHold
                    | SubPhase::Retreat
                    | SubPhase::Settle
            );
            assert!(may, "seed {}: {step}", seen.seed);
            opened.insert(step);
        }
    });
    assert!(opened.contains(&SubPhase::ReleaseReady), "{opened:?}");
}

#[test]
fn inv_46_it_releases_only_above_the_region_and_low() {
    let mut released = 0;
    swarms(|seen| {
        let Some(record) = &seen.output.trace else {
            return;
        };
        if record.sub_phase == SubPhase::ReleaseReady.code() {
            let d = seen
                .after
                .subtask()
                .signals()
                .and_then(|s| s.destination)
                .expect("a destination");
            let p = &seen.params.recovery;
            let align = p.align_on_m.max(p.align_in_m);
            assert!(d.distance_xy_m <= align, "seed {}: {d:?}", seen.seed);
            assert!(
                d.clearance_m <= p.release_on_m + 0.04,
                "seed {}: {d:?}",
                seen.seed
            );
            released += 1;
        }
    });
    assert!(released > 5, "{released}");
}

#[test]
fn inv_47_settling_keeps_the_hand_open_rises_and_ends() {
    let mut settled = 0;
    let mut in_a_row = 0;
    swarms(|seen| {
        if !seen.starts_recovery_action() {
            return;
        }
        if seen.sub_phase() == SubPhase::Settle {
            let [x, y, z, .., grip] = seen.output.command.action;
            assert!(
                x == 0.0 && y == 0.0 && z >= 0.0 && grip == -1.0,
                "seed {}",
                seen.seed
            );
            in_a_row += 1;
            let p = &seen.params.recovery;
            assert!(in_a_row <= p.settle + p.verify, "seed {}", seen.seed);
            settled += 1;
        } else {
            in_a_row = 0;
        }
    });
    assert!(settled > 20, "{settled}");
}

#[test]
fn inv_48_geometry_places_only_at_a_direct_destination() {
    let mut placed = 0;
    swarms(|seen| {
        let placing = matches!(
            seen.sub_phase(),
            SubPhase::LiftCarry
                | SubPhase::MoveAbove
                | SubPhase::Lower
                | SubPhase::ReleaseReady
                | SubPhase::ReleaseHold
                | SubPhase::Retreat
                | SubPhase::Settle
        );
        if placing {
            let binding = seen.after.subtask().lock().binding().expect("a lock");
            let direct = matches!(binding.destination, Destination::Direct(_));
            assert!(direct, "seed {}", seen.seed);
            placed += 1;
        }
    });
    assert!(placed > 50, "{placed}");
}

#[test]
fn inv_49_under_constant_input_every_correction_ends_within_its_budget() {
    for scene in [Scene::can_to_plate(), Scene::bowl_to_plate()] {
        for behaviour in failures() {
            for steps_in in [0, 10, 25, 40] {
                let params = Params::guarded();
                let mut run = session(params, &scene, behaviour.clone());
                assert!(run_to_correction(&mut run));
                run.run_until(steps_in, |_| false);
                // From here on the robot reports the same for ever; it
                // applies commands, and nothing comes of them.
                let frozen = run.world.clone();
                let budget = run.controller.state().subtask().recovery().budget();
                let used = |run: &Session| run.controller.state().episode().correction_queries();
                let before = used(&run);
                for n in 1.. {
                    let now_ns = frozen.now_ns() + n * 50_000_000;
                    let mut sample = frozen.sample();
                    sample.sequence += n;
                    sample.stamp_ns = now_ns;
                    sample.applied_command += n;
                    for o in &mut sample.objects {
                        o.stamp_ns = now_ns;
                    }
                    let input = Input {
                        state: Some(&sample),
                        ..Input::default()
                    };
                    run.controller.tick(now_ns, &input);
                    let queries = used(&run) - before;
                    assert!(queries <= budget, "{behaviour:?}: {queries} of {budget}");
                    if !run.controller.state().subtask().recovery().is_pending() {
                        break;
                    }
                    assert!(n < 10_000, "{behaviour:?} never ends");
                }
            }
        }
    }
}

/// Decodes all bytes, checks the members, and returns how many there are.
fn decodes<T: Copy + PartialEq + core::fmt::Debug + TryFrom<u8, Error = UnknownCode>>(
    all: &[T],
    code: impl Fn(T) -> u8,
) {
    let known: BTreeSet<u8> = all.iter().map(|&m| code(m)).collect();
    assert_eq!(known.len(), all.len());
    for byte in 0..=u8::MAX {
        match T::try_from(byte) {
            Ok(member) => assert_eq!(code(member), byte),
            Err(e) => {
                assert_eq!(e.code, byte);
                assert!(!known.contains(&byte));
            }
        }
    }
}

#[test]
fn inv_50_a_byte_that_names_nothing_is_an_error() {
    decodes(ActionSpace::ALL, ActionSpace::code);
    decodes(ActionFrame::ALL, ActionFrame::code);
    decodes(GripperConvention::ALL, GripperConvention::code);
    decodes(GraspClass::ALL, GraspClass::code);
    decodes(DestinationKind::ALL, DestinationKind::code);
    decodes(PlaceRelation::ALL, PlaceRelation::code);
    decodes(Provenance::ALL, Provenance::code);
    decodes(Verdict::ALL, Verdict::code);
    decodes(CriticLabel::ALL, CriticLabel::code);
    decodes(Request::ALL, Request::code);
    decodes(Phase::ALL, Phase::code);
    decodes(Diagnosis::ALL, Diagnosis::code);
    decodes(Route::ALL, Route::code);
    decodes(Mode::ALL, Mode::code);
    decodes(SubPhase::ALL, SubPhase::code);
    decodes(EventKind::ALL, EventKind::code);
}

#[test]
fn inv_50_and_a_message_that_carries_one_is_refused() {
    let run = session(Params::guarded(), &Scene::can_to_plate(), Behaviour::Frozen);
    let mut world = run.world.clone();
    for byte in 0..=u8::MAX {
        let mut controller = run.controller.clone();
        world.advance(4_000_000);
        let mut sample = world.sample();
        sample.objects[1].grasp_class = byte;
        let input = Input {
            state: Some(&sample),
            ..Input::default()
        };
        controller.tick(world.now_ns(), &input);
        let refused = controller.state().refusals().of(Refusal::UnknownCode);
        assert_eq!(refused == 1, GraspClass::try_from(byte).is_err(), "{byte}");
    }
}
