//! Serial arms of `N` joints.
//!
//! A [`Chain`] is built from the transforms between its joints and their axes, as a URDF gives
//! them. Inside, every joint turns about (or slides along) the z axis of its own frame, and what
//! lies between two joints is reduced by Euler's z-x-z angles: the two turns about z join the
//! joint angles as constant offsets, which leaves one turn about x, most often by a multiple of a
//! quarter. That is what makes the forward kinematics cheap.

pub(crate) mod forward;

pub use forward::{Frame, JointOutOfRange, LinkFrames, Solution};

use crate::elementary::{atan2, sincos, sqrt};
use crate::pose::Pose;
use crate::rotation::{IDENTITY3, Matrix3, mat_mul, mat_vec, transpose};
use crate::vector::{self, Vector3, cross, normalized};

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis; the coordinate is an angle in radians.
    Revolute,
    /// Slides along its axis; the coordinate is a length in metres.
    Prismatic,
}

/// Range of a joint, in the unit of the joint (rad or m) and seconds. Infinite where there is
/// no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Least coordinate.
    pub lower: f64,
    /// Greatest coordinate.
    pub upper: f64,
    /// Greatest speed.
    pub velocity: f64,
}

impl JointLimits {
    /// No limit at all.
    pub const NONE: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
    };

    /// The coordinate nearest to `q` within the range.
    #[inline]
    #[must_use]
    pub fn nearest(&self, q: f64) -> f64 {
        q.max(self.lower).min(self.upper)
    }

    /// The middle of the range; the coordinate of the range nearest to 0 where it is not bounded
    /// on both sides.
    #[must_use]
    pub fn middle(&self) -> f64 {
        let middle = 0.5 * (self.lower + self.upper);
        if middle.is_finite() {
            middle
        } else {
            self.nearest(0.0)
        }
    }
}

/// One joint of a chain as it is described: where it sits, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Rotation from the previous link's frame to the joint's frame.
    pub rotation: Matrix3,
    /// Origin of the joint's frame in the previous link's frame, in metres.
    pub translation: Vector3,
    /// Direction of the axis in the joint's frame; any length.
    pub axis: Vector3,
    /// How it moves.
    pub kind: JointKind,
    /// Its range.
    pub limits: JointLimits,
}

/// Why a chain cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChainError {
    /// The axis of this joint has no direction or is not finite.
    Axis {
        /// The joint, counted from 0.
        joint: usize,
    },
    /// The transform to this joint, or to the tip where `joint` is the number of joints, is not
    /// a rotation and a finite translation.
    Transform {
        /// The joint, counted from 0.
        joint: usize,
    },
    /// The limits of this joint are not an interval and a positive speed.
    Limits {
        /// The joint, counted from 0.
        joint: usize,
    },
}

impl core::fmt::Display for ChainError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Axis { joint } => write!(f, "joint {joint}: the axis has no direction"),
            Self::Transform { joint } => {
                write!(
                    f,
                    "joint {joint}: its transform is not a rotation and a translation"
                )
            }
            Self::Limits { joint } => {
                write!(
                    f,
                    "joint {joint}: lower limit above the upper one, or no positive speed"
                )
            }
        }
    }
}

impl core::error::Error for ChainError {}

/// Turn about x between two joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Twist {
    /// None.
    None,
    /// A quarter turn.
    Quarter,
    /// A quarter turn back.
    QuarterBack,
    /// A half turn.
    Half,
    /// Any other angle, by its cosine and sine.
    By(f64, f64),
}

impl Twist {
    /// Deviation of sine and cosine from 0 that is rounding of a quarter turn.
    const ROUNDING: f64 = 1e-15;

    fn new(cos: f64, sin: f64) -> Self {
        if sin.abs() < Self::ROUNDING {
            if cos > 0.0 { Self::None } else { Self::Half }
        } else if cos.abs() < Self::ROUNDING {
            if sin > 0.0 {
                Self::Quarter
            } else {
                Self::QuarterBack
            }
        } else {
            Self::By(cos, sin)
        }
    }
}

