//! Grasp points and paths, with numbers that a binary fraction holds.

use super::*;
use crate::{message::ObjectSample, stand::target};

/// A hand at the origin that points straight down, its fingers along y; boxes at these places, an
/// eighth of a metre each way.
fn sample(places: &[Vector3]) -> StateSample {
    let mut sample = StateSample {
        ee_orientation: [0.0, 1.0, 0.0, 0.0],
        object_count: places.len() as u32,
        ..StateSample::default()
    };
    for (n, (object, &position_m)) in sample.objects.iter_mut().zip(places).enumerate() {
        *object = ObjectSample {
            id: n as ObjectId + 1,
            grasp_class: GraspClass::Box.code(),
            position_m,
            orientation: [1.0, 0.0, 0.0, 0.0],
            half_extent_m: [0.125, 0.0625, 0.125],
            ..ObjectSample::default()
        };
    }
    sample
}

fn bowl(position_m: Vector3) -> TargetView {
    TargetView {
        class: GraspClass::Bowl,
        half_extent_m: [0.25, 0.25, 0.125],
        half_height_m: 0.125,
        ..target(position_m)
    }
}

fn grasp() -> Grasp {
    Grasp {
        rim_inset_m: 0.0,
        rim_depth_m: 0.0,
        floor_m: 0.0,
        ..Grasp::default()
    }
}

#[test]
fn a_rim_is_grasped_along_the_closing_direction_on_either_side() {
    let hand = sample(&[]);
    let bowl = bowl([1.0, 2.0, 0.5]);
    // Pointing down, the hand's y axis is the base's, turned about.
    assert_eq!(closing_axis(&hand)[1], -1.0);
    let at = |side| grasp_point(&grasp(), &hand, &bowl, side);
    assert_eq!(at(Side::Positive), [1.0, 1.75, 0.625]);
    assert_eq!(at(Side::Negative), [1.0, 2.25, 0.625]);
    let mut across = hand;
    let half = core::f64::consts::FRAC_1_SQRT_2;
    across.ee_orientation = [0.0, half, half, 0.0];
    for (side, x) in [(Side::Positive, 1.25), (Side::Negative, 0.75)] {
        let found = grasp_point(&grasp(), &across, &bowl, side);
        assert!(
            vector::distance(found, [x, 2.0, 0.625]) < 1e-12,
            "{found:?}"
        );
    }
    assert_eq!(Side::Positive.other(), Side::Negative);
    assert_eq!(Side::Negative.other(), Side::Positive);
    // Fingers that close up and down offer no side.
    let mut upright = hand;
    let half = core::f64::consts::FRAC_1_SQRT_2;
    upright.ee_orientation = [half, half, 0.0, 0.0];
    let found = grasp_point(&grasp(), &upright, &bowl, Side::Positive);
    assert_eq!(found, [1.0, 2.0, 0.625]);
}

#[test]
fn the_freer_side_is_chosen_before_the_nearer_one() {
    let choice = |ee_y: f64, others: &[Vector3]| {
        let mut hand = sample(others);
        hand.ee_position_m = [0.0, ee_y, 0.0];
        for object in &mut hand.objects {
            object.id += 1;
        }
        better_side(&grasp(), &hand, &bowl([0.0; 3]))
    };
    // The positive side lies at y = -0.25.
    assert_eq!(choice(0.0, &[]), Side::Positive, "neither is nearer");
    assert_eq!(choice(-1.0, &[]), Side::Positive);
    assert_eq!(choice(1.0, &[]), Side::Negative);
    assert_eq!(choice(-1.0, &[[0.0, -0.25, 0.0]]), Side::Negative);
    assert_eq!(choice(1.0, &[[0.0, 0.25, 0.0]]), Side::Positive);
}

#[test]
fn what_crowds_a_point_reaches_it_and_is_as_high() {
    let count = |place: Vector3| crowd(&sample(&[place]), 9, [0.0, 0.0, 1.0]);
    // Within an eighth and two centimetres, its top above two centimetres below the point.
    assert_eq!(count([0.144, 0.0, 1.0]), 1);
    assert_eq!(count([0.0, -0.144, 1.0]), 1);
    assert_eq!(count([0.146, 0.0, 1.0]), 0);
    assert_eq!(count([0.11, 0.11, 1.0]), 0, "round the corner");
    assert_eq!(count([0.0, 0.0, 0.856]), 1);
    assert_eq!(count([0.0, 0.0, 0.854]), 0);
    let own = sample(&[[0.0, 0.0, 1.0]]);
    assert_eq!(crowd(&own, 1, [0.0, 0.0, 1.0]), 0, "the target itself");
    let three = sample(&[[0.0, 0.0, 1.0]; 3]);
    assert_eq!(crowd(&three, 2, [0.0, 0.0, 1.0]), 2);
}

