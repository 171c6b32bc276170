//! Rotations: unit quaternions (w, x, y, z), Hamilton's product, and row-major matrices.

use core::ops::Mul;

use crate::elementary::{acos_clamped, atan2, sincos, sqrt, sqrt_pos};
use crate::vector::{Vector3, add, cross, dot, norm, normalized, scale};

/// A rotation matrix or any other 3 by 3 matrix, row-major.
pub type Matrix3 = [[f64; 3]; 3];

/// The identity matrix.
pub const IDENTITY3: Matrix3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Matrix times vector.
#[inline]
#[must_use]
pub fn mat_vec(m: &Matrix3, v: Vector3) -> Vector3 {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

/// Transposed matrix times vector.
#[inline]
#[must_use]
pub fn mat_t_vec(m: &Matrix3, v: Vector3) -> Vector3 {
    add(add(scale(m[0], v[0]), scale(m[1], v[1])), scale(m[2], v[2]))
}

/// Matrix product `a b`.
#[inline]
#[must_use]
pub fn mat_mul(a: &Matrix3, b: &Matrix3) -> Matrix3 {
    let row = |r: Vector3| add(add(scale(b[0], r[0]), scale(b[1], r[1])), scale(b[2], r[2]));
    [row(a[0]), row(a[1]), row(a[2])]
}

/// Transposed matrix; the inverse of a rotation.
#[inline]
#[must_use]
pub fn transpose(m: &Matrix3) -> Matrix3 {
    [
        [m[0][0], m[1][0], m[2][0]],
        [m[0][1], m[1][1], m[2][1]],
        [m[0][2], m[1][2], m[2][2]],
    ]
}

/// The rotation matrix of roll, pitch and yaw in radians about the fixed axes x, y, z in this
/// order (the URDF convention).
#[must_use]
pub fn matrix_from_rpy(roll_rad: f64, pitch_rad: f64, yaw_rad: f64) -> Matrix3 {
    let (sr, cr) = sincos(roll_rad);
    let (sp, cp) = sincos(pitch_rad);
    let (sy, cy) = sincos(yaw_rad);
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

/// A rotation as a unit quaternion. `q` and `-q` are the same rotation and compare as different;
/// [`UnitQuaternion::angle_to`] compares rotations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitQuaternion {
    /// w, x, y, z; of length 1 within rounding.
    wxyz: [f64; 4],
}

impl Default for UnitQuaternion {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl UnitQuaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self {
        wxyz: [1.0, 0.0, 0.0, 0.0],
    };
    /// Half a turn about x: a tool that points along base z, seen from above, points down.
    pub const HALF_TURN_X: Self = Self {
        wxyz: [0.0, 1.0, 0.0, 0.0],
    };

    /// The rotation of the quaternion `[w, x, y, z]`, which is scaled to length 1. `None` where
    /// it is not finite or shorter than 1e-6: then it carries no direction worth trusting.
    #[must_use]
    pub fn from_wxyz(wxyz: [f64; 4]) -> Option<Self> {
        let [w, x, y, z] = wxyz;
        let length = sqrt(w * w + x * x + y * y + z * z);
        if !(length > 1e-6 && length.is_finite()) {
            return None;
        }
        let k = 1.0 / length;
        Some(Self {
            wxyz: [w * k, x * k, y * k, z * k],
        })
    }

    /// Components `[w, x, y, z]`.
    #[inline]
    #[must_use]
    pub fn wxyz(self) -> [f64; 4] {
        self.wxyz
    }

    /// Rotation by `angle_rad` about `axis` (any length); `None` where the axis has no direction
    /// or the angle is not finite.
    #[must_use]
    pub fn from_axis_angle(axis: Vector3, angle_rad: f64) -> Option<Self> {
        let n = normalized(axis)?;
        let (s, c) = sincos(0.5 * angle_rad);
        Self::from_wxyz([c, s * n[0], s * n[1], s * n[2]])
    }

    /// Rotation by the vector `axis * angle`, in radians: the exponential map. A vector that is
    /// not finite gives the identity.
    #[must_use]
    pub fn from_rotation_vector(v: Vector3) -> Self {
        let angle = norm(v);
        let (s, c) = sincos(0.5 * angle);
        // sin(x/2)/x near 0: 1/2 - x^2/48.
        let k = if angle < 1e-4 {
            0.5 - angle * angle / 48.0
        } else {
            s / angle
        };
        Self::from_wxyz([c, k * v[0], k * v[1], k * v[2]]).unwrap_or(Self::IDENTITY)
    }

    /// `axis * angle` in radians with the angle in [0, pi]: the logarithm.
    #[must_use]
    pub fn to_rotation_vector(self) -> Vector3 {
        let [w, x, y, z] = self.wxyz;
        let s = norm([x, y, z]);
        let sign = if w < 0.0 { -1.0 } else { 1.0 };
        let k = if s < 1e-8 {
            2.0 * sign
        } else {
            2.0 * atan2(s, w.abs()) * sign / s
        };
        [k * x, k * y, k * z]
    }

    /// Rotation from roll, pitch and yaw in radians about the fixed axes x, y, z in this order
    /// (the URDF convention).
    #[must_use]
    pub fn from_rpy(roll_rad: f64, pitch_rad: f64, yaw_rad: f64) -> Self {
        let (sr, cr) = sincos(0.5 * roll_rad);
        let (sp, cp) = sincos(0.5 * pitch_rad);
        let (sy, cy) = sincos(0.5 * yaw_rad);
        Self::from_wxyz([
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ])
        .unwrap_or(Self::IDENTITY)
    }

    /// Rotation by `angle_rad` about z.
    #[must_use]
    pub fn from_yaw(angle_rad: f64) -> Self {
        let (s, c) = sincos(0.5 * angle_rad);
        Self::from_wxyz([c, 0.0, 0.0, s]).unwrap_or(Self::IDENTITY)
    }

    /// Angle about z, in (-pi, pi], of the heading of this rotation's x axis.
    #[must_use]
    pub fn yaw(self) -> f64 {
        let x = self.rotate([1.0, 0.0, 0.0]);
        atan2(x[1], x[0])
    }

    /// The rotation of a row-major matrix. `None` where the matrix is not a rotation: a product
    /// with its transpose that is off the identity by more than 1e-6, or determinant -1.
    #[must_use]
    pub fn from_matrix(m: &Matrix3) -> Option<Self> {
        let gram = mat_mul(m, &transpose(m));
        let mut pairs = gram.iter().flatten().zip(IDENTITY3.iter().flatten());
        let determinant = dot(m[0], cross(m[1], m[2]));
        if !pairs.all(|(g, i)| (g - i).abs() < 1e-6) || determinant < 0.0 {
            return None;
        }
        Some(Self::from_rotation(m))
    }

    /// The quaternion of a rotation matrix without the check of [`Self::from_matrix`]: for
    /// matrices that are rotations by construction.
    #[must_use]
    pub(crate) fn from_rotation(m: &Matrix3) -> Self {
        Self::from_wxyz(Self::largest_component_first(m)).unwrap_or(Self::IDENTITY)
    }

    /// Shepperd's method: divide by the largest component, so that nothing cancels.
    fn largest_component_first(m: &Matrix3) -> [f64; 4] {
        let (xx, yy, zz) = (m[0][0], m[1][1], m[2][2]);
        let w4 = 1.0 + xx + yy + zz;
        let x4 = 1.0 + xx - yy - zz;
        let y4 = 1.0 - xx + yy - zz;
        let z4 = 1.0 - xx - yy + zz;
        let (wx, wy, wz) = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]);
        let (xy, xz, yz) = (m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]);
        let largest = w4.max(x4).max(y4).max(z4);
        // Each row is the quaternion scaled by four times its largest component.
        if w4 == largest {
            [w4, wx, wy, wz]
        } else if x4 == largest {
            [wx, x4, xy, xz]
        } else if y4 == largest {
            [wy, xy, y4, yz]
        } else {
            [wz, xz, yz, z4]
        }
    }

    /// Row-major rotation matrix.
    #[inline]
    #[must_use]
    pub fn to_matrix(self) -> Matrix3 {
        let [w, x, y, z] = self.wxyz;
        [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ]
    }

    /// The rotated vector.
    #[inline]
    #[must_use]
    pub fn rotate(self, v: Vector3) -> Vector3 {
        let [w, x, y, z] = self.wxyz;
        let u = [x, y, z];
        let t = scale(cross(u, v), 2.0);
        add(add(v, scale(t, w)), cross(u, t))
    }

    /// The opposite rotation.
    #[inline]
    #[must_use]
    pub fn inverse(self) -> Self {
        let [w, x, y, z] = self.wxyz;
        Self {
            wxyz: [w, -x, -y, -z],
        }
    }

    /// Angle in [0, pi] of the rotation that leads from `self` to `other`.
    #[must_use]
    pub fn angle_to(self, other: Self) -> f64 {
        norm((self.inverse() * other).to_rotation_vector())
    }

    /// Constant-speed interpolation along the shorter arc: `self` at 0, `other` at 1.
    #[must_use]
    pub fn slerp(self, other: Self, t: f64) -> Self {
        self * Self::from_rotation_vector(scale((self.inverse() * other).to_rotation_vector(), t))
    }

    /// Angle in [0, pi] between this rotation's z axis and the base z axis: 0 for a tool that
    /// points up, pi for one that points down.
    #[must_use]
    pub fn tilt(self) -> f64 {
        acos_clamped(self.rotate([0.0, 0.0, 1.0])[2])
    }

    /// True where all components are finite and the length is 1 within 1e-6.
    #[must_use]
    pub fn is_valid(self) -> bool {
        let [w, x, y, z] = self.wxyz;
        let length = sqrt_pos(w * w + x * x + y * y + z * z);
        (length - 1.0).abs() < 1e-6
    }
}