/// One joint as it is computed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stage {
    kind: JointKind,
    /// Constant part of the turn about z, in radians.
    offset: f64,
    /// From this joint to the next one, in the frame after the turn about z, in metres.
    shift: Vector3,
    /// Turn about x that follows.
    twist: Twist,
    /// Rotation from the link's frame to the frame after the turn about z.
    link: Matrix3,
}

/// A serial arm of `N` joints, from its base frame to its tip frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain<const N: usize> {
    /// Frame of the first joint, its columns, and its origin.
    base: [Vector3; 3],
    base_origin: Vector3,
    stages: [Stage; N],
    /// Cosine and sine of the last turn about z, which leads to the tip frame.
    tip_turn: (f64, f64),
    limits: [JointLimits; N],
    reach: f64,
}

impl<const N: usize> Chain<N> {
    /// Builds the chain of these joints, with the tip frame at `tip_translation` and
    /// `tip_rotation` in the frame of the last link.
    ///
    /// # Errors
    /// A [`ChainError`] names the joint that cannot be used.
    pub fn new(
        joints: &[Joint; N],
        tip_rotation: &Matrix3,
        tip_translation: Vector3,
    ) -> Result<Self, ChainError> {
        check_transform(N, tip_rotation, tip_translation)?;
        let mut chain = Self {
            base: transpose(tip_rotation),
            base_origin: tip_translation,
            stages: [Stage {
                kind: JointKind::Revolute,
                offset: 0.0,
                shift: [0.0; 3],
                twist: Twist::None,
                link: IDENTITY3,
            }; N],
            tip_turn: (1.0, 0.0),
            limits: [JointLimits::NONE; N],
            reach: vector::norm(tip_translation),
        };
        // From the tip towards the base: `rotation` and `translation` lead from the link of the
        // joint at hand to the aligned frame of what follows.
        let mut rotation = *tip_rotation;
        let mut translation = tip_translation;
        let mut turn_after = TurnAfter::Tip;
        for (index, joint) in joints.iter().enumerate().rev() {
            let axis = check_joint(index, joint)?;
            let align = aligning(axis);
            let angles = ZxzAngles::of(&mat_mul(&transpose(&align), &rotation));
            match turn_after {
                TurnAfter::Tip => chain.tip_turn = cos_sin(angles.last),
                TurnAfter::Joint(next) => {
                    if let Some(stage) = chain.stages.get_mut(next) {
                        stage.offset += angles.last;
                    }
                }
            }
            let (cos, sin) = cos_sin(-angles.first);
            let link = mat_mul(&turn_z(cos, sin), &transpose(&align));
            if let Some(stage) = chain.stages.get_mut(index) {
                *stage = Stage {
                    kind: joint.kind,
                    offset: angles.first,
                    shift: mat_vec(&link, translation),
                    twist: Twist::new(angles.cos, angles.sin),
                    link,
                };
            }
            if let Some(limits) = chain.limits.get_mut(index) {
                *limits = joint.limits;
            }
            chain.reach += vector::norm(joint.translation);
            if joint.kind == JointKind::Prismatic {
                chain.reach += joint.limits.lower.abs().max(joint.limits.upper.abs());
            }
            rotation = mat_mul(&joint.rotation, &align);
            translation = joint.translation;
            turn_after = TurnAfter::Joint(index);
        }
        chain.base = transpose(&rotation);
        chain.base_origin = translation;
        Ok(chain)
    }

    /// Limits of the joints.
    #[must_use]
    pub fn limits(&self) -> &[JointLimits; N] {
        &self.limits
    }

