//! Forward kinematics and Jacobian in one pass.

use super::{Chain, JointKind, Twist};
use crate::elementary::{SHORT_REDUCTION_MAX, sincos_each_short};
use crate::jacobian::Jacobian;
use crate::pose::Pose;
use crate::rotation::{Matrix3, UnitQuaternion, mat_mul, transpose};
use crate::vector::{Vector3, add, cross, scale, sub};

/// A frame in base coordinates, by its rotation matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Row-major rotation: its columns are the frame's axes in the base frame.
    pub rotation: Matrix3,
    /// Origin in the base frame, in metres.
    pub position: Vector3,
}

impl Frame {
    /// The same frame with a quaternion.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.position, UnitQuaternion::from_rotation(&self.rotation))
    }
}

/// The frame of the tip and its Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<const N: usize> {
    /// The tip in base coordinates.
    pub tip: Frame,
    /// Twist of the tip for each joint velocity: base axes, reference point at the tip.
    pub jacobian: Jacobian<N>,
}

/// Frames of all links in base coordinates, from the first moved link to the last.
pub type LinkFrames<const N: usize> = [Frame; N];

/// A joint coordinate that is not finite, or of a magnitude beyond 1e6 (rad or m).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointOutOfRange {
    /// The joint, counted from 0.
    pub joint: usize,
}

impl core::fmt::Display for JointOutOfRange {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "joint {}: the coordinate is not finite or beyond 1e6",
            self.joint
        )
    }
}

impl core::error::Error for JointOutOfRange {}

/// Checks that the coordinates can be computed with.
///
/// # Errors
/// Names the first joint whose coordinate is not finite or beyond 1e6.
#[inline(always)]
pub(crate) fn check<const N: usize>(q: &[f64; N]) -> Result<(), JointOutOfRange> {
    // One branch for all: the loop has none.
    let usable = q
        .iter()
        .fold(true, |ok, x| ok & (x.abs() <= SHORT_REDUCTION_MAX));
    if usable {
        return Ok(());
    }
    // Greater, or not comparable at all.
    let joint = q
        .iter()
        .take_while(|x| x.abs() <= SHORT_REDUCTION_MAX)
        .count();
    Err(JointOutOfRange { joint })
}

/// The moving frame: the columns of its rotation, and its origin.
#[derive(Clone, Copy)]
pub(crate) struct Moving {
    pub(crate) x: Vector3,
    pub(crate) y: Vector3,
    pub(crate) z: Vector3,
    pub(crate) p: Vector3,
}

impl Moving {
    /// Turns about its own z axis.
    #[inline(always)]
    pub(crate) fn turn_z(&mut self, cos: f64, sin: f64) {
        let (x, y) = (self.x, self.y);
        self.x = add(scale(x, cos), scale(y, sin));
        self.y = sub(scale(y, cos), scale(x, sin));
    }

    /// Turns about its own x axis.
    #[inline(always)]
    pub(crate) fn twist(&mut self, twist: Twist) {
        let (y, z) = (self.y, self.z);
        match twist {
            Twist::None => {}
            Twist::Quarter => (self.y, self.z) = (z, scale(y, -1.0)),
            Twist::QuarterBack => (self.y, self.z) = (scale(z, -1.0), y),
            Twist::Half => (self.y, self.z) = (scale(y, -1.0), scale(z, -1.0)),
            Twist::By(cos, sin) => {
                self.y = add(scale(y, cos), scale(z, sin));
                self.z = sub(scale(z, cos), scale(y, sin));
            }
        }
    }

    /// Moves along its own x axis.
    #[inline(always)]
    pub(crate) fn shift_x(&mut self, by: f64) {
        self.p = add(self.p, scale(self.x, by));
    }

    /// Moves along its own y axis.
    #[inline(always)]
    pub(crate) fn shift_y(&mut self, by: f64) {
        self.p = add(self.p, scale(self.y, by));
    }

    /// Moves by a vector given in the frame.
    #[inline(always)]
    pub(crate) fn shift(&mut self, by: Vector3) {
        let moved = add(
            add(scale(self.x, by[0]), scale(self.y, by[1])),
            scale(self.z, by[2]),
        );
        self.p = add(self.p, moved);
    }

    #[inline(always)]
    pub(crate) fn frame(&self) -> Frame {
        Frame {
            rotation: transpose(&[self.x, self.y, self.z]),
            position: self.p,
        }
    }
}

