//! Arithmetic in space, as a textbook has it.

pub(super) type Point = [f64; 3];

pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn times(a: Point, s: f64) -> Point {
    a.map(|x| x * s)
}

pub(super) fn length(a: Point) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

pub(super) fn apart(a: Point, b: Point) -> f64 {
    length(minus(a, b))
}

/// Length of the shadow on the floor.
pub(super) fn flat(a: Point) -> f64 {
    length([a[0], a[1], 0.0])
}

/// From `a` to `b` by `share` of the way.
pub(super) fn between(a: Point, b: Point, share: f64) -> Point {
    plus(a, times(minus(b, a), share))
}

/// The rotation matrix of a quaternion (w, x, y, z) that is nearly of unit length.
pub(super) struct Frame([[f64; 3]; 3]);

impl Frame {
    pub(super) fn new(q: [f64; 4]) -> Self {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [w, x, y, z] = q.map(|c| c / norm);
        Self([
            [
                w * w + x * x - y * y - z * z,
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                w * w - x * x + y * y - z * z,
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                w * w - x * x - y * y + z * z,
            ],
        ])
    }

    pub(super) fn outwards(&self, v: Point) -> Point {
        self.0.map(|row| (0..3).map(|i| row[i] * v[i]).sum())
    }

    pub(super) fn inwards(&self, v: Point) -> Point {
        [0, 1, 2].map(|i| (0..3).map(|row| self.0[row][i] * v[row]).sum())
    }

    /// Half the height of a box of these half edges.
    pub(super) fn half_height(&self, half: Point) -> f64 {
        (0..3).map(|i| self.0[2][i].abs() * half[i]).sum()
    }
}