    /// Sum of the distances between consecutive joints and of the slides, from the base to the
    /// tip, in metres: the tip never lies farther from the base.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.reach
    }

    /// The same chain with its tip moved on by `tool`, given in the tip frame.
    ///
    /// # Errors
    /// [`ChainError::Transform`] where `tool` is not a pose.
    pub fn with_tool(&self, tool: Pose) -> Result<Self, ChainError> {
        let joint = N;
        if !tool.is_valid() {
            return Err(ChainError::Transform { joint });
        }
        let mut chain = self.clone();
        let Some(last) = chain.stages.last_mut() else {
            let turned = Pose::new(
                self.base_origin,
                crate::UnitQuaternion::from_rotation(&transpose(&self.base)),
            ) * tool;
            chain.base = transpose(&turned.orientation.to_matrix());
            chain.base_origin = turned.position;
            return Ok(chain);
        };
        // From the frame after the last turn about z to the present tip, then to the new one.
        let present = mat_mul(
            &twist_x(last.twist),
            &turn_z(self.tip_turn.0, self.tip_turn.1),
        );
        last.shift = vector::add(last.shift, mat_vec(&present, tool.position));
        let angles = ZxzAngles::of(&mat_mul(&present, &tool.orientation.to_matrix()));
        // The turn about z that now comes first joins the joint's own offset; everything given
        // in the frame after it is turned back.
        let (cos, sin) = cos_sin(-angles.first);
        let back = turn_z(cos, sin);
        last.offset += angles.first;
        last.shift = mat_vec(&back, last.shift);
        last.link = mat_mul(&back, &last.link);
        last.twist = Twist::new(angles.cos, angles.sin);
        chain.tip_turn = cos_sin(angles.last);
        chain.reach += vector::norm(tool.position);
        Ok(chain)
    }
}

/// What the turn about z before the present transform belongs to.
enum TurnAfter {
    Tip,
    Joint(usize),
}

fn check_transform(
    joint: usize,
    rotation: &Matrix3,
    translation: Vector3,
) -> Result<(), ChainError> {
    let proper = crate::UnitQuaternion::from_matrix(rotation).is_some();
    if proper && vector::is_finite(translation) {
        Ok(())
    } else {
        Err(ChainError::Transform { joint })
    }
}

fn check_joint(index: usize, joint: &Joint) -> Result<Vector3, ChainError> {
    check_transform(index, &joint.rotation, joint.translation)?;
    let JointLimits {
        lower,
        upper,
        velocity,
    } = joint.limits;
    if !(lower <= upper && velocity > 0.0) {
        return Err(ChainError::Limits { joint: index });
    }
    normalized(joint.axis).ok_or(ChainError::Axis { joint: index })
}

fn cos_sin(angle: f64) -> (f64, f64) {
    let (sin, cos) = sincos(angle);
    (cos, sin)
}

fn turn_z(cos: f64, sin: f64) -> Matrix3 {
    [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]
}

fn twist_x(twist: Twist) -> Matrix3 {
    let (cos, sin) = match twist {
        Twist::None => (1.0, 0.0),
        Twist::Quarter => (0.0, 1.0),
        Twist::QuarterBack => (0.0, -1.0),
        Twist::Half => (-1.0, 0.0),
        Twist::By(cos, sin) => (cos, sin),
    };
    [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]]
}

/// A rotation that takes z to the unit vector `axis`.
fn aligning(axis: Vector3) -> Matrix3 {
    // The coordinate axis that is farthest from `axis` gives the best conditioned x.
    let [x, y, z] = axis.map(f64::abs);
    let helper = if x <= y && x <= z {
        [1.0, 0.0, 0.0]
    } else if y <= z {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let side = normalized(cross(helper, axis)).unwrap_or([1.0, 0.0, 0.0]);
    transpose(&[side, cross(axis, side), axis])
}

/// Euler's angles: a rotation as a turn about z (`first`), about x (by `cos`, `sin`), and about z
/// (`last`).
struct ZxzAngles {
    first: f64,
    cos: f64,
    sin: f64,
    last: f64,
}

impl ZxzAngles {
    fn of(m: &Matrix3) -> Self {
        let sin = sqrt(m[0][2] * m[0][2] + m[1][2] * m[1][2]);
        // Without a turn about x only the sum of the two angles counts.
        let first = if sin > 1e-14 {
            atan2(m[0][2], -m[1][2])
        } else {
            0.0
        };
        let (c, s) = cos_sin(-first);
        let rest = mat_mul(&turn_z(c, s), m);
        let last = atan2(-rest[0][1], rest[0][0]);
        let (c, s) = cos_sin(-last);
        let twist = mat_mul(&rest, &turn_z(c, s));
        Self {
            first,
            cos: twist[2][2],
            sin: twist[2][1],
            last,
        }
    }
}

#[cfg(test)]
mod tests;
