//! Geometric Jacobians: the twist of the tip for each joint velocity.

use crate::linear::Cholesky;
use crate::rotation::{Matrix3, mat_t_vec};
use crate::vector::{Vector3, add, cross};

/// A geometric Jacobian of 6 rows, linear velocity (m/s) over angular velocity (rad/s), and `N`
/// columns. The reference frame is that of the method it came from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian<const N: usize> {
    /// Column by column: the twist `[vx, vy, vz, wx, wy, wz]` for a joint velocity of 1.
    pub columns: [[f64; 6]; N],
}

impl<const N: usize> Jacobian<N> {
    /// All zeros.
    #[must_use]
    pub const fn zero() -> Self {
        Self {
            columns: [[0.0; 6]; N],
        }
    }

    /// Row by row.
    #[must_use]
    pub fn rows(&self) -> [[f64; N]; 6] {
        let mut rows = [[0.0; N]; 6];
        for (j, column) in self.columns.iter().enumerate() {
            for (row, x) in rows.iter_mut().zip(column) {
                if let Some(slot) = row.get_mut(j) {
                    *slot = *x;
                }
            }
        }
        rows
    }

    /// The twist for these joint velocities.
    #[inline]
    #[must_use]
    pub fn times(&self, velocity: &[f64; N]) -> [f64; 6] {
        let mut twist = [0.0; 6];
        for (column, rate) in self.columns.iter().zip(velocity) {
            for (sum, x) in twist.iter_mut().zip(column) {
                *sum += x * rate;
            }
        }
        twist
    }

    /// The transposed Jacobian times a wrench: joint torques (N m) or forces (N).
    #[inline]
    #[must_use]
    pub fn transpose_times(&self, wrench: &[f64; 6]) -> [f64; N] {
        let mut result = [0.0; N];
        for (slot, column) in result.iter_mut().zip(&self.columns) {
            *slot = column.iter().zip(wrench).map(|(a, b)| a * b).sum();
        }
        result
    }

    /// From base axes to the axes of the tip, whose rotation is `rotation`; the reference point
    /// stays at the tip. This is the body Jacobian.
    #[must_use]
    pub fn in_body(&self, rotation: &Matrix3) -> Self {
        self.map(|linear, angular| (mat_t_vec(rotation, linear), mat_t_vec(rotation, angular)))
    }

    /// From the reference point at the tip, which is at `position`, to that at the base's origin.
    /// This is the spatial Jacobian.
    #[must_use]
    pub fn at_base_origin(&self, position: Vector3) -> Self {
        self.map(|linear, angular| (add(linear, cross(position, angular)), angular))
    }

    fn map(&self, f: impl Fn(Vector3, Vector3) -> (Vector3, Vector3)) -> Self {
        let columns = self.columns.map(|[vx, vy, vz, wx, wy, wz]| {
            let (v, w) = f([vx, vy, vz], [wx, wy, wz]);
            [v[0], v[1], v[2], w[0], w[1], w[2]]
        });
        Self { columns }
    }

    /// `J J^T`, plus `damping` on the diagonal.
    #[must_use]
    pub(crate) fn gram(&self, damping: f64) -> [[f64; 6]; 6] {
        let mut gram = [[0.0; 6]; 6];
        for column in &self.columns {
            for (row, a) in gram.iter_mut().zip(column) {
                for (sum, b) in row.iter_mut().zip(column) {
                    *sum += a * b;
                }
            }
        }
        for (i, row) in gram.iter_mut().enumerate() {
            if let Some(diagonal) = row.get_mut(i) {
                *diagonal += damping;
            }
        }
        gram
    }

    /// Yoshikawa's manipulability `sqrt(det(J J^T))`: 0 in a singular configuration, and for
    /// fewer than six joints. Mixes metres and radians: compare only within one arm.
    #[must_use]
    pub fn manipulability(&self) -> f64 {
        Cholesky::of(&self.gram(0.0)).map_or(0.0, |c| c.root_determinant())
    }
}
