//! Where to take hold of an object, by its class: what a demonstrator would do.

use crate::object::{ObjectClass, ObjectKind, Shape};

/// How far below its top a tall thing is taken, m.
const BELOW_TOP_M: f64 = 0.020;
/// The lowest the tool centre point goes above the surface, m: the pads reach 9 mm further.
const LOWEST_M: f64 = 0.012;
/// How deep the pads reach below a rim, m.
const RIM_DEPTH_M: f64 = 0.020;

/// The tool centre point relative to the object's centre, m, for an upright object at yaw 0.
#[must_use]
pub fn grasp_offset_m(kind: &ObjectKind) -> [f64; 3] {
    let [_, _, half_height] = kind.half_extent_m();
    match (kind.class, &kind.shape) {
        (
            ObjectClass::Bowl,
            Shape::Bowl {
                rim_radius_m,
                wall_m,
                ..
            },
        ) => [0.0, rim_radius_m - 0.5 * wall_m, half_height - RIM_DEPTH_M],
        (ObjectClass::Bottle, _) => [0.0, 0.0, half_height - BELOW_TOP_M],
        _ => [0.0, 0.0, (LOWEST_M - half_height).max(0.0)],
    }
}
