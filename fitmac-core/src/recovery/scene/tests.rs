//! A scene at its limits.

use super::*;
use crate::stand::hand;

#[test]
fn a_hand_is_open_beyond_nine_tenths() {
    let mut params = Params::guarded();
    params.gripper.open_width_m = 1.0;
    let sample = StateSample::default();
    for (state, width_m, open) in [
        (GripperState::Open, 0.9, false),
        (GripperState::Open, 0.901, true),
        (GripperState::Closing, 1.0, false),
    ] {
        let mut signals = hand([0.0; 3], state);
        signals.gripper.width_m = width_m;
        let scene = Scene::new(&params, &sample, &signals);
        assert_eq!(scene.is_open(), open, "{state:?} {width_m}");
    }
}

#[test]
fn a_joint_is_at_its_limit_within_the_margin_on_both_sides() {
    let mut params = Params::guarded();
    params.recovery.joint_margin_rad = 0.25;
    let signals = hand([0.0; 3], GripperState::Open);
    let middle = geometry::JOINT_LIMITS_RAD.map(|[lower, upper]| 0.5 * (lower + upper));
    let near = |joint: usize, q: f64| {
        let mut sample = StateSample {
            joint_position_rad: middle,
            ..StateSample::default()
        };
        sample.joint_position_rad[joint] = q;
        Scene::new(&params, &sample, &signals).at_joint_limit()
    };
    for (joint, [lower, upper]) in geometry::JOINT_LIMITS_RAD.into_iter().enumerate() {
        assert!(!near(joint, middle[joint]), "{joint}");
        assert!(!near(joint, lower + 0.25) && !near(joint, upper - 0.25));
        assert!(near(joint, lower + 0.249) && near(joint, upper - 0.249));
        assert!(near(joint, lower - 0.1) && near(joint, upper + 0.1));
    }
}

#[test]
fn the_way_to_a_goal_is_measured_in_the_plane() {
    let (params, sample) = (Params::guarded(), StateSample::default());
    let signals = hand([1.0, 1.0, 5.0], GripperState::Open);
    let scene = Scene::new(&params, &sample, &signals);
    assert_eq!(scene.horizontal_to([4.0, 5.0, 0.0]), 5.0);
}

#[test]
fn a_place_may_follow_where_it_is_switched_on_and_leads_somewhere() {
    let sample = StateSample::default();
    let signals = hand([0.0; 3], GripperState::Open);
    for (hard_place, destination_object) in [(true, 0), (true, 3), (false, 0), (false, 3)] {
        let mut params = Params::guarded();
        params.switches.hard_place = hard_place;
        let scene = Scene {
            destination_object,
            ..Scene::new(&params, &sample, &signals)
        };
        assert_eq!(scene.may_place(), hard_place && destination_object == 3);
    }
}