#[test]
fn the_highest_thing_within_the_sweep_of_a_way_counts() {
    let (from, to) = ([1.0, 1.0, 2.0], [3.0, 1.0, 2.0]);
    let reach = 0.125 + SWEEP_M;
    let top = |place: Vector3| path_top(&sample(&[place]), from, to, &[]);
    assert_eq!(top([2.0, 1.0, 0.5]), Some(0.625));
    for side in [1.0, -1.0] {
        assert_eq!(top([2.0, 1.0 + side * (reach - 1e-3), 0.5]), Some(0.625));
        assert_eq!(top([2.0, 1.0 + side * (reach + 1e-3), 0.5]), None);
    }
    assert_eq!(
        top([1.0 - reach + 1e-3, 1.0, 0.5]),
        Some(0.625),
        "the start"
    );
    assert_eq!(top([1.0 - reach - 1e-3, 1.0, 0.5]), None);
    assert_eq!(top([3.0 + reach - 1e-3, 1.0, 0.5]), Some(0.625), "the end");
    assert_eq!(top([3.0 + reach + 1e-3, 1.0, 0.5]), None);
    let three = sample(&[[2.0, 1.0, 0.5], [1.5, 1.0, 1.5], [2.5, 1.0, 1.0]]);
    assert_eq!(path_top(&three, from, to, &[]), Some(1.625));
    assert_eq!(path_top(&three, from, to, &[2]), Some(1.125));
    assert_eq!(path_top(&three, from, to, &[1, 2, 3]), None);
    // Along the diagonal, and without any way.
    let (from, to) = ([0.0; 3], [2.0, 2.0, 0.0]);
    let across = sample(&[[1.2, 0.8, 0.0]]);
    assert_eq!(path_top(&across, from, to, &[]), None, "0.28 aside");
    let close = sample(&[[1.1, 0.9, 0.0]]);
    assert_eq!(path_top(&close, from, to, &[]), Some(0.125), "0.14 aside");
    assert_eq!(path_top(&close, from, from, &[]), None);
    assert_eq!(path_top(&close, to, to, &[]), None);
}

#[test]
fn what_is_just_as_far_as_a_reach_is_out_of_it() {
    let count = |place: Vector3| crowd(&sample(&[place]), 9, [0.0, 0.0, 1.0]);
    assert_eq!(count([0.125 + 0.02, 0.0, 1.0]), 0);
    assert_eq!(count([0.0, 0.125 + 0.02, 1.0]), 0);
    let low = 1.0 - 0.02 - 0.125;
    assert_eq!((count([0.0, 0.0, low]), low + 0.125), (0, 1.0 - 0.02));
    let reach = 0.125 + SWEEP_M;
    let top = |place: Vector3, to| path_top(&sample(&[place]), [0.0; 3], to, &[]);
    assert_eq!(top([0.0, reach, 0.0], [1.0, 0.0, 0.0]), None);
    // A way of a micrometre is none: its end counts for nothing.
    assert_eq!(top([reach, 0.0, 0.0], [1e-6, 0.0, 0.0]), None);
    assert_eq!(top([reach, 0.0, 0.0], [2e-6, 0.0, 0.0]), Some(0.125));
}

/// The turn that is asked of a hand, with these limits of tilt and yaw.
fn turn(level_rad: f64, align_rad: f64, hand: &StateSample, box_of: &TargetView) -> Vector3 {
    let mut params = Params::guarded();
    params.recovery.level_rad = level_rad;
    params.recovery.align_yaw_rad = align_rad;
    levelling(&params, hand, box_of, false)
}

fn narrow_along(half_extent_m: Vector3, yaw_rad: f64) -> TargetView {
    TargetView {
        class: GraspClass::Box,
        orientation: UnitQuaternion::from_rotation_vector([0.0, 0.0, yaw_rad]),
        half_extent_m,
        ..target([0.0; 3])
    }
}

#[test]
fn a_hand_is_turned_when_it_is_off_by_more_than_the_limit() {
    let mut tilted = sample(&[]);
    tilted.ee_orientation = [0.0, 0.8, 0.0, 0.6];
    let can = target([0.0; 3]);
    let all = turn(1e-9, 0.0, &tilted, &can);
    let off_rad = vector::norm(all);
    assert!(off_rad > 1.0);
    assert_eq!(
        turn(off_rad, 0.0, &tilted, &can),
        [0.0; 3],
        "the limit itself"
    );
    assert_eq!(turn(off_rad.next_down(), 0.0, &tilted, &can), all);
    assert_eq!(turn(0.0, 0.0, &tilted, &can), [0.0; 3], "without a limit");
    let level = sample(&[]);
    let slim = narrow_along([0.5, 0.02, 0.02], 0.25);
    let [_, _, yaw_rad] = turn(0.0, 1e-9, &level, &slim);
    assert!((yaw_rad - 0.25).abs() < 1e-12, "{yaw_rad}");
    let limited = |limit_rad| turn(0.0, limit_rad, &level, &slim);
    assert_eq!(limited(yaw_rad), [0.0; 3], "the limit itself");
    assert_eq!(limited(yaw_rad.next_down()), [0.0, 0.0, yaw_rad]);
    assert_eq!(limited(0.0), [0.0; 3], "without a limit");
}

