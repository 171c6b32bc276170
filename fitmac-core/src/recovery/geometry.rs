//! Where a recovery moves: grasp points, hover and carry heights, and the
//! turns that bring a tilted or crossed hand in order.

use kinematics::{
    rotation::UnitQuaternion,
    vector::{self, Vector3},
};

use crate::{
    intake::robot,
    message::{JOINT_COUNT, ObjectId, StateSample},
    params::{Grasp, Params},
    signals::{TargetView, grasp_height, grasp_radius, half_height, hand},
    wire::GraspClass,
};

/// Half the width that a hand with open fingers sweeps, m (Franka Hand: 0.1 m
/// along the closing direction; at finger height 0.06 m are enough).
const SWEEP_M: f64 = 0.06;

/// Joint limits of the Panda, rad (Franka, "Robot and interface specifications").
pub const JOINT_LIMITS_RAD: [[f64; 2]; JOINT_COUNT] = [
    [-2.8973, 2.8973],
    [-1.7628, 1.7628],
    [-2.8973, 2.8973],
    [-3.0718, -0.0698],
    [-2.8973, 2.8973],
    [-0.0175, 3.7525],
    [-2.8973, 2.8973],
];

/// The closing direction of the fingers: the hand's y axis.
#[must_use]
pub fn closing_axis(sample: &StateSample) -> Vector3 {
    hand(sample).orientation.rotate([0.0, 1.0, 0.0])
}

/// A bowl offers two points of its rim along the closing direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards the hand's y axis.
    Positive,
    /// Away from it.
    Negative,
}

impl Side {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
        }
    }
}

/// Where to bring the tool centre point to grasp `target`: at `side` of a
/// bowl's rim, at the axis of anything else.
#[must_use]
pub fn grasp_point(
    params: &Grasp,
    sample: &StateSample,
    target: &TargetView,
    side: Side,
) -> Vector3 {
    let [x, y, z] = target.position_m;
    let z = z + grasp_height(params, target.class, target.half_height_m);
    let radius = grasp_radius(params, target.class, target.half_extent_m);
    let [ax, ay, _] = closing_axis(sample);
    let length = vector::norm([ax, ay, 0.0]);
    if radius <= 0.0 || length < 1e-6 {
        return [x, y, z];
    }
    let (ux, uy) = (radius * ax / length, radius * ay / length);
    match side {
        Side::Positive => [x + ux, y + uy, z],
        Side::Negative => [x - ux, y - uy, z],
    }
}

/// The freer side of a rim, the nearer one if both are free. A hand that is
/// under way changes what is near: the choice is to be made once. What is
/// grasped at its axis has one side.
#[must_use]
pub fn better_side(params: &Grasp, sample: &StateSample, target: &TargetView) -> Side {
    if target.class != GraspClass::Bowl {
        return Side::Positive;
    }
    let cost = |side| {
        let p = grasp_point(params, sample, target, side);
        (
            crowd(sample, target.id, p),
            vector::distance(p, sample.ee_position_m),
        )
    };
    let (positive, negative) = (cost(Side::Positive), cost(Side::Negative));
    if negative.0 < positive.0 || (negative.0 == positive.0 && negative.1 < positive.1) {
        Side::Negative
    } else {
        Side::Positive
    }
}

/// How many other objects crowd a grasp point.
fn crowd(sample: &StateSample, target: ObjectId, p: Vector3) -> u32 {
    let mut count = 0;
    for object in robot::objects(sample) {
        let [dx, dy, _] = vector::sub(object.position_m, p);
        let [hx, hy, _] = object.half_extent_m;
        let reach = hx.max(hy) + 0.02;
        let near = object.id != target && dx * dx + dy * dy < reach * reach;
        if near && object.position_m[2] + half_height(object) > p[2] - 0.02 {
            count += 1;
        }
    }
    count
}

