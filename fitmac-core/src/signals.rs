//! Signals: what the newest sample says about gripper, target and destination
//! (equations 2 and 3).

use kinematics::{
    pose::Pose,
    rotation::UnitQuaternion,
    vector::{self, Vector3},
};

use crate::{
    intake::robot,
    lock::{Anchor, Lock},
    message::{ObjectId, ObjectSample, StateSample},
    params::{Grasp, Gripper as GripperParams, Params},
    tracking::Tracking,
    wire::{GraspClass, PlaceRelation},
};

/// Radius of a bowl's foot as a share of its rim's: the ring that an ordinary bowl stands on.
const FOOT_SHARE: f64 = 0.6;

/// True if a thing with thin walls is within reach of the fingers: then a
/// nearly closed gripper may still hold something.
fn thin_at_hand(p: &GripperParams, sample: &StateSample) -> bool {
    robot::objects(sample).any(|o| {
        let [hx, hy, _] = o.half_extent_m;
        let reach = hx.max(hy) + p.held_radius_m;
        class(o) == GraspClass::Bowl && vector::distance(o.position_m, sample.ee_position_m) < reach
    })
}

/// What the gripper does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperView {
    /// Distance between the pads, m.
    pub width_m: f64,
    /// How the pads stand.
    pub state: GripperState,
}

/// How the pads stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GripperState {
    /// Open, or on the way there.
    Open,
    /// On the way to closed.
    Closing,
    /// Closed on something.
    Holding,
    /// Closed on nothing.
    Empty,
}

impl GripperView {
    /// Closed, on something or on nothing, and no longer moving.
    #[must_use]
    pub const fn is_closed(&self) -> bool {
        matches!(self.state, GripperState::Holding | GripperState::Empty)
    }

    /// `width_before_m` is the width one policy step earlier, `commanded_closed`
    /// the last gripper command: an object nearly as wide as the gripper opens
    /// leaves no other sign.
    pub(crate) fn new(
        p: &GripperParams,
        sample: &StateSample,
        width_before_m: f64,
        commanded_closed: bool,
    ) -> Self {
        let width_m = sample.gripper_width_m;
        let empty_m = if thin_at_hand(p, sample) {
            p.empty_thin_width_m
        } else {
            p.empty_width_m
        };
        let change = width_m - width_before_m;
        let narrow = width_m < p.closed_ratio * p.open_width_m;
        // Fingers that give way while they are told to close are not opening.
        let opening = change > p.moving_m && (!commanded_closed || !narrow);
        let state = if opening || (!narrow && !commanded_closed) {
            GripperState::Open
        } else if change < -p.moving_m {
            GripperState::Closing
        } else if !narrow && width_m > p.open_width_m - 2.0 * p.moving_m {
            GripperState::Open
        } else if width_m < empty_m {
            GripperState::Empty
        } else {
            GripperState::Holding
        };
        Self { width_m, state }
    }
}

/// The target as this step sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetView {
    /// The instance.
    pub id: ObjectId,
    /// Centre, base frame, m; carried along with the hand while unseen in it.
    pub position_m: Vector3,
    /// Orientation, base frame.
    pub orientation: UnitQuaternion,
    /// Half extent along its own axes, m.
    pub half_extent_m: Vector3,
    /// Half its height as it stands or lies, m.
    pub half_height_m: f64,
    /// Its centre above its underside, m: a bowl that hangs askew reaches down with its foot, which
    /// is narrower than its rim.
    pub depth_m: f64,
    /// How it wants to be grasped.
    pub class: GraspClass,
    /// End effector to grasp point (equation 2), m.
    pub distance_m: f64,
    /// The same, horizontally.
    pub distance_xy_m: f64,
    /// End effector above the grasp point, m.
    pub height_m: f64,
}

/// The destination as this step sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DestinationView {
    /// Centre of the region, base frame, m; its z is the surface or the rim.
    pub position_m: Vector3,
    /// Half extent of the region, m.
    pub half_extent_m: Vector3,
    /// On or in.
    pub relation: PlaceRelation,
    /// Target to region (equation 2), m: its underside to the surface.
    pub distance_m: f64,
    /// The same, horizontally.
    pub distance_xy_m: f64,
    /// The target's underside above the surface or rim, m.
    pub clearance_m: f64,
}

