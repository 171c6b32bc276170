use proptest::prelude::*;

use super::*;
use crate::rotation::{IDENTITY3, mat_mul, mat_vec, transpose};
use crate::vector::{add, norm, scale, sub};

fn rotation() -> impl Strategy<Value = UnitQuaternion> {
    prop::array::uniform3(-4.0..4.0_f64).prop_map(UnitQuaternion::from_rotation_vector)
}

fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform3(-2.0..2.0_f64), rotation()).prop_map(|(p, q)| Pose::new(p, q))
}

proptest! {
    #[test]
    fn matrix_and_quaternion_rotate_alike(q in rotation(), v in prop::array::uniform3(-5.0..5.0_f64)) {
        let m = q.to_matrix();
        prop_assert!(norm(sub(mat_vec(&m, v), q.rotate(v))) < 1e-14 * (1.0 + norm(v)));
        let back = UnitQuaternion::from_matrix(&m).expect("a rotation");
        prop_assert!(back.angle_to(q) < 1e-7);
        let unit = mat_mul(&m, &transpose(&m));
        for (a, b) in unit.iter().flatten().zip(IDENTITY3.iter().flatten()) {
            prop_assert!((a - b).abs() < 1e-14);
        }
    }

    #[test]
    fn exponential_and_logarithm_invert(v in prop::array::uniform3(-1.8..1.8_f64)) {
        let back = UnitQuaternion::from_rotation_vector(v).to_rotation_vector();
        prop_assert!(norm(v) > 3.1 || norm(sub(back, v)) < 1e-13);
    }

    #[test]
    fn a_pose_times_its_inverse_is_the_identity(p in pose(), x in prop::array::uniform3(-5.0..5.0_f64)) {
        let one = p * p.inverse();
        prop_assert!(norm(one.position) < 1e-14);
        prop_assert!(one.orientation.angle_to(UnitQuaternion::IDENTITY) < 1e-13);
        let there = p.transform_point(x);
        prop_assert!(norm(sub(p.inverse().transform_point(there), x)) < 1e-13);
    }

    #[test]
    fn the_error_leads_to_the_target(a in pose(), b in pose()) {
        let (d, r) = a.error_to(b);
        let reached = Pose::new(add(a.position, d), UnitQuaternion::from_rotation_vector(r) * a.orientation);
        prop_assert!(reached.distance(b) < 1e-14);
        prop_assert!(reached.orientation.angle_to(b.orientation) < 1e-13);
    }

    #[test]
    fn half_of_a_slerp_has_half_of_the_angle(a in rotation(), b in rotation()) {
        let half = a.slerp(b, 0.5);
        prop_assert!((a.angle_to(half) - 0.5 * a.angle_to(b)).abs() < 1e-12);
    }
}

#[test]
fn small_rotations_keep_their_vector() {
    let v = scale([1.0, -2.0, 0.5], 1e-12);
    assert_eq!(
        UnitQuaternion::from_rotation_vector(v).to_rotation_vector(),
        v
    );
}

#[test]
fn what_is_no_rotation_is_refused() {
    assert_eq!(UnitQuaternion::from_wxyz([0.0; 4]), None);
    assert_eq!(UnitQuaternion::from_wxyz([1.0, f64::NAN, 0.0, 0.0]), None);
    assert_eq!(
        UnitQuaternion::from_matrix(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]),
        None
    );
    assert_eq!(
        UnitQuaternion::from_matrix(&[[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        None
    );
    assert_eq!(UnitQuaternion::from_axis_angle([0.0; 3], 1.0), None);
}

#[test]
fn roll_pitch_yaw_turn_about_fixed_axes() {
    let q = UnitQuaternion::from_rpy(0.3, -0.7, 1.1);
    let axis = |a, r| UnitQuaternion::from_axis_angle(a, r).expect("an axis");
    let expected =
        axis([0.0, 0.0, 1.0], 1.1) * axis([0.0, 1.0, 0.0], -0.7) * axis([1.0, 0.0, 0.0], 0.3);
    assert!(q.angle_to(expected) < 1e-15);
    assert!((UnitQuaternion::from_yaw(2.5).yaw() - 2.5).abs() < 1e-15);
}