/// The highest top of what stands within the hand's sweep between two places,
/// base frame, m; `except` do not count.
#[must_use]
pub fn path_top(
    sample: &StateSample,
    from: Vector3,
    to: Vector3,
    except: &[ObjectId],
) -> Option<f64> {
    let mut highest: Option<f64> = None;
    let [dx, dy, _] = vector::sub(to, from);
    let square = dx * dx + dy * dy;
    for object in robot::objects(sample) {
        if except.contains(&object.id) {
            continue;
        }
        let [ox, oy, oz] = vector::sub(object.position_m, from);
        let along = if square > 1e-12 {
            ((ox * dx + oy * dy) / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let (rx, ry) = (ox - along * dx, oy - along * dy);
        let [hx, hy, _] = object.half_extent_m;
        let reach = hx.max(hy) + SWEEP_M;
        if rx * rx + ry * ry < reach * reach {
            let top = from[2] + oz + half_height(object);
            highest = Some(highest.map_or(top, |h| h.max(top)));
        }
    }
    highest
}

/// The rotation that levels the hand and, for a box, brings the fingers along
/// its narrow side: base frame, rotation vector, rad. Zero if both are within
/// tolerance; a turn that has begun goes on to a quarter of it.
#[must_use]
pub fn levelling(
    params: &Params,
    sample: &StateSample,
    target: &TargetView,
    begun: bool,
) -> Vector3 {
    let share = if begun { 0.25 } else { 1.0 };
    let orientation = hand(sample).orientation;
    let mut rotation = [0.0; 3];
    if params.recovery.level_rad > 0.0 {
        let tilt = tilt(orientation);
        if vector::norm(tilt) > share * params.recovery.level_rad {
            rotation = tilt;
        }
    }
    if params.recovery.align_yaw_rad > 0.0 {
        let yaw = yaw_to_narrow_side(params, orientation, target);
        if yaw.abs() > share * params.recovery.align_yaw_rad {
            rotation[2] += yaw;
        }
    }
    rotation
}

/// The rotation vector that turns the hand's approach axis straight down.
fn tilt(orientation: UnitQuaternion) -> Vector3 {
    let approach = orientation.rotate([0.0, 0.0, 1.0]);
    let down = [0.0, 0.0, -1.0];
    let axis = vector::cross(approach, down);
    let sine = vector::norm(axis);
    let cosine = vector::dot(approach, down);
    let angle = libm::atan2(sine, cosine);
    // A hand that points straight up has no shortest way down; leave it.
    if sine < 1e-9 {
        [0.0; 3]
    } else {
        vector::scale(axis, angle / sine)
    }
}

/// The smallest turn about the vertical that brings the closing direction
/// along a side of a box that fits between the fingers; 0 if none fits better.
fn yaw_to_narrow_side(params: &Params, orientation: UnitQuaternion, target: &TargetView) -> f64 {
    if target.class != GraspClass::Box {
        return 0.0;
    }
    let fits = |half: f64| 2.0 * half < 0.9 * params.gripper.open_width_m;
    let [hx, hy, _] = target.half_extent_m;
    let closing = orientation.rotate([0.0, 1.0, 0.0]);
    // Sine and cosine of the turn along a side, both with the same factor.
    let turn = |axis: Vector3| {
        let side = target.orientation.rotate(axis);
        // Directions along the side are equivalent: fold the angle to a quarter turn.
        let cross = closing[0] * side[1] - closing[1] * side[0];
        let dot = closing[0] * side[0] + closing[1] * side[1];
        if dot < 0.0 {
            (-cross, -dot)
        } else {
            (cross, dot)
        }
    };
    let along_x = fits(hx).then(|| turn([1.0, 0.0, 0.0]));
    let along_y = fits(hy).then(|| turn([0.0, 1.0, 0.0]));
    let (sine, cosine) = match (along_x, along_y) {
        (Some(x), Some(y)) => {
            // The smaller angle has the smaller tangent.
            if x.0.abs() * y.1 <= y.0.abs() * x.1 {
                x
            } else {
                y
            }
        }
        (Some(turn), None) | (None, Some(turn)) => turn,
        (None, None) => return 0.0,
    };
    libm::atan2(sine, cosine)
}

#[cfg(test)]
mod tests;