/// The nearest other instance that could be grasped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherView {
    /// The instance.
    pub id: ObjectId,
    /// End effector to its grasp point, m.
    pub distance_m: f64,
    /// Its centre, base frame, m.
    pub position_m: Vector3,
}

/// Everything that a policy step is judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals {
    /// Tool centre point, base frame, m.
    pub ee_m: Vector3,
    /// The gripper.
    pub gripper: GripperView,
    /// The locked target, if its pose is known.
    pub target: Option<TargetView>,
    /// The destination, if it is direct and its pose is known.
    pub destination: Option<DestinationView>,
    /// The nearest other instance.
    pub other: Option<OtherView>,
}

/// What the signals of a step depend on besides the sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory<'a> {
    pub(crate) lock: &'a Lock,
    pub(crate) gripper: GripperView,
    pub(crate) tracking: &'a Tracking,
}

impl Signals {
    pub(crate) fn new(params: &Params, sample: &StateSample, memory: &Memory<'_>) -> Self {
        let lock = memory.lock;
        let target = robot::object(sample, lock.target()).map(|object| {
            let position_m = memory
                .tracking
                .target_m(sample)
                .unwrap_or(object.position_m);
            target_view(&params.grasp, sample, object, position_m)
        });
        let destination = match (lock.anchor(), &target) {
            (Some(anchor), Some(target)) => {
                destination_view(sample, anchor, memory.tracking.anchor_m(), target)
            }
            _ => None,
        };
        let anchor = lock.anchor().map_or(0, |a| a.object);
        Self {
            ee_m: sample.ee_position_m,
            gripper: memory.gripper,
            target,
            destination,
            other: nearest_other(&params.grasp, sample, lock.target(), anchor),
        }
    }
}

fn orientation(wxyz: [f64; 4]) -> UnitQuaternion {
    UnitQuaternion::from_wxyz(wxyz).unwrap_or(UnitQuaternion::IDENTITY)
}

fn class(object: &ObjectSample) -> GraspClass {
    GraspClass::try_from(object.grasp_class).unwrap_or(GraspClass::Fixture)
}

/// The hand's pose in a sample.
pub(crate) fn hand(sample: &StateSample) -> Pose {
    Pose::new(sample.ee_position_m, orientation(sample.ee_orientation))
}

fn target_view(
    grasp: &Grasp,
    sample: &StateSample,
    object: &ObjectSample,
    position_m: Vector3,
) -> TargetView {
    let at = GraspSite {
        position_m,
        ..GraspSite::of(object)
    };
    let offset = at.offset_to(grasp, sample.ee_position_m);
    TargetView {
        id: object.id,
        position_m,
        orientation: at.orientation,
        half_extent_m: object.half_extent_m,
        half_height_m: at.half_height_m,
        depth_m: depth(&at, object.half_extent_m),
        class: at.class,
        distance_m: vector::norm(offset),
        distance_xy_m: vector::norm([offset[0], offset[1], 0.0]),
        height_m: offset[2],
    }
}

/// Height of the grasp point above the object's centre, m.
#[must_use]
pub fn grasp_height(grasp: &Grasp, class: GraspClass, half_height_m: f64) -> f64 {
    let height = match class {
        GraspClass::Bowl => half_height_m - grasp.rim_depth_m,
        _ if 2.0 * half_height_m > grasp.tall_m => half_height_m - grasp.below_top_m,
        _ => 0.0,
    };
    height.max(grasp.floor_m - half_height_m)
}

/// Radius of the circle of grasp points around the object's axis, m: a bowl is
/// grasped by its rim, everything else at its axis.
#[must_use]
pub fn grasp_radius(grasp: &Grasp, class: GraspClass, half_extent_m: Vector3) -> f64 {
    match class {
        GraspClass::Bowl => {
            let outer = half_extent_m[0].min(half_extent_m[1]);
            (outer - grasp.rim_inset_m).max(0.0)
        }
        _ => 0.0,
    }
}

