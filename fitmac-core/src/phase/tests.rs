//! The estimator at its limits, and over every pair of phases.

extern crate std;

use super::*;
use crate::{
    params::Params,
    signals::TargetView,
    stand::{hand, surface, target},
};

fn params() -> PhaseParams {
    PhaseParams {
        approach_distance_m: 0.5,
        grasp_xy_m: 0.25,
        grasp_height_m: 0.125,
        lifted_m: 0.25,
        descend_xy_m: 0.25,
        descend_clearance_m: 0.125,
        ..Params::guarded().phase
    }
}

fn estimator(phase: Phase) -> PhaseEstimator {
    PhaseEstimator {
        phase,
        ..PhaseEstimator::new()
    }
}

/// A hand that sees the target at the height `z_m`, this far away.
fn sees(state: GripperState, z_m: f64, [distance_m, xy_m, height_m]: [f64; 3]) -> Signals {
    Signals {
        target: Some(TargetView {
            distance_m,
            distance_xy_m: xy_m,
            height_m,
            ..target([0.0, 0.0, z_m])
        }),
        ..hand([0.0, 0.0, 0.75], state)
    }
}

/// The phase after ten such steps.
fn settles(mut estimator: PhaseEstimator, signals: &Signals) -> Phase {
    for _ in 0..10 {
        estimator.step(&params(), signals);
    }
    estimator.phase()
}

#[test]
fn a_hand_is_at_the_grasp_when_it_is_nearer_than_both_limits() {
    let open = |xy_m, height_m| sees(GripperState::Open, 0.0, [0.25, xy_m, height_m]);
    for (xy_m, height_m, phase) in [
        (0.249, 0.124, Phase::Grasp),
        (0.25, 0.124, Phase::Approach),
        (0.249, 0.125, Phase::Approach),
    ] {
        let settled = settles(estimator(Phase::Approach), &open(xy_m, height_m));
        assert_eq!(settled, phase, "{xy_m} {height_m}");
    }
}

#[test]
fn a_hand_has_left_the_grasp_when_it_is_farther_than_the_approach() {
    let open = |distance_m| sees(GripperState::Open, 0.0, [distance_m, 0.5, 0.0]);
    let settled = |distance_m| settles(estimator(Phase::Grasp), &open(distance_m));
    assert_eq!(settled(0.5), Phase::Grasp);
    assert_eq!(settled(0.501), Phase::Approach);
}

#[test]
fn what_rests_is_in_a_phase_of_a_pick() {
    for &phase in Phase::ALL {
        for distance_m in [0.1, 0.5, 0.6] {
            let signals = sees(GripperState::Open, 0.0, [distance_m, 0.5, 0.0]);
            let found = estimator(phase).estimate_pick(&params(), &signals);
            assert!(is_pick(found), "{phase}: {found}");
        }
    }
}

#[test]
fn what_rose_by_more_than_the_limit_in_a_closed_hand_is_lifted() {
    let params = params();
    let far = [1.0, 1.0, 1.0];
    let mut estimator = PhaseEstimator::new();
    estimator.step(&params, &sees(GripperState::Open, 0.0, far));
    for (state, z_m) in [
        (GripperState::Holding, 0.25),
        (GripperState::Closing, 0.5),
        (GripperState::Open, 0.0),
    ] {
        for _ in 0..10 {
            estimator.step(&params, &sees(state, z_m, far));
        }
        assert!(!estimator.is_lifted(), "{state:?} {z_m}");
    }
    for step in 1..=params.hysteresis_steps {
        estimator.step(&params, &sees(GripperState::Holding, 0.5, far));
        assert_eq!(estimator.is_lifted(), step == params.hysteresis_steps);
    }
    let lifted = Carry::Lifted {
        top_z_m: 0.5,
        grip_z_m: 0.25,
    };
    assert_eq!(estimator.carry(), lifted, "the hand is 0.75 m high");
    estimator.step(&params, &sees(GripperState::Holding, 0.375, far));
    assert_eq!(estimator.carry(), lifted, "the highest counts");
}

#[test]
fn what_rises_without_a_grasp_is_lifted_before_it_is_carried() {
    let params = params();
    let far = [1.0, 1.0, 1.0];
    let mut estimator = PhaseEstimator::new();
    estimator.step(&params, &sees(GripperState::Open, 0.0, far));
    let mut phases = std::vec::Vec::new();
    for _ in 0..20 {
        estimator.step(&params, &sees(GripperState::Holding, 0.5, far));
        phases.push(estimator.phase());
    }
    phases.dedup();
    assert_eq!(phases, [Phase::Approach, Phase::Lift, Phase::Transport]);
}

#[test]
fn what_is_carried_descends_within_both_limits_above_its_destination() {
    let lifted = Carry::Lifted {
        top_z_m: 0.5,
        grip_z_m: 0.0,
    };
    for (distance_xy_m, clearance_m, phase) in [
        (0.25, 0.125, Phase::Descend),
        (0.251, 0.125, Phase::Transport),
        (0.25, 0.126, Phase::Transport),
    ] {
        let mut signals = sees(GripperState::Holding, 0.5, [0.0; 3]);
        signals.destination = Some(crate::signals::DestinationView {
            distance_xy_m,
            clearance_m,
            ..surface([0.0; 3])
        });
        let carrying = PhaseEstimator {
            carry: lifted,
            ..estimator(Phase::Transport)
        };
        assert_eq!(settles(carrying, &signals), phase);
    }
}

#[test]
fn a_phase_follows_along_an_edge_only_and_back_to_a_pick_is_a_new_attempt() {
    let params = params();
    for &from in Phase::ALL {
        for &to in Phase::ALL {
            let mut estimator = estimator(from);
            let looks = if to == Phase::Release {
                1
            } else {
                params.hysteresis_steps
            };
            for _ in 1..looks {
                assert_eq!(estimator.settle_on(&params, to), Change::None);
                assert_eq!(estimator.phase(), from);
            }
            let change = estimator.settle_on(&params, to);
            let expected = if !EDGES.contains(&(from, to)) {
                Change::None
            } else if to == Phase::Approach && from != Phase::Grasp {
                Change::Attempt
            } else {
                Change::Phase
            };
            assert_eq!(change, expected, "{from} to {to}");
            let now = if expected == Change::None { from } else { to };
            assert_eq!(estimator.phase(), now, "{from} to {to}");
        }
    }
}

#[test]
fn a_look_in_between_starts_the_count_anew() {
    let params = params();
    let mut estimator = estimator(Phase::Approach);
    for _ in 0..10 {
        assert_eq!(estimator.settle_on(&params, Phase::Grasp), Change::None);
        assert_eq!(estimator.settle_on(&params, Phase::Approach), Change::None);
        assert_eq!(estimator.settle_on(&params, Phase::Grasp), Change::None);
        assert_eq!(estimator.settle_on(&params, Phase::Lift), Change::None);
    }
    assert_eq!(estimator.settle_on(&params, Phase::Lift), Change::Phase);
}