impl Mul for UnitQuaternion {
    type Output = Self;

    /// First `rhs`, then `self`. The product is scaled back to length 1, so that long chains of
    /// products do not drift.
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        let [aw, ax, ay, az] = self.wxyz;
        let [bw, bx, by, bz] = rhs.wxyz;
        let q = [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ];
        // One Newton step of 1/sqrt: exact to rounding for a length within 1e-8 of 1.
        let k = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        Self {
            wxyz: [q[0] * k, q[1] * k, q[2] * k, q[3] * k],
        }
    }
}

/// Angular velocity, rad/s, and angular acceleration, rad/s^2, of a rotation whose rotation vector
/// is `v`, rad, and changes by `rate` and `acceleration`; all in the frame that the rotation leads
/// from. With the left Jacobian of SO(3), `omega = J(v) v'`, and its derivative (Sola, Deray,
/// Atchuthan, "A micro Lie theory for state estimation in robotics", arXiv 1812.01537).
#[must_use]
pub fn angular_motion(v: Vector3, rate: Vector3, acceleration: Vector3) -> (Vector3, Vector3) {
    let [a, b, da, db] = jacobian_series(dot(v, v));
    let once = cross(v, rate);
    let twice = cross(v, once);
    let once_later = cross(v, acceleration);
    let twice_later = add(cross(rate, once), cross(v, once_later));
    let along = dot(v, rate);
    let weighed = |k: f64, x: Vector3, l: f64, y: Vector3| add(scale(x, k), scale(y, l));
    let of_factors = weighed(da * along, once, db * along, twice);
    let of_products = weighed(a, once_later, b, twice_later);
    (
        add(rate, weighed(a, once, b, twice)),
        add(acceleration, add(of_factors, of_products)),
    )
}

