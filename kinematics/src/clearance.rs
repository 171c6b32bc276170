//! How near a moving gripper comes to obstacles.
//!
//! The gripper is a few spheres fixed to the tip, a path a few poses joined by straight lines with
//! the orientation turning evenly. The signed distance to a convex body is a convex function, and
//! so is its course along a straight line: its least value is found by golden-section search in a
//! fixed number of steps. No allocation, and the answer is never optimistic by more than 1e-9 of
//! the path's length.

use crate::pose::Pose;
use crate::rotation::UnitQuaternion;
use crate::vector::{self, Vector3, add, dot, lerp, norm, normalized, sub};

/// A convex obstacle in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// A box.
    Box {
        /// Centre and axes.
        pose: Pose,
        /// Half of each side, in metres.
        half_extents_m: Vector3,
    },
    /// A cylinder along the z axis of its frame.
    Cylinder {
        /// Centre and axes.
        pose: Pose,
        /// Radius in metres.
        radius_m: f64,
        /// Half of its length in metres.
        half_length_m: f64,
    },
    /// A ball.
    Sphere {
        /// Centre, in metres.
        center: Vector3,
        /// Radius in metres.
        radius_m: f64,
    },
    /// Everything below a plane: a table, a floor, a wall.
    HalfSpace {
        /// A point of the plane, in metres.
        point: Vector3,
        /// Direction out of the obstacle; any length.
        normal: Vector3,
    },
}

/// A sphere of the gripper, fixed to the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Centre in the tip frame, in metres.
    pub center: Vector3,
    /// Radius in metres.
    pub radius_m: f64,
}

/// A cover of the open Franka hand in the frame of its tool centre point: both fingers at 4 cm
/// from the middle, and the hand's body of 20 by 6 cm, whose front is 4.5 cm behind the tips.
pub const PANDA_HAND: [Probe; 11] = [
    Probe {
        center: [0.0, 0.05, 0.0],
        radius_m: 0.014,
    },
    Probe {
        center: [0.0, -0.05, 0.0],
        radius_m: 0.014,
    },
    Probe {
        center: [0.0, 0.05, -0.025],
        radius_m: 0.018,
    },
    Probe {
        center: [0.0, -0.05, -0.025],
        radius_m: 0.018,
    },
    Probe {
        center: [0.0, 0.08, -0.075],
        radius_m: 0.036,
    },
    Probe {
        center: [0.0, 0.04, -0.075],
        radius_m: 0.036,
    },
    Probe {
        center: [0.0, 0.0, -0.075],
        radius_m: 0.036,
    },
    Probe {
        center: [0.0, -0.04, -0.075],
        radius_m: 0.036,
    },
    Probe {
        center: [0.0, -0.08, -0.075],
        radius_m: 0.036,
    },
    Probe {
        center: [0.0, 0.03, -0.11],
        radius_m: 0.05,
    },
    Probe {
        center: [0.0, -0.03, -0.11],
        radius_m: 0.05,
    },
];

/// The narrowest place of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Narrowest {
    /// Distance between gripper and obstacle in metres; negative by how deep they overlap.
    pub clearance_m: f64,
    /// Which sphere of the gripper, counted from 0.
    pub probe: usize,
    /// Which obstacle, counted from 0.
    pub obstacle: usize,
    /// Which part of the path, counted from 0: from pose `leg` to pose `leg + 1`.
    pub leg: usize,
    /// Where on this part, from 0 to 1.
    pub at: f64,
}

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A pose of the path is not a pose.
    Path {
        /// Which one, counted from 0.
        pose: usize,
    },
    /// A sphere of the gripper is not finite or has a negative radius.
    Probe {
        /// Which one, counted from 0.
        probe: usize,
    },
    /// An obstacle is not finite, has a negative size, or a normal without direction.
    Obstacle {
        /// Which one, counted from 0.
        obstacle: usize,
    },
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Path { pose } => write!(f, "pose {pose} of the path is not a pose"),
            Self::Probe { probe } => write!(f, "sphere {probe} of the gripper is not one"),
            Self::Obstacle { obstacle } => {
                write!(f, "obstacle {obstacle} is not finite or of negative size")
            }
        }
    }
}

impl core::error::Error for Refusal {}

fn size(x: f64) -> bool {
    x >= 0.0 && x.is_finite()
}

impl Obstacle {
    fn is_valid(&self) -> bool {
        match self {
            Self::Box {
                pose,
                half_extents_m,
            } => pose.is_valid() && half_extents_m.iter().all(|h| size(*h)),
            Self::Cylinder {
                pose,
                radius_m,
                half_length_m,
            } => pose.is_valid() && size(*radius_m) && size(*half_length_m),
            Self::Sphere { center, radius_m } => vector::is_finite(*center) && size(*radius_m),
            Self::HalfSpace { point, normal } => {
                vector::is_finite(*point) && normalized(*normal).is_some()
            }
        }
    }

