//! What the tests beside the code have in common.

use kinematics::{rotation::UnitQuaternion, vector::Vector3};

use crate::{
    params::Gripper,
    signals::{DestinationView, GripperState, GripperView, Signals, TargetView},
    wire::{GraspClass, PlaceRelation},
};

/// A hand at `ee_m` that sees nothing.
pub(crate) fn hand(ee_m: Vector3, state: GripperState) -> Signals {
    Signals {
        ee_m,
        gripper: GripperView {
            width_m: Gripper::default().open_width_m,
            state,
        },
        target: None,
        destination: None,
        other: None,
    }
}

/// A small target at `position_m`, under the hand and far from it.
pub(crate) const fn target(position_m: Vector3) -> TargetView {
    TargetView {
        id: 1,
        position_m,
        orientation: UnitQuaternion::IDENTITY,
        half_extent_m: [0.0; 3],
        half_height_m: 0.0,
        depth_m: 0.0,
        class: GraspClass::Can,
        distance_m: 1.0,
        distance_xy_m: 0.0,
        height_m: 1.0,
    }
}

/// A surface at `position_m`, half a metre each way, and the target above its middle.
pub(crate) const fn surface(position_m: Vector3) -> DestinationView {
    DestinationView {
        position_m,
        half_extent_m: [0.5, 0.5, 0.0],
        relation: PlaceRelation::On,
        distance_m: 0.0,
        distance_xy_m: 0.0,
        clearance_m: 0.0,
    }
}
