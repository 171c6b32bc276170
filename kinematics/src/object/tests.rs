use super::*;
use crate::rotation::UnitQuaternion;

fn tip(time_s: f64) -> TipAt {
    let down = UnitQuaternion::HALF_TURN_X * UnitQuaternion::from_yaw(0.4);
    TipAt {
        base_from_tip: Pose::new([0.5, 0.1, 0.3], down),
        time_s,
    }
}

fn seen(position: Vector3, deviation_m: f64) -> Observed {
    Observed {
        pose: Pose::new(position, UnitQuaternion::from_yaw(0.2)),
        time_s: 1.0,
        trust: Trust::isotropic(deviation_m, 0.0, 0.9),
    }
}

#[test]
fn a_fixed_camera_adds_its_extrinsics() {
    let base_from_camera = Pose::new(
        [1.0, 0.0, 1.0],
        UnitQuaternion::from_rpy(0.0, 0.0, core::f64::consts::PI),
    );
    let camera = Camera::Fixed {
        base_from_camera,
        trust: Trust::isotropic(0.003, 0.01, 1.0),
    };
    let object = camera
        .to_base(&seen([0.0, 0.0, 0.8], 0.004), &tip(77.0), 0.0)
        .expect("a pose");
    assert!(crate::vector::distance(object.pose.position, [1.0, 0.0, 1.8]) < 1e-15);
    // 3 and 4 mm make 5 mm along the view; across it the lever of 0.8 m adds 8 mm.
    let [[xx, ..], [_, yy, _], [.., zz]] = object.trust.position_covariance;
    assert!((zz - 25e-6).abs() < 1e-15, "{zz}");
    assert!((xx - 89e-6).abs() < 1e-15 && (yy - 89e-6).abs() < 1e-15);
    assert_eq!((object.time_s, object.trust.confidence), (1.0, 0.9));
}

#[test]
fn a_wrist_camera_needs_the_joint_state_of_the_picture() {
    let tip_from_camera = Pose::from_position([0.05, 0.0, -0.1]);
    let camera = Camera::Wrist {
        tip_from_camera,
        trust: Trust::isotropic(0.0, 0.0, 1.0),
    };
    let object = camera
        .to_base(&seen([0.0, 0.0, 0.3], 0.001), &tip(1.004), 0.005)
        .expect("near");
    let expected = tip(1.0).base_from_tip * tip_from_camera * seen([0.0, 0.0, 0.3], 0.0).pose;
    assert_eq!(object.pose, expected);
    let late = camera.to_base(&seen([0.0, 0.0, 0.3], 0.001), &tip(1.006), 0.005);
    assert_eq!(late, Err(PoseRefusal::JointStateApart));
    let never = camera.to_base(&seen([0.0, 0.0, 0.3], 0.001), &tip(f64::NAN), 0.005);
    assert_eq!(never, Err(PoseRefusal::JointStateApart));
}

#[test]
fn a_carried_object_follows_the_hand() {
    let object = seen([0.5, 0.11, 0.28], 0.001);
    let carried = Carried::grasp(&object, &tip(1.0)).expect("poses");
    let there = carried.at(&tip(1.0)).expect("a pose").pose;
    assert!(there.distance(object.pose) < 1e-15);
    let lifted = TipAt {
        base_from_tip: tip(2.0).base_from_tip.translated([0.0, 0.2, 0.1]),
        time_s: 2.0,
    };
    let moved = carried.at(&lifted).expect("a pose");
    assert!(moved.pose.distance(object.pose.translated([0.0, 0.2, 0.1])) < 1e-15);
    assert_eq!(moved.time_s, 2.0);
}

#[test]
fn slips_and_losses_are_told_apart() {
    let object = seen([0.5, 0.1, 0.28], 0.001);
    let carried = Carried::grasp(&object, &tip(1.0)).expect("poses");
    let check = |offset: f64, deviation: f64| {
        let sighting = seen([0.5 + offset, 0.1, 0.28], deviation);
        carried
            .check(&sighting, &tip(1.0), &SlipThresholds::default())
            .expect("poses")
    };
    assert_eq!(check(0.005, 0.001), Grip::Held);
    assert!(
        matches!(check(0.02, 0.001), Grip::Slipped { by_m, .. } if (by_m - 0.02).abs() < 1e-12)
    );
    // A vague sighting proves nothing.
    assert_eq!(check(0.02, 0.01), Grip::Held);
    assert!(matches!(check(0.2, 0.001), Grip::Lost { .. }));
    let turned = Observed {
        pose: Pose::new([0.5, 0.1, 0.28], UnitQuaternion::from_yaw(0.2 + 0.5)),
        ..seen([0.0; 3], 0.001)
    };
    let grip = carried
        .check(&turned, &tip(1.0), &SlipThresholds::default())
        .expect("poses");
    assert!(matches!(grip, Grip::Slipped { by_rad, .. } if (by_rad - 0.5).abs() < 1e-12));
    let fixed = carried.corrected(&turned, &tip(1.0)).expect("poses");
    let grip = fixed
        .check(&turned, &tip(1.0), &SlipThresholds::default())
        .expect("poses");
    assert_eq!(grip, Grip::Held);
}

#[test]
fn what_is_no_pose_is_refused() {
    let mut bad = seen([f64::NAN, 0.0, 0.0], 0.001);
    assert_eq!(Carried::grasp(&bad, &tip(1.0)), Err(PoseRefusal::NotAPose));
    bad = seen([0.0; 3], 0.001);
    bad.trust.confidence = 1.5;
    assert_eq!(Carried::grasp(&bad, &tip(1.0)), Err(PoseRefusal::NotAPose));
    bad = seen([0.0; 3], f64::INFINITY);
    assert_eq!(Carried::grasp(&bad, &tip(1.0)), Err(PoseRefusal::NotAPose));
}
