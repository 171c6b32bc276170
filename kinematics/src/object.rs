//! Where objects are: from camera frames to the base, and carried in the hand.
//!
//! Every pose is an [`Observed`]: it keeps the time and the joint state's time that it belongs to
//! and how far it is to be trusted. Covariances are carried along by the usual first-order rules.

use crate::pose::Pose;
use crate::rotation::{Matrix3, mat_mul, transpose};
use crate::vector::Vector3;

/// How far a pose is to be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// Covariance of the position in m^2, row-major, in the axes of the frame that the pose is
    /// given in.
    pub position_covariance: Matrix3,
    /// Variance of the orientation in rad^2, the same about every axis.
    pub rotation_variance: f64,
    /// Probability in [0, 1] that this is the object it is taken for.
    pub confidence: f64,
}

impl Trust {
    /// The same standard deviation in all directions: `position_m` metres and `rotation_rad`
    /// radians.
    #[must_use]
    pub fn isotropic(position_m: f64, rotation_rad: f64, confidence: f64) -> Self {
        let v = position_m * position_m;
        Self {
            position_covariance: [[v, 0.0, 0.0], [0.0, v, 0.0], [0.0, 0.0, v]],
            rotation_variance: rotation_rad * rotation_rad,
            confidence,
        }
    }

    /// Largest variance of the position along a coordinate axis, in m^2.
    #[must_use]
    pub fn largest_position_variance(&self) -> f64 {
        let [a, b, c] = self.position_covariance;
        a[0].max(b[1]).max(c[2])
    }

    /// The trust in `outer * inner`, where this is the trust in `inner` and `of_outer` that in
    /// `outer`, which has `lever` (the position of `inner`, rotated) as lever of its rotation.
    fn carried_by(&self, outer: Pose, of_outer: &Self, lever: Vector3) -> Self {
        let turn = outer.orientation.to_matrix();
        let turned = mat_mul(
            &mat_mul(&turn, &self.position_covariance),
            &transpose(&turn),
        );
        // A turn of the outer frame moves the inner origin across the lever: [l]x [l]x^T.
        let [x, y, z] = lever;
        let swing = [
            [y * y + z * z, -x * y, -x * z],
            [-x * y, x * x + z * z, -y * z],
            [-x * z, -y * z, x * x + y * y],
        ];
        let mut position_covariance = turned;
        let extra = of_outer
            .position_covariance
            .iter()
            .flatten()
            .zip(swing.iter().flatten());
        for (sum, (outer, swing)) in position_covariance.iter_mut().flatten().zip(extra) {
            *sum += outer + of_outer.rotation_variance * swing;
        }
        Self {
            position_covariance,
            rotation_variance: self.rotation_variance + of_outer.rotation_variance,
            confidence: self.confidence * of_outer.confidence,
        }
    }

    fn is_valid(&self) -> bool {
        let variance = |x: f64| x >= 0.0 && x.is_finite();
        let [a, b, c] = self.position_covariance;
        self.position_covariance
            .iter()
            .flatten()
            .all(|x| x.is_finite())
            && [a[0], b[1], c[2], self.rotation_variance]
                .into_iter()
                .all(variance)
            && (0.0..=1.0).contains(&self.confidence)
    }
}

/// A pose, when it held, and how far it is to be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// The pose; its frame stands at the place of use.
    pub pose: Pose,
    /// When it held, in seconds of the caller's clock: the exposure of the picture.
    pub time_s: f64,
    /// How far it is to be trusted.
    pub trust: Trust,
}

/// Why a pose cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseRefusal {
    /// A number is not finite, the quaternion not of length 1, or a variance or confidence out of
    /// range.
    NotAPose,
    /// The joint state lies farther from the picture in time than is allowed: interpolate the
    /// joint states, or take a nearer one.
    JointStateApart,
}

impl core::fmt::Display for PoseRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotAPose => write!(f, "not a pose: not finite, or variance out of range"),
            Self::JointStateApart => write!(f, "the joint state is not of the picture's time"),
        }
    }
}

