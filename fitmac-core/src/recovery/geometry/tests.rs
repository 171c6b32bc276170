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
