//! Whose left is left.

use serde::{Deserialize, Serialize};

use crate::scene::Scene;

/// The viewer of "left", "right", "in front of" and "behind".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Viewpoint {
    /// The scene's camera, as LIBERO's instructions mean it; without a camera,
    /// the robot.
    #[default]
    Camera,
    /// The robot: it looks along +x of the base frame, its left is +y.
    Robot,
}

/// Directions of a viewer on the table, unit vectors in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewAxes {
    /// Towards the viewer's left.
    pub left: [f64; 2],
    /// Away from the viewer.
    pub away: [f64; 2],
}

impl ViewAxes {
    /// The robot's own directions.
    pub const ROBOT: Self = Self {
        left: [0.0, 1.0],
        away: [1.0, 0.0],
    };

    /// The directions of `viewpoint` in `scene`.
    #[must_use]
    pub fn of(viewpoint: Viewpoint, scene: &Scene) -> Self {
        match (viewpoint, &scene.camera) {
            (Viewpoint::Camera, Some(camera)) => {
                // The image's x axis, laid on the table: it is never upright.
                let right = [camera.rotation[0][0], camera.rotation[1][0]];
                let length = right[0].hypot(right[1]);
                if length < 1e-3 {
                    return Self::ROBOT;
                }
                let left = [-right[0] / length, -right[1] / length];
                // Up x right = away, for a viewer that stands upright.
                Self {
                    left,
                    away: [left[1], -left[0]],
                }
            }
            _ => Self::ROBOT,
        }
    }

    /// Distance of `offset` to the left and away, m.
    #[must_use]
    pub fn components(&self, offset_m: [f64; 2]) -> (f64, f64) {
        let dot = |axis: [f64; 2]| axis[0] * offset_m[0] + axis[1] * offset_m[1];
        (dot(self.left), dot(self.away))
    }
}