impl<const N: usize> Chain<N> {
    /// Runs along the chain; `visit` sees each joint's index, its axis and origin before the
    /// joint moves, and the frame after the turn about z.
    #[inline(always)]
    fn walk(&self, q: &[f64; N], mut visit: impl FnMut(usize, Vector3, &Moving)) -> Moving {
        let mut angles = [0.0; N];
        for ((angle, stage), q) in angles.iter_mut().zip(&self.stages).zip(q) {
            *angle = stage.offset
                + if stage.kind == JointKind::Revolute {
                    *q
                } else {
                    0.0
                };
        }
        let (sines, cosines) = sincos_each_short(&angles);
        let [x, y, z] = self.base;
        let mut frame = Moving {
            x,
            y,
            z,
            p: self.base_origin,
        };
        let turns = sines.iter().zip(&cosines).zip(q);
        for (index, (stage, ((sin, cos), q))) in self.stages.iter().zip(turns).enumerate() {
            let origin = frame.p;
            if stage.kind == JointKind::Prismatic {
                frame.p = add(frame.p, scale(frame.z, *q));
            }
            frame.turn_z(*cos, *sin);
            visit(index, origin, &frame);
            frame.shift(stage.shift);
            frame.twist(stage.twist);
        }
        frame.turn_z(self.tip_turn.0, self.tip_turn.1);
        frame
    }

    /// The frame of the tip.
    ///
    /// # Errors
    /// [`JointOutOfRange`] where a coordinate is not finite or beyond 1e6. Joint limits are not
    /// looked at: a configuration outside them has its frame too.
    pub fn tip(&self, q: &[f64; N]) -> Result<Frame, JointOutOfRange> {
        check(q)?;
        Ok(self.walk(q, |_, _, _| {}).frame())
    }

    /// The frames of all links: link `i` is what joint `i` moves, and its frame that of the joint,
    /// as in a URDF.
    ///
    /// # Errors
    /// As for [`Chain::tip`].
    pub fn links(&self, q: &[f64; N]) -> Result<LinkFrames<N>, JointOutOfRange> {
        check(q)?;
        let start = Frame {
            rotation: [[0.0; 3]; 3],
            position: [0.0; 3],
        };
        let mut frames = [start; N];
        self.walk(q, |index, _, after| {
            if let (Some(frame), Some(stage)) = (frames.get_mut(index), self.stages.get(index)) {
                let Frame { rotation, position } = after.frame();
                *frame = Frame {
                    rotation: mat_mul(&rotation, &stage.link),
                    position,
                };
            }
        });
        Ok(frames)
    }

    /// The frame of the tip and its Jacobian.
    ///
    /// # Errors
    /// As for [`Chain::tip`].
    #[inline]
    pub fn solve(&self, q: &[f64; N]) -> Result<Solution<N>, JointOutOfRange> {
        check(q)?;
        let mut jacobian = Jacobian::zero();
        // Origin and axis first; the tip, and with it the velocity, is known only at the end.
        let tip = self.walk(q, |index, [x, y, z], after| {
            if let Some(column) = jacobian.columns.get_mut(index) {
                *column = [x, y, z, after.z[0], after.z[1], after.z[2]];
            }
        });
        for (column, stage) in jacobian.columns.iter_mut().zip(&self.stages) {
            let [x, y, z, wx, wy, wz] = *column;
            *column = match stage.kind {
                JointKind::Revolute => {
                    let [vx, vy, vz] = cross([wx, wy, wz], sub(tip.p, [x, y, z]));
                    [vx, vy, vz, wx, wy, wz]
                }
                JointKind::Prismatic => [wx, wy, wz, 0.0, 0.0, 0.0],
            };
        }
        Ok(Solution {
            tip: tip.frame(),
            jacobian,
        })
    }

    /// The acceleration of the tip at joint velocity `velocity` and no joint acceleration, the
    /// Jacobian's time derivative times the velocity: linear in m/s^2, then angular in rad/s^2,
    /// in base axes, of the point at the tip's origin.
    ///
    /// # Errors
    /// As for [`Chain::tip`]; a velocity that is not finite or beyond 1e6 is named alike.
    pub fn jacobian_dot_velocity(
        &self,
        q: &[f64; N],
        velocity: &[f64; N],
    ) -> Result<[f64; 6], JointOutOfRange> {
        check(q)?;
        check(velocity)?;
        // Velocity and acceleration of the frame, and of the point where its origin was last.
        let mut w = [0.0; 3];
        let mut dw = [0.0; 3];
        let mut a = [0.0; 3];
        let mut at = self.base_origin;
        let carry = |a: Vector3, w: Vector3, dw: Vector3, arm: Vector3| {
            add(a, add(cross(dw, arm), cross(w, cross(w, arm))))
        };
        let tip = self.walk(q, |index, origin, after| {
            let (Some(stage), Some(rate)) = (self.stages.get(index), velocity.get(index)) else {
                return;
            };
            a = carry(a, w, dw, sub(origin, at));
            at = origin;
            let motion = scale(after.z, *rate);
            match stage.kind {
                JointKind::Revolute => {
                    dw = add(dw, cross(w, motion));
                    w = add(w, motion);
                }
                // The slide turns with the frame: Coriolis.
                JointKind::Prismatic => a = add(a, scale(cross(w, motion), 2.0)),
            }
        });
        a = carry(a, w, dw, sub(tip.p, at));
        Ok([a[0], a[1], a[2], dw[0], dw[1], dw[2]])
    }
}
