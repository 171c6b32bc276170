//! Poses in the robot's base frame.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Position and orientation in the robot's base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position, m.
    pub position_m: [f64; 3],
    /// Orientation, unit quaternion (w, x, y, z).
    pub orientation: [f64; 4],
}

impl Pose {
    /// No translation, no rotation.
    pub const IDENTITY: Self = Self {
        position_m: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
    };

    /// A pose that is turned by `yaw_rad` about the vertical.
    #[must_use]
    pub fn upright(position_m: [f64; 3], yaw_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(0.5 * yaw_rad);
        Self {
            position_m,
            orientation: [cos, 0.0, 0.0, sin],
        }
    }

    /// The same as nalgebra's type.
    #[must_use]
    pub fn isometry(&self) -> Isometry3<f64> {
        let [x, y, z] = self.position_m;
        let [w, i, j, k] = self.orientation;
        Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)),
        )
    }

    /// From nalgebra's type.
    #[must_use]
    pub fn from_isometry(iso: &Isometry3<f64>) -> Self {
        let (t, q) = (iso.translation.vector, iso.rotation);
        Self {
            position_m: [t.x, t.y, t.z],
            orientation: [q.w, q.i, q.j, q.k],
        }
    }

    /// Extents along the base axes, m, of a box of these half extents with this orientation.
    #[must_use]
    pub fn extent_m(&self, half_extent_m: [f64; 3]) -> [f64; 3] {
        let turn = self.isometry().rotation.to_rotation_matrix();
        let along = |row: usize| (0..3).map(move |k| turn[(row, k)].abs() * half_extent_m[k]);
        std::array::from_fn(|row| 2.0 * along(row).sum::<f64>())
    }

    /// Cosine of the angle between this pose's z axis and the vertical: 1 is upright.
    #[must_use]
    pub fn uprightness(&self) -> f64 {
        let [_, x, y, _] = self.orientation;
        1.0 - 2.0 * (x * x + y * y)
    }
}

/// Euclidean distance, m.
#[must_use]
pub fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::sqrt((0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum())
}

/// Distance in the horizontal plane, m.
#[must_use]
pub fn distance_xy_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}
