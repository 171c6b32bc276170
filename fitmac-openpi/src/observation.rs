//! What a LIBERO policy of openpi is asked with.

use rmpv::{ValueRef, encode::write_value_ref};

use crate::array::packed;

/// Side of a picture, px: what openpi's clients scale theirs to before they send them.
pub const SIDE_PX: usize = 224;
/// Numbers of a state.
pub const STATE_DIM: usize = 8;

/// A picture of 224 x 224 pixels: red, green, blue, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    rgb: Vec<u8>,
}

/// Bytes that are no picture of the right size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a picture has 150528 bytes (224 x 224 x 3), not {0}")]
pub struct ImageError(pub usize);

impl Image {
    /// Bytes of a picture.
    pub const BYTES: usize = SIDE_PX * SIDE_PX * 3;

    /// A picture of these bytes.
    ///
    /// # Errors
    /// [`ImageError`] if there are not [`Image::BYTES`] of them.
    pub fn new(rgb: Vec<u8>) -> Result<Self, ImageError> {
        match rgb.len() {
            Self::BYTES => Ok(Self { rgb }),
            other => Err(ImageError(other)),
        }
    }

    /// The same picture with left and right exchanged. openpi's LIBERO policies were trained on
    /// such pictures: robosuite stores a frame from its bottom row up, and LIBERO's data turns it
    /// by half a turn (`[::-1, ::-1]` in openpi's `examples/libero/main.py`), which leaves it
    /// upright and mirrored.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let mut rgb = Vec::with_capacity(self.rgb.len());
        for row in self.rgb.chunks_exact(SIDE_PX * 3) {
            row.rchunks_exact(3)
                .for_each(|pixel| rgb.extend_from_slice(pixel));
        }
        Self { rgb }
    }

    /// The bytes.
    #[must_use]
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }
}

/// A question to the policy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<'a> {
    /// From in front of the robot.
    pub image: &'a Image,
    /// From the wrist.
    pub wrist_image: &'a Image,
    /// The robot's own state, as [`libero_state`] makes it.
    pub state: [f64; STATE_DIM],
    /// What the robot is told.
    pub prompt: &'a str,
}

impl Observation<'_> {
    /// The frame that asks this, with the keys of openpi's `LiberoInputs`.
    #[must_use]
    pub fn frame(&self) -> Vec<u8> {
        const SHAPE: &[usize] = &[SIDE_PX, SIDE_PX, 3];
        let state: Vec<u8> = self.state.iter().flat_map(|x| x.to_le_bytes()).collect();
        let (front, wrist) = (self.image.rgb(), self.wrist_image.rgb());
        let question = ValueRef::Map(vec![
            (
                ValueRef::from("observation/image"),
                packed("|u1", SHAPE, front),
            ),
            (
                ValueRef::from("observation/wrist_image"),
                packed("|u1", SHAPE, wrist),
            ),
            (
                ValueRef::from("observation/state"),
                packed("<f8", &[STATE_DIM], &state),
            ),
            (ValueRef::from("prompt"), ValueRef::from(self.prompt)),
        ]);
        let mut frame = Vec::with_capacity(2 * Image::BYTES + 1024);
        let written = write_value_ref(&mut frame, &question);
        debug_assert!(written.is_ok(), "a vector takes everything");
        frame
    }
}

/// The state that LIBERO's policies expect: position of the tool centre point in LIBERO's world
/// (m), its orientation as a rotation vector (rad), positions of the two fingers (m).
///
/// - `position_m`, `orientation` (w, x, y, z): the tool centre point in the robot's base frame.
/// - `gripper_width_m`: distance between the finger pads.
/// - `base_in_world_m`: where LIBERO's world has the robot's base; robosuite reports positions in
///   the world. On the tables of LIBERO-Spatial (-0.66, 0, 0.912), on the floor of LIBERO-Object
///   (-0.6, 0, 0).
///
/// The rotation vector is robosuite's: twice the arc cosine of w along the vector part, not brought
/// below pi. A quaternion and its negative give different vectors then; of the two, the one whose x
/// is not negative is taken, as for a hand that points down in robosuite, so that the vector does
/// not jump there.
#[must_use]
pub fn libero_state(
    position_m: [f64; 3],
    orientation: [f64; 4],
    gripper_width_m: f64,
    base_in_world_m: [f64; 3],
) -> [f64; STATE_DIM] {
    let sign = if orientation[1] < 0.0 { -1.0 } else { 1.0 };
    let [w, vector @ ..] = orientation.map(|part| sign * part);
    let w = w.clamp(-1.0, 1.0);
    let sine = (1.0 - w * w).sqrt();
    // Below this the rotation is none, as in robosuite.
    let scale = if sine < 1e-9 {
        0.0
    } else {
        2.0 * w.acos() / sine
    };
    let [rx, ry, rz] = vector.map(|part| scale * part);
    let [x, y, z] = std::array::from_fn(|i| position_m[i] + base_in_world_m[i]);
    let finger = 0.5 * gripper_width_m;
    [x, y, z, rx, ry, rz, finger, -finger]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_points_down_does_not_jump() {
        let state = |w: f64| {
            let x = (1.0 - w * w).sqrt();
            libero_state([0.4, 0.1, 0.2], [w, x, 0.0, 0.0], 0.08, [-0.66, 0.0, 0.912])
        };
        let down = state(0.0);
        let expected = [
            -0.26,
            0.1,
            1.112,
            std::f64::consts::PI,
            0.0,
            0.0,
            0.04,
            -0.04,
        ];
        for (got, wanted) in down.iter().zip(expected) {
            assert!((got - wanted).abs() < 1e-12, "{down:?}");
        }
        // Tilted a little to either side, and with either sign of the quaternion.
        assert!((state(0.01)[3] - (std::f64::consts::PI - 0.02)).abs() < 1e-4);
        assert!((state(-0.01)[3] - (std::f64::consts::PI + 0.02)).abs() < 1e-4);
        let (a, b) = (
            libero_state([0.0; 3], [0.1, 0.9, -0.2, 0.3], 0.0, [0.0; 3]),
            libero_state([0.0; 3], [-0.1, -0.9, 0.2, -0.3], 0.0, [0.0; 3]),
        );
        assert_eq!(a, b);
    }

    #[test]
    fn no_rotation_is_zero_and_not_nan() {
        let state = libero_state([0.0; 3], [1.0, 0.0, 0.0, 0.0], 0.0, [0.0; 3]);
        assert_eq!(state, [0.0; STATE_DIM]);
        let beyond = libero_state([0.0; 3], [1.0 + 1e-12, 0.0, 0.0, 0.0], 0.0, [0.0; 3]);
        assert!(beyond.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn mirroring_exchanges_left_and_right_only() {
        let mut rgb = vec![0; Image::BYTES];
        rgb[..3].copy_from_slice(&[1, 2, 3]); // top left
        let image = Image::new(rgb).unwrap();
        let mirrored = image.mirrored();
        let right = 3 * (SIDE_PX - 1);
        assert_eq!(mirrored.rgb()[right..right + 3], [1, 2, 3]);
        assert_eq!(mirrored.mirrored(), image);
        assert_eq!(Image::new(vec![0; 7]), Err(ImageError(7)));
    }
}