impl core::error::Error for PoseRefusal {}

impl Observed {
    fn check(&self) -> Result<(), PoseRefusal> {
        if self.pose.is_valid() && self.trust.is_valid() && self.time_s.is_finite() {
            Ok(())
        } else {
            Err(PoseRefusal::NotAPose)
        }
    }
}

/// Where a camera is mounted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// Fixed in the world.
    Fixed {
        /// Optical frame (z forward, x right, y down) in the base frame.
        base_from_camera: Pose,
        /// Trust in this calibration.
        trust: Trust,
    },
    /// On the hand.
    Wrist {
        /// Optical frame in the tip frame.
        tip_from_camera: Pose,
        /// Trust in this calibration.
        trust: Trust,
    },
}

/// The pose of the tip at a time, by forward kinematics of the joint state of that time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipAt {
    /// Tip frame in the base frame.
    pub base_from_tip: Pose,
    /// Time of the joint state, in seconds of the clock of [`Observed::time_s`].
    pub time_s: f64,
}

impl Camera {
    /// An object that this camera sees, in the base frame. For a wrist camera `tip` has to be of
    /// the time of the picture, within `apart_max_s`: at 0.5 m/s, 20 ms are a centimetre.
    ///
    /// # Errors
    /// [`PoseRefusal`], where a pose is not one or the joint state is of another time.
    pub fn to_base(
        &self,
        seen: &Observed,
        tip: &TipAt,
        apart_max_s: f64,
    ) -> Result<Observed, PoseRefusal> {
        seen.check()?;
        let (base_from_camera, trust) = match self {
            Self::Fixed {
                base_from_camera,
                trust,
            } => (*base_from_camera, trust),
            Self::Wrist {
                tip_from_camera,
                trust,
            } => {
                let near = (seen.time_s - tip.time_s).abs() <= apart_max_s;
                if !near {
                    return Err(PoseRefusal::JointStateApart);
                }
                (tip.base_from_tip * *tip_from_camera, trust)
            }
        };
        let pose = base_from_camera * seen.pose;
        let lever = base_from_camera.transform_vector(seen.pose.position);
        // The calibration's covariance counts along the axes of the base: that of a wrist camera
        // turns with the tip.
        let outer = match self {
            Self::Fixed { .. } => *trust,
            Self::Wrist { .. } => Trust {
                position_covariance: turned(&trust.position_covariance, tip.base_from_tip),
                ..*trust
            },
        };
        let trust = seen.trust.carried_by(base_from_camera, &outer, lever);
        let result = Observed {
            pose,
            time_s: seen.time_s,
            trust,
        };
        result.check()?;
        Ok(result)
    }
}

fn turned(covariance: &Matrix3, by: Pose) -> Matrix3 {
    let turn = by.orientation.to_matrix();
    mat_mul(&mat_mul(&turn, covariance), &transpose(&turn))
}

/// An object in the closed hand: fixed to the tip since the grasp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    tip_from_object: Pose,
    trust: Trust,
    grasped_s: f64,
}

/// What a sighting says about a carried object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grip {
    /// It is where the hand should have it.
    Held,
    /// It has moved in the hand.
    Slipped {
        /// By how much in metres.
        by_m: f64,
        /// By what angle in radians.
        by_rad: f64,
    },
    /// It is so far from the hand that it is not in it any more.
    Lost {
        /// How far from its place, in metres.
        by_m: f64,
    },
}

/// From when on a difference is a slip, and from when on a loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipThresholds {
    /// Distance in metres that counts as a slip even of a perfectly known object. Default 0.01.
    pub slip_m: f64,
    /// Angle in radians that counts as a slip. Default 0.2.
    pub slip_rad: f64,
    /// Distance in metres from which on the object is lost: half the hand's opening and more.
    /// Default 0.08.
    pub lost_m: f64,
    /// Standard deviations of the sighting that a slip must exceed as well. Default 3.
    pub deviations: f64,
}