/// Where an object is grasped.
#[derive(Clone, Copy, Debug)]
struct GraspSite {
    position_m: Vector3,
    class: GraspClass,
    orientation: UnitQuaternion,
    radius_xy_m: [f64; 2],
    half_height_m: f64,
}

impl GraspSite {
    fn of(object: &ObjectSample) -> Self {
        let [hx, hy, _] = object.half_extent_m;
        let orientation = orientation(object.orientation);
        Self {
            position_m: object.position_m,
            class: class(object),
            orientation,
            radius_xy_m: [hx, hy],
            half_height_m: turned_half_height(orientation, object.half_extent_m),
        }
    }

    /// From the nearest grasp point to the end effector, m.
    fn offset_to(&self, grasp: &Grasp, ee_m: Vector3) -> Vector3 {
        let [dx, dy, dz] = vector::sub(ee_m, self.position_m);
        let [hx, hy] = self.radius_xy_m;
        let radius = grasp_radius(grasp, self.class, [hx, hy, 0.0]);
        let height = dz - grasp_height(grasp, self.class, self.half_height_m);
        let xy = vector::norm([dx, dy, 0.0]);
        if radius <= 0.0 {
            [dx, dy, height]
        } else if xy > 1e-9 {
            let share = (xy - radius) / xy;
            [dx * share, dy * share, height]
        } else {
            // On the axis every rim point is equally near: any will do.
            [radius, 0.0, height]
        }
    }
}

/// Half the height of the object's bounding box as it stands or lies, m.
#[must_use]
pub fn half_height(object: &ObjectSample) -> f64 {
    turned_half_height(orientation(object.orientation), object.half_extent_m)
}

fn turned_half_height(orientation: UnitQuaternion, half_extent_m: Vector3) -> f64 {
    let [_, _, [zx, zy, zz]] = orientation.to_matrix();
    let [hx, hy, hz] = half_extent_m;
    zx.abs() * hx + zy.abs() * hy + zz.abs() * hz
}

/// An object's centre above its underside, m: a bowl stands on its foot.
fn depth(at: &GraspSite, half_extent_m: Vector3) -> f64 {
    let [hx, hy, hz] = half_extent_m;
    match at.class {
        GraspClass::Bowl => {
            turned_half_height(at.orientation, [FOOT_SHARE * hx, FOOT_SHARE * hy, hz])
        }
        _ => at.half_height_m,
    }
}

fn destination_view(
    sample: &StateSample,
    anchor: &Anchor,
    anchor_m: Option<Vector3>,
    target: &TargetView,
) -> Option<DestinationView> {
    let object = robot::object(sample, anchor.object)?;
    let frame = Pose::new(
        anchor_m.unwrap_or(object.position_m),
        orientation(object.orientation),
    );
    let position_m = frame.transform_point(anchor.offset_m);
    let [dx, dy, _] = vector::sub(target.position_m, position_m);
    let clearance_m = target.position_m[2] - target.depth_m - position_m[2];
    Some(DestinationView {
        position_m,
        half_extent_m: anchor.half_extent_m,
        relation: anchor.relation,
        distance_m: vector::norm([dx, dy, clearance_m]),
        distance_xy_m: vector::norm([dx, dy, 0.0]),
        clearance_m,
    })
}

fn nearest_other(
    grasp: &Grasp,
    sample: &StateSample,
    target: ObjectId,
    anchor: ObjectId,
) -> Option<OtherView> {
    let mut nearest: Option<OtherView> = None;
    for object in robot::objects(sample) {
        let class = class(object);
        if object.id == 0
            || object.id == target
            || object.id == anchor
            || class == GraspClass::Fixture
        {
            continue;
        }
        let offset = GraspSite::of(object).offset_to(grasp, sample.ee_position_m);
        let distance_m = vector::norm(offset);
        if nearest.is_none_or(|n| distance_m < n.distance_m) {
            nearest = Some(OtherView {
                id: object.id,
                distance_m,
                position_m: object.position_m,
            });
        }
    }
    nearest
}

#[cfg(test)]
mod tests;
