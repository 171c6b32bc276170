//! What a sample says, at the limits of each word.

use super::*;

fn gripper() -> GripperParams {
    GripperParams {
        open_width_m: 1.0,
        closed_ratio: 0.75,
        moving_m: 0.125,
        empty_width_m: 0.25,
        empty_thin_width_m: 0.0625,
        held_radius_m: 0.5,
    }
}

fn state(width_m: f64, before_m: f64, commanded_closed: bool) -> GripperState {
    let sample = StateSample {
        gripper_width_m: width_m,
        ..StateSample::default()
    };
    GripperView::new(&gripper(), &sample, before_m, commanded_closed).state
}

#[test]
fn the_pads_stand_as_their_width_and_its_change_say() {
    use GripperState::{Closing, Empty, Holding, Open};
    for (width_m, before_m, closed, expected) in [
        // Narrow is below three quarters, and told to open it is open from there on.
        (0.75, 0.75, false, Open),
        (0.749, 0.749, false, Holding),
        // It moves if it changes by more than an eighth.
        (0.5, 0.374, false, Open),
        (0.5, 0.375, false, Holding),
        (0.5, 0.626, false, Closing),
        (0.5, 0.625, false, Holding),
        // Told to close, fingers that are pressed apart are not opening unless they are wide.
        (0.5, 0.25, true, Holding),
        (0.75, 0.5, true, Open),
        // Told to close and still wide open: on its way; a wide thing between them: held.
        (0.751, 0.751, true, Open),
        (0.75, 0.75, true, Holding),
        // Nothing is narrower than a quarter.
        (0.25, 0.25, true, Holding),
        (0.249, 0.249, true, Empty),
    ] {
        assert_eq!(
            state(width_m, before_m, closed),
            expected,
            "{width_m} {before_m} {closed}"
        );
    }
}

/// A bowl of an ordinary kind at `position_m`.
fn bowl(position_m: Vector3) -> ObjectSample {
    ObjectSample {
        id: 1,
        grasp_class: GraspClass::Bowl.code(),
        visible: 1,
        position_m,
        orientation: [1.0, 0.0, 0.0, 0.0],
        half_extent_m: [0.5, 0.25, 0.125],
        ..ObjectSample::default()
    }
}

#[test]
fn only_at_a_thin_wall_may_nearly_closed_pads_hold_something() {
    let state = |object: ObjectSample, width_m| {
        let mut sample = StateSample {
            gripper_width_m: width_m,
            object_count: 1,
            ..StateSample::default()
        };
        sample.objects[0] = object;
        GripperView::new(&gripper(), &sample, width_m, true).state
    };
    // Half a metre of the bowl and half a metre of reach.
    assert_eq!(state(bowl([0.999, 0.0, 0.0]), 0.125), GripperState::Holding);
    assert_eq!(state(bowl([1.0, 0.0, 0.0]), 0.125), GripperState::Empty);
    assert_eq!(state(bowl([0.0; 3]), 0.0625), GripperState::Holding);
    assert_eq!(state(bowl([0.0; 3]), 0.0624), GripperState::Empty);
    let can = ObjectSample {
        grasp_class: GraspClass::Can.code(),
        ..bowl([0.0; 3])
    };
    assert_eq!(state(can, 0.125), GripperState::Empty);
}

#[test]
fn a_thing_is_grasped_at_its_middle_below_its_top_or_by_its_rim() {
    let grasp = Grasp {
        tall_m: 0.5,
        below_top_m: 0.0625,
        rim_depth_m: 0.03125,
        rim_inset_m: 0.125,
        floor_m: 0.015625,
    };
    let height = |class, half| grasp_height(&grasp, class, half);
    assert_eq!(height(GraspClass::Can, 0.25), 0.0, "as tall as the limit");
    assert_eq!(height(GraspClass::Can, 0.375), 0.3125);
    assert_eq!(height(GraspClass::Bowl, 0.25), 0.21875);
    assert_eq!(
        height(GraspClass::Can, 0.0078125),
        0.0078125,
        "off the floor"
    );
    let radius = |class, extent| grasp_radius(&grasp, class, extent);
    assert_eq!(radius(GraspClass::Bowl, [0.5, 0.25, 1.0]), 0.125);
    assert_eq!(radius(GraspClass::Bowl, [0.0625, 0.25, 1.0]), 0.0);
    assert_eq!(radius(GraspClass::Can, [0.5, 0.25, 1.0]), 0.0);
}