    /// Signed distance of a point (base frame) to the surface in metres, negative inside. NaN for
    /// an obstacle that is not finite.
    #[must_use]
    pub fn distance_m(&self, point: Vector3) -> f64 {
        match self {
            Self::Box {
                pose,
                half_extents_m,
            } => {
                let [x, y, z] = pose.inverse().transform_point(point);
                let [hx, hy, hz] = *half_extents_m;
                let [dx, dy, dz] = [x.abs() - hx, y.abs() - hy, z.abs() - hz];
                norm([dx.max(0.0), dy.max(0.0), dz.max(0.0)]) + dx.max(dy).max(dz).min(0.0)
            }
            Self::Cylinder {
                pose,
                radius_m,
                half_length_m,
            } => {
                let [x, y, z] = pose.inverse().transform_point(point);
                let (dr, dz) = (norm([x, y, 0.0]) - radius_m, z.abs() - half_length_m);
                norm([dr.max(0.0), dz.max(0.0), 0.0]) + dr.max(dz).min(0.0)
            }
            Self::Sphere { center, radius_m } => vector::distance(point, *center) - radius_m,
            Self::HalfSpace { point: on, normal } => {
                normalized(*normal).map_or(f64::NAN, |n| dot(sub(point, *on), n))
            }
        }
    }

    /// Least signed distance of the points between `from` and `to`, and where it is, from 0 to 1.
    #[must_use]
    pub fn distance_to_segment_m(&self, from: Vector3, to: Vector3) -> (f64, f64) {
        /// The golden section.
        const SECTION: f64 = 0.618_033_988_749_894_9;
        /// Narrows the place down to 0.618^45 = 4e-10 of the segment.
        const STEPS: usize = 45;
        let at = |t: f64| self.distance_m(lerp(from, to, t));
        let (mut low, mut high) = (0.0, 1.0);
        let (mut a, mut b) = (1.0 - SECTION, SECTION);
        let (mut at_a, mut at_b) = (at(a), at(b));
        for _ in 0..STEPS {
            if at_a < at_b {
                high = b;
                (b, at_b) = (a, at_a);
                a = high - SECTION * (high - low);
                at_a = at(a);
            } else {
                low = a;
                (a, at_a) = (b, at_b);
                b = low + SECTION * (high - low);
                at_b = at(b);
            }
        }
        // Including the ends: there the least value often is.
        let candidates = [(at(0.0), 0.0), (at(1.0), 1.0), (at_a, a), (at_b, b)];
        candidates
            .into_iter()
            .fold((f64::INFINITY, 0.0), |best, here| {
                if here.0 < best.0 { here } else { best }
            })
    }
}

/// Largest turn in radians that one straight piece stands for: beyond, a leg is split.
const TURN_PER_PIECE_RAD: f64 = 0.1;

/// The narrowest place between a gripper and obstacles on a path: hover, transport, retreat.
/// `None` where there is nothing to meet: no obstacle, no sphere, or an empty path. A path of one
/// pose stands still.
///
/// Where the orientation turns on the way, the spheres move on arcs; what these bulge out of
/// their chords is subtracted, at most 0.2 mm for the Panda's hand.
///
/// # Errors
/// [`Refusal`] names what cannot be computed with.
pub fn narrowest(
    gripper: &[Probe],
    path: &[Pose],
    obstacles: &[Obstacle],
) -> Result<Option<Narrowest>, Refusal> {
    let valid = |probe: &Probe| vector::is_finite(probe.center) && size(probe.radius_m);
    if let Some(probe) = gripper.iter().position(|p| !valid(p)) {
        return Err(Refusal::Probe { probe });
    }
    if let Some(pose) = path.iter().position(|p| !p.is_valid()) {
        return Err(Refusal::Path { pose });
    }
    if let Some(obstacle) = obstacles.iter().position(|o| !o.is_valid()) {
        return Err(Refusal::Obstacle { obstacle });
    }
    let mut best: Option<Narrowest> = None;
    let ends = path
        .iter()
        .skip(1)
        .chain(path.first().filter(|_| path.len() == 1));
    for (leg, (from, to)) in path.iter().zip(ends).enumerate() {
        for (probe, sphere) in gripper.iter().enumerate() {
            for (obstacle, body) in obstacles.iter().enumerate() {
                let (clearance_m, at) = leg_clearance(sphere, *from, *to, body);
                if best.is_none_or(|b| clearance_m < b.clearance_m) {
                    best = Some(Narrowest {
                        clearance_m,
                        probe,
                        obstacle,
                        leg,
                        at,
                    });
                }
            }
        }
    }
    Ok(best)
}

/// Clearance of one sphere on one leg of the path, and where on the leg it is least.
fn leg_clearance(sphere: &Probe, from: Pose, to: Pose, body: &Obstacle) -> (f64, f64) {
    let turn = (from.orientation.inverse() * to.orientation).to_rotation_vector();
    let angle = norm(turn);
    let pieces = libm::ceil(angle / TURN_PER_PIECE_RAD).clamp(1.0, 32.0);
    let center = |t: f64| {
        let partly = UnitQuaternion::from_rotation_vector(vector::scale(turn, t));
        let arm = (from.orientation * partly).rotate(sphere.center);
        add(lerp(from.position, to.position, t), arm)
    };
    // An arc of a small angle leaves its chord by at most r angle^2 / 8.
    let per_piece = angle / pieces;
    let bulge = norm(sphere.center) * per_piece * per_piece / 8.0;
    let mut best = (f64::INFINITY, 0.0);
    let mut start = center(0.0);
    for piece in 0..32_u8 {
        let piece = f64::from(piece);
        if piece >= pieces {
            break;
        }
        let end = center((piece + 1.0) / pieces);
        let (distance, t) = body.distance_to_segment_m(start, end);
        if distance < best.0 {
            best = (distance, (piece + t) / pieces);
        }
        start = end;
    }
    (best.0 - sphere.radius_m - bulge, best.1)
}

#[cfg(test)]
mod tests;