impl Default for SlipThresholds {
    fn default() -> Self {
        Self {
            slip_m: 0.01,
            slip_rad: 0.2,
            lost_m: 0.08,
            deviations: 3.0,
        }
    }
}

impl Carried {
    /// Attaches the object, seen at `object` (in the base frame), to the tip, which the joint
    /// state of the grasp puts at `tip`.
    ///
    /// # Errors
    /// [`PoseRefusal::NotAPose`] where one of the two is not a pose.
    pub fn grasp(object: &Observed, tip: &TipAt) -> Result<Self, PoseRefusal> {
        object.check()?;
        if !(tip.base_from_tip.is_valid() && tip.time_s.is_finite()) {
            return Err(PoseRefusal::NotAPose);
        }
        let back = tip.base_from_tip.inverse();
        let trust = Trust {
            position_covariance: turned(&object.trust.position_covariance, back),
            ..object.trust
        };
        Ok(Self {
            tip_from_object: back * object.pose,
            trust,
            grasped_s: tip.time_s,
        })
    }

    /// The object in the tip frame.
    #[must_use]
    pub fn tip_from_object(&self) -> Pose {
        self.tip_from_object
    }

    /// When it was grasped, in seconds.
    #[must_use]
    pub fn grasped_s(&self) -> f64 {
        self.grasped_s
    }

    /// Where the object is in the base frame, unseen, with the tip at `tip`.
    ///
    /// # Errors
    /// [`PoseRefusal::NotAPose`] where `tip` is not a pose.
    pub fn at(&self, tip: &TipAt) -> Result<Observed, PoseRefusal> {
        if !(tip.base_from_tip.is_valid() && tip.time_s.is_finite()) {
            return Err(PoseRefusal::NotAPose);
        }
        let trust = Trust {
            position_covariance: turned(&self.trust.position_covariance, tip.base_from_tip),
            ..self.trust
        };
        Ok(Observed {
            pose: tip.base_from_tip * self.tip_from_object,
            time_s: tip.time_s,
            trust,
        })
    }

    /// Compares a sighting of the object (in the base frame) with where the hand has it.
    ///
    /// # Errors
    /// [`PoseRefusal::NotAPose`] where the sighting or `tip` is not a pose.
    pub fn check(
        &self,
        sighting: &Observed,
        tip: &TipAt,
        thresholds: &SlipThresholds,
    ) -> Result<Grip, PoseRefusal> {
        sighting.check()?;
        let expected = self.at(tip)?;
        let by_m = expected.pose.distance(sighting.pose);
        let by_rad = expected
            .pose
            .orientation
            .angle_to(sighting.pose.orientation);
        let spread = |variance: f64| thresholds.deviations * crate::elementary::sqrt_pos(variance);
        // Compared with what the sighting itself may be wrong by. What was uncertain at the grasp
        // counts too: the attachment inherits it.
        let position =
            sighting.trust.largest_position_variance() + expected.trust.largest_position_variance();
        let rotation = sighting.trust.rotation_variance + expected.trust.rotation_variance;
        if by_m > thresholds.lost_m.max(spread(position)) {
            Ok(Grip::Lost { by_m })
        } else if by_m > thresholds.slip_m.max(spread(position))
            || by_rad > thresholds.slip_rad.max(spread(rotation))
        {
            Ok(Grip::Slipped { by_m, by_rad })
        } else {
            Ok(Grip::Held)
        }
    }

    /// The attachment corrected by a sighting, after a slip that the hand survived.
    ///
    /// # Errors
    /// As for [`Carried::grasp`].
    pub fn corrected(&self, sighting: &Observed, tip: &TipAt) -> Result<Self, PoseRefusal> {
        let fresh = Self::grasp(sighting, tip)?;
        Ok(Self {
            grasped_s: self.grasped_s,
            ..fresh
        })
    }
}

#[cfg(test)]
mod tests;
