//! Vectors of three numbers, as plain arrays.

use crate::elementary::sqrt;

/// A vector or point in three dimensions; its frame and unit stand at the place of use.
pub type Vector3 = [f64; 3];

/// Unit vector along x.
pub const X_AXIS: Vector3 = [1.0, 0.0, 0.0];
/// Unit vector along y.
pub const Y_AXIS: Vector3 = [0.0, 1.0, 0.0];
/// Unit vector along z.
pub const Z_AXIS: Vector3 = [0.0, 0.0, 1.0];

/// `a + b`.
#[inline]
#[must_use]
pub fn add(a: Vector3, b: Vector3) -> Vector3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline]
#[must_use]
pub fn sub(a: Vector3, b: Vector3) -> Vector3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `s * a`.
#[inline]
#[must_use]
pub fn scale(a: Vector3, s: f64) -> Vector3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// Scalar product.
#[inline]
#[must_use]
pub fn dot(a: Vector3, b: Vector3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product `a x b`, right-handed.
#[inline]
#[must_use]
pub fn cross(a: Vector3, b: Vector3) -> Vector3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Euclidean length.
#[inline]
#[must_use]
pub fn norm(a: Vector3) -> f64 {
    sqrt(dot(a, a))
}

/// Euclidean distance between two points.
#[inline]
#[must_use]
pub fn distance(a: Vector3, b: Vector3) -> f64 {
    norm(sub(a, b))
}

/// The vector of length 1 in the direction of `a`; `None` where `a` has no direction: shorter
/// than 1e-150, or not finite.
#[inline]
#[must_use]
pub fn normalized(a: Vector3) -> Option<Vector3> {
    let length = norm(a);
    (length > 1e-150 && length.is_finite()).then(|| scale(a, 1.0 / length))
}

/// `a` shortened, where it is longer than `limit`, to the length `limit`; direction kept.
#[inline]
#[must_use]
pub fn clamp_norm(a: Vector3, limit: f64) -> Vector3 {
    let length = norm(a);
    if length > limit {
        scale(a, limit / length)
    } else {
        a
    }
}

/// `a + t (b - a)`.
#[inline]
#[must_use]
pub fn lerp(a: Vector3, b: Vector3, t: f64) -> Vector3 {
    add(a, scale(sub(b, a), t))
}

/// True where all three numbers are finite.
#[inline]
#[must_use]
pub fn is_finite(a: Vector3) -> bool {
    a[0].is_finite() && a[1].is_finite() && a[2].is_finite()
}
