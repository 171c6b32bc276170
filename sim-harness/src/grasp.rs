//! Where to take hold of an object, by its class: what a demonstrator would do.

use crate::object::{ObjectClass, ObjectKind, Shape};
use crate::scene::{PlacedObject, Scene};

/// How far below its top a tall thing is taken, m.
const BELOW_TOP_M: f64 = 0.020;
/// The lowest the tool centre point goes above the surface, m: the pads reach 9 mm further.
pub(crate) const LOWEST_M: f64 = 0.012;
/// How deep the pads reach below a rim, m.
const RIM_DEPTH_M: f64 = 0.020;
/// More room than this around the fingers makes no difference, m.
const ROOM_ENOUGH_M: f64 = 0.06;

/// On which side of an open vessel its rim is taken, along the hand's closing direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards positive y at yaw 0: LIBERO's demonstrations.
    Left,
    /// Towards negative y.
    Right,
}

/// The tool centre point relative to the object's centre, m, for an upright object at yaw 0.
#[must_use]
pub fn grasp_offset_m(kind: &ObjectKind, side: Side) -> [f64; 3] {
    let [_, _, half_height] = kind.half_extent_m();
    match (kind.class, &kind.shape) {
        (
            ObjectClass::Bowl,
            Shape::Bowl {
                rim_radius_m,
                wall_m,
                ..
            },
        ) => {
            let radius = rim_radius_m - 0.5 * wall_m;
            let y = if side == Side::Left { radius } else { -radius };
            [0.0, y, half_height - RIM_DEPTH_M]
        }
        (ObjectClass::Bottle, _) => [0.0, 0.0, half_height - BELOW_TOP_M],
        _ => [0.0, 0.0, (LOWEST_M - half_height).max(0.0)],
    }
}

/// The side with more room around it in a scene; the left one if both are free.
#[must_use]
pub fn freer_side(scene: &Scene, target: &PlacedObject) -> Side {
    let room = |side: Side| {
        let offset = grasp_offset_m(&target.kind, side);
        let at: [f64; 3] = std::array::from_fn(|i| target.pose.position_m[i] + offset[i]);
        scene
            .objects()
            .iter()
            .filter(|o| o.id != target.id)
            .filter(|o| o.pose.position_m[2] + o.kind.half_extent_m()[2] > at[2] - RIM_DEPTH_M)
            .map(|o| {
                // To the footprint, taken along the axes of the base frame.
                let [hx, hy, _] = o.kind.half_extent_m();
                let [x, y, _] = o.pose.position_m;
                libm::hypot(
                    ((at[0] - x).abs() - hx).max(0.0),
                    ((at[1] - y).abs() - hy).max(0.0),
                )
            })
            .fold(ROOM_ENOUGH_M, f64::min)
    };
    if room(Side::Right) > room(Side::Left) {
        Side::Right
    } else {
        Side::Left
    }
}
