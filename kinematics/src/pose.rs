//! Rigid transforms.

use core::ops::Mul;

use crate::rotation::UnitQuaternion;
use crate::vector::{self, Vector3};

/// A rigid transform, or equally the pose of a frame in a parent frame: a point with coordinates
/// `p` in the frame has `orientation * p + position` in the parent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Origin of the frame in the parent frame, in metres.
    pub position: Vector3,
    /// Orientation of the frame in the parent frame.
    pub orientation: UnitQuaternion,
}

impl Pose {
    /// No displacement, no rotation.
    pub const IDENTITY: Self = Self {
        position: [0.0; 3],
        orientation: UnitQuaternion::IDENTITY,
    };

    /// A pose from its parts.
    #[inline]
    #[must_use]
    pub const fn new(position: Vector3, orientation: UnitQuaternion) -> Self {
        Self {
            position,
            orientation,
        }
    }

    /// A pose without rotation.
    #[inline]
    #[must_use]
    pub const fn from_position(position: Vector3) -> Self {
        Self {
            position,
            orientation: UnitQuaternion::IDENTITY,
        }
    }

    /// The inverse transform: the pose of the parent in this frame.
    #[inline]
    #[must_use]
    pub fn inverse(self) -> Self {
        let back = self.orientation.inverse();
        Self {
            position: vector::scale(back.rotate(self.position), -1.0),
            orientation: back,
        }
    }

    /// Coordinates in the parent frame of a point given in this frame.
    #[inline]
    #[must_use]
    pub fn transform_point(self, point: Vector3) -> Vector3 {
        vector::add(self.orientation.rotate(point), self.position)
    }

    /// Components in the parent frame of a direction given in this frame.
    #[inline]
    #[must_use]
    pub fn transform_vector(self, direction: Vector3) -> Vector3 {
        self.orientation.rotate(direction)
    }

    /// Pose of `other` seen from this frame, both given in the same parent: `self^-1 other`.
    #[inline]
    #[must_use]
    pub fn relative(self, other: Self) -> Self {
        self.inverse() * other
    }

    /// The same pose moved by `offset`, in metres along the parent's axes.
    #[inline]
    #[must_use]
    pub fn translated(self, offset: Vector3) -> Self {
        Self {
            position: vector::add(self.position, offset),
            ..self
        }
    }

    /// Distance of the origins in metres.
    #[inline]
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        vector::distance(self.position, other.position)
    }

    /// What leads from `self` to `target`, in the parent's axes: displacement in metres and
    /// rotation vector in radians.
    #[must_use]
    pub fn error_to(self, target: Self) -> (Vector3, Vector3) {
        let turn = target.orientation * self.orientation.inverse();
        (
            vector::sub(target.position, self.position),
            turn.to_rotation_vector(),
        )
    }

    /// True where the position is finite and the orientation a unit quaternion.
    #[must_use]
    pub fn is_valid(self) -> bool {
        vector::is_finite(self.position) && self.orientation.is_valid()
    }
}

impl Mul for Pose {
    type Output = Self;

    /// Composition: `rhs` is given in the frame of `self`, the product in the parent of `self`.
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        Self {
            position: self.transform_point(rhs.position),
            orientation: self.orientation * rhs.orientation,
        }
    }
}

#[cfg(test)]
mod tests;
