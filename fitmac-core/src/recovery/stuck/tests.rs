//! An arm that stands still under command.

use super::*;
use crate::{message::StateSample, params::Params, signals::GripperState, stand::hand};

const AT: Vector3 = [0.5, 0.0, 0.25];

#[test]
fn an_arm_is_stuck_when_it_was_pushed_and_did_not_move() {
    let after = |push: Action, moved_m: f64, rounds: u32| {
        let mut stuck = Stuck::NEVER;
        for round in 0..rounds {
            let [x, y, z] = AT;
            let at = [x + moved_m * f64::from(round), y, z];
            stuck.look(at);
            stuck.note(at, &push);
        }
        stuck.queries
    };
    let push = |x, y, z| [x, y, z, 0.0, 0.0, 0.0, 1.0];
    // The first look has nothing to compare with.
    assert_eq!(after(push(1.0, 0.0, 0.0), 0.0, 5), 4);
    assert_eq!(after(push(0.0, 0.2, -0.25), 0.0, 5), 4, "0.32 in all");
    assert_eq!(after(push(PUSHING, 0.0, 0.0), 0.0, 5), 0, "no push");
    assert_eq!(after([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], 0.0, 5), 0);
    assert_eq!(after(push(1.0, 0.0, 0.0), 0.9 * STANDING_M, 5), 4);
    assert_eq!(after(push(1.0, 0.0, 0.0), 1.1 * STANDING_M, 5), 0);
}

#[test]
fn patience_is_up_with_the_last_of_its_queries() {
    let stuck = Stuck {
        queries: 5,
        ..Stuck::NEVER
    };
    assert!(stuck.is_blocked(4) && stuck.is_blocked(5) && !stuck.is_blocked(6));
}

/// The waypoints of ten queries of an arm at `ee_m`.
fn ways(blocked: bool, at_limit: bool, ee_m: Vector3) -> [Option<Vector3>; 10] {
    let mut params = Params::guarded();
    params.recovery.back_out_queries = 3;
    let mut sample = StateSample {
        joint_position_rad: [0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0],
        ..StateSample::default()
    };
    if at_limit {
        sample.joint_position_rad[0] = 2.89;
    }
    let signals = hand(ee_m, GripperState::Holding);
    let mut stuck = Stuck::NEVER;
    core::array::from_fn(|query| {
        let scene = Scene {
            blocked: blocked && query == 1,
            ..Scene::new(&params, &sample, &signals)
        };
        stuck.back_out(&scene)
    })
}

#[test]
fn a_blocked_arm_at_a_joint_limit_retracts_for_a_few_queries() {
    let [inwards, up] = BACK_OUT_M;
    let found = ways(true, true, [0.3, 0.4, 0.25]);
    let share = (0.5 - inwards) / 0.5;
    let back = [0.3 * share, 0.4 * share, 0.25 + up];
    for (query, way) in found.into_iter().enumerate() {
        assert_eq!(way.is_some(), (1..4).contains(&query), "{query}");
        let near = |m: Vector3| vector::distance(m, back) < 1e-12;
        assert!(way.is_none_or(near), "{way:?}");
    }
    assert_eq!(ways(false, true, AT), [None; 10]);
    assert_eq!(ways(true, false, AT), [None; 10]);
}

#[test]
fn a_hand_near_the_base_is_drawn_to_its_axis_and_no_farther() {
    let near = ways(true, true, [BACK_OUT_M[0] / 2.0, 0.0, 0.25]);
    assert_eq!(near[1], Some([0.0, 0.0, 0.25 + BACK_OUT_M[1]]));
    let on_it = ways(true, true, [0.0, 0.0, 0.25]);
    assert_eq!(on_it[1], Some([0.0, 0.0, 0.25 + BACK_OUT_M[1]]));
}

#[test]
fn an_arm_that_moves_by_the_limit_does_not_stand() {
    let mut stuck = Stuck::NEVER;
    stuck.note([0.0; 3], &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    stuck.look([STANDING_M, 0.0, 0.0]);
    assert_eq!(stuck.queries, 0);
    stuck.look([0.5 * STANDING_M, 0.0, 0.0]);
    assert_eq!(stuck.queries, 1);
}