#[test]
fn the_way_to_a_rim_is_the_way_to_its_nearest_point() {
    let grasp = Grasp {
        tall_m: 0.5,
        rim_inset_m: 0.0,
        rim_depth_m: 0.125,
        floor_m: 0.0,
        ..Grasp::default()
    };
    let site = GraspSite::of(&bowl([1.0, 1.0, 1.0]));
    let offset = |ee_m| site.offset_to(&grasp, ee_m);
    // A quarter of a metre from the axis is the rim; its top is an eighth above the centre.
    assert_eq!(offset([1.5, 1.0, 1.5]), [0.25, 0.0, 0.5]);
    assert_eq!(offset([1.0, 1.125, 1.0]), [0.0, -0.125, 0.0]);
    assert_eq!(offset([1.0, 1.0, 1.0]), [0.25, 0.0, 0.0], "on the axis");
    let site_at_zero = GraspSite::of(&bowl([0.0; 3]));
    let almost = site_at_zero.offset_to(&grasp, [0.0, 1e-9, 0.0]);
    assert_eq!(almost, [0.25, 0.0, 0.0], "a nanometre is on the axis");
    let can = GraspSite {
        class: GraspClass::Can,
        ..site
    };
    assert_eq!(offset([1.5, 1.0, 1.0])[0], 0.25);
    assert_eq!(can.offset_to(&grasp, [1.5, 0.75, 1.25]), [0.5, -0.25, 0.25]);
}

fn depth_of(object: &ObjectSample) -> f64 {
    depth(&GraspSite::of(object), object.half_extent_m)
}

#[test]
fn a_bowl_that_hangs_askew_reaches_down_with_its_foot_which_is_narrower_than_its_rim() {
    // A quarter of a turn about y: its x axis points down.
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let askew = ObjectSample {
        orientation: [half, 0.0, half, 0.0],
        ..bowl([0.0; 3])
    };
    let about = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(about(half_height(&askew), 0.5), "{}", half_height(&askew));
    assert!(about(depth_of(&askew), 0.3), "{}", depth_of(&askew));
    let can = ObjectSample {
        grasp_class: GraspClass::Can.code(),
        ..askew
    };
    assert!(about(depth_of(&can), 0.5));
    let leaning = ObjectSample {
        orientation: [0.0, 0.0, 1.0, 0.0],
        ..bowl([0.0; 3])
    };
    assert!(about(depth_of(&leaning), 0.125), "upside down");
    // About x: its y axis points down.
    let aside = ObjectSample {
        orientation: [half, half, 0.0, 0.0],
        ..bowl([0.0; 3])
    };
    assert!(about(half_height(&aside), 0.25) && about(depth_of(&aside), 0.15));
}

#[test]
fn of_two_things_equally_near_the_first_in_the_list_is_the_nearest_other() {
    let can = |id, x_m| ObjectSample {
        id,
        grasp_class: GraspClass::Can.code(),
        ..bowl([x_m, 0.0, 0.0])
    };
    let nearest = |objects: &[ObjectSample]| {
        let mut sample = StateSample {
            object_count: objects.len() as u32,
            ..StateSample::default()
        };
        for (slot, object) in sample.objects.iter_mut().zip(objects) {
            *slot = *object;
        }
        nearest_other(&Grasp::default(), &sample, 8, 9).map(|other| other.id)
    };
    assert_eq!(nearest(&[can(5, 0.5), can(3, -0.5)]), Some(5));
    assert_eq!(nearest(&[can(3, -0.5), can(5, 0.5)]), Some(3));
    assert_eq!(nearest(&[can(3, -0.5), can(5, 0.25)]), Some(5));
    // The target, its anchor, a nameless thing and a fixture are no other.
    let fixture = ObjectSample {
        grasp_class: GraspClass::Fixture.code(),
        ..can(2, 0.0)
    };
    let none = [can(8, 0.0), can(9, 0.0), can(0, 0.0), fixture];
    assert_eq!(nearest(&none), None);
}