#[test]
fn a_turn_that_has_begun_goes_on_to_a_quarter_of_the_limit() {
    let mut params = Params::guarded();
    (params.recovery.level_rad, params.recovery.align_yaw_rad) = (0.0, 1.0);
    let turned = |yaw_rad, begun| {
        let slim = narrow_along([0.5, 0.02, 0.02], yaw_rad);
        levelling(&params, &sample(&[]), &slim, begun) != [0.0; 3]
    };
    assert!(turned(1.01, false) && !turned(0.99, false));
    assert!(turned(0.26, true) && !turned(0.24, true));
}

#[test]
fn a_hand_that_points_straight_up_or_down_is_not_tilted() {
    let off = |w: f64| {
        let orientation = UnitQuaternion::from_wxyz([w, 1.0, 0.0, 0.0]);
        tilt(orientation.unwrap_or(UnitQuaternion::IDENTITY))
    };
    assert_eq!(off(0.0), [0.0; 3]);
    assert_eq!(tilt(UnitQuaternion::IDENTITY), [0.0; 3]);
    // Half of a nanoradian in the quaternion is a nanoradian of tilt.
    assert_ne!(off(5e-10), [0.0; 3]);
    assert_eq!(off(4.9e-10), [0.0; 3]);
}

#[test]
fn a_side_fits_below_nine_tenths_of_the_opening() {
    let level = sample(&[]);
    let half_m = 0.9 * Params::guarded().gripper.open_width_m / 2.0;
    let yaw = |half_m| turn(0.0, 1e-9, &level, &narrow_along([0.5, half_m, 0.02], 0.25))[2];
    assert_eq!(yaw(half_m), 0.0);
    assert!((yaw(half_m.next_down()) - 0.25).abs() < 1e-12);
    // Square across, either way round leads there: the positive one is taken.
    let [_, _, quarter] = turn(0.0, 1e-9, &level, &narrow_along([0.02, 0.5, 0.02], 0.0));
    assert_eq!(quarter, core::f64::consts::FRAC_PI_2);
}

/// The number next to this one that many times.
fn near(x: f64, n: i64) -> f64 {
    f64::from_bits(x.to_bits().wrapping_add_signed(n))
}

#[test]
fn fingers_a_millionth_off_the_vertical_offer_a_side() {
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let askew = |z: f64| {
        let mut hand = sample(&[]);
        hand.ee_orientation = [half, half, 0.0, z];
        hand
    };
    let across = |hand: &StateSample| {
        let [x, y, _] = closing_axis(hand);
        vector::norm([x, y, 0.0])
    };
    let hands = (-20_000..20_000).map(|n| askew(near(0.5e-6 / half, n)));
    let mut at_limit = hands.filter(|hand| across(hand) == 1e-6);
    let hand = at_limit.next().expect("one lies at the limit itself");
    let point = |hand| grasp_point(&grasp(), hand, &bowl([0.0; 3]), Side::Positive);
    assert_ne!(point(&hand), [0.0, 0.0, 0.125]);
    assert_eq!(point(&askew(0.49e-6 / half)), [0.0, 0.0, 0.125]);
}

#[test]
fn of_two_sides_equally_far_the_hand_turns_to_the_first() {
    // Hands that point down, turned by an eighth, or almost.
    let (sine, cosine) = libm::sincos(core::f64::consts::FRAC_PI_8);
    let turned = |n, m| UnitQuaternion::from_wxyz([0.0, near(cosine, n), near(sine, m), 0.0]);
    let hands = (-100..100).flat_map(|n| (-100..100).filter_map(move |m| turned(n, m)));
    let mut ties = hands.filter(|hand| {
        let [x, y, _] = hand.rotate([0.0, 1.0, 0.0]);
        x.abs() == y.abs()
    });
    let hand = ties.next().expect("one lies on the diagonal");
    let [x, y, _] = hand.rotate([0.0, 1.0, 0.0]);
    let first = libm::atan2(-y * x.signum(), x.abs());
    let cube = narrow_along([0.02; 3], 0.0);
    let found = yaw_to_narrow_side(&Params::guarded(), hand, &cube);
    assert!((found - first).abs() < 1e-12, "{found}");
}

#[test]
fn the_joints_end_where_the_data_sheet_says() {
    let degrees = [
        [-166.0, 166.0],
        [-101.0, 101.0],
        [-166.0, 166.0],
        [-176.0, -4.0],
        [-166.0, 166.0],
        [-1.0, 215.0],
        [-166.0, 166.0],
    ];
    for (joint, (limits, degrees)) in JOINT_LIMITS_RAD.iter().zip(degrees).enumerate() {
        for (limit, degrees) in limits.iter().zip(degrees) {
            let off: f64 = limit - f64::to_radians(degrees);
            assert!(off.abs() < 1e-4, "{joint}: {limit}");
        }
    }
}