/// For `t`, the square of an angle x: `a = (1 - cos x) / x^2`, `b = (x - sin x) / x^3`, and
/// `da/dx / x`, `db/dx / x`.
fn jacobian_series(t: f64) -> [f64; 4] {
    if t < 0.25 {
        // Closed forms lose their digits near 0.
        let series = |[c0, c1, c2, c3, c4]: [f64; 5]| c0 + t * (c1 + t * (c2 + t * (c3 + t * c4)));
        return [
            series([
                1.0 / 2.0,
                -1.0 / 24.0,
                1.0 / 720.0,
                -1.0 / 40320.0,
                1.0 / 3_628_800.0,
            ]),
            series([
                1.0 / 6.0,
                -1.0 / 120.0,
                1.0 / 5040.0,
                -1.0 / 362_880.0,
                1.0 / 39_916_800.0,
            ]),
            series([
                -1.0 / 12.0,
                1.0 / 180.0,
                -1.0 / 6720.0,
                1.0 / 453_600.0,
                -1.0 / 47_900_160.0,
            ]),
            series([
                -1.0 / 60.0,
                1.0 / 1260.0,
                -1.0 / 60480.0,
                1.0 / 4_989_600.0,
                -1.0 / 622_702_080.0,
            ]),
        ];
    }
    let x = sqrt(t);
    let (s, c) = sincos(x);
    let (a, b) = ((1.0 - c) / t, (x - s) / (x * t));
    [a, b, (s / x - 2.0 * a) / t, (a - 3.0 * b) / t]
}

#[cfg(test)]
mod tests;
