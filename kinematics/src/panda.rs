//! The Franka Emika Panda (FR3's predecessor), from `panda_link0` to the tool centre point of the
//! Franka hand, `panda_hand_tcp`.
//!
//! Source: Franka's published Denavit-Hartenberg parameters and limits (Franka Control Interface
//! documentation, "Robot and interface specifications"), and the hand's URDF: turned by -45
//! degrees on the flange, tool centre point 0.1034 m beyond it. The numbers are checked against
//! the `panda.urdf` of `example-robot-data` by test.

use crate::arm::Arm;
use crate::chain::forward::{Moving, check};
use crate::chain::{
    Chain, ChainError, Frame, Joint, JointKind, JointLimits, JointOutOfRange, Solution, Twist,
};
use crate::elementary::sincos_each_short;
use crate::jacobian::Jacobian;
use crate::rotation::{IDENTITY3, Matrix3};
use crate::vector::{Vector3, cross, scale, sub};

/// Number of joints.
pub const JOINTS: usize = 7;

/// Height of the shoulder over the base, in metres.
const SHOULDER_M: f64 = 0.333;
/// Shoulder to elbow, along the upper arm.
const UPPER_ARM_M: f64 = 0.316;
/// Sideways offset of the elbow.
const ELBOW_M: f64 = 0.0825;
/// Elbow to wrist, along the forearm.
const FOREARM_M: f64 = 0.384;
/// Sideways offset of the last joint from the wrist.
const WRIST_M: f64 = 0.088;
/// Last joint to the tool centre point: flange at 0.107 m, tool centre point 0.1034 m beyond.
const TOOL_M: f64 = 0.107 + 0.1034;
/// Turn of the hand on the flange: -45 degrees.
const HAND_COS_SIN: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// A joint's range in rad and rad/s.
const fn range(lower: f64, upper: f64, velocity: f64) -> JointLimits {
    JointLimits {
        lower,
        upper,
        velocity,
    }
}

/// Limits of the joints in rad and rad/s.
pub const LIMITS: [JointLimits; JOINTS] = [
    range(-2.8973, 2.8973, 2.175),
    range(-1.7628, 1.7628, 2.175),
    range(-2.8973, 2.8973, 2.175),
    range(-3.0718, -0.0698, 2.175),
    range(-2.8973, 2.8973, 2.61),
    range(-0.0175, 3.7525, 2.61),
    range(-2.8973, 2.8973, 2.61),
];
/// Greatest joint accelerations in rad/s^2.
pub const ACCELERATION_LIMITS: [f64; JOINTS] = [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0];
/// Greatest joint jerks in rad/s^3.
pub const JERK_LIMITS: [f64; JOINTS] = [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10_000.0, 10_000.0];
/// The customary ready posture in rad: elbow bent, hand pointing down.
pub const READY: [f64; JOINTS] = [
    0.0,
    -core::f64::consts::FRAC_PI_4,
    0.0,
    -3.0 * core::f64::consts::FRAC_PI_4,
    0.0,
    core::f64::consts::FRAC_PI_2,
    core::f64::consts::FRAC_PI_4,
];

/// The Panda with its own forward kinematics: the same frames as [`chain`], in less time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Panda;

/// What the Jacobian needs beside the tip: axes of the joints 2 to 7, and three points.
struct Skeleton {
    tip: Moving,
    axes: [Vector3; 6],
    elbow: Vector3,
    wrist: Vector3,
}

#[inline(always)]
fn skeleton(q: &[f64; JOINTS]) -> Skeleton {
    let ([s1, s2, s3, s4, s5, s6, s7], [c1, c2, c3, c4, c5, c6, c7]) = sincos_each_short(q);
    // Joints 1 and 2 by hand: the frame still has zeros.
    let z2 = [-s1, c1, 0.0];
    let z3 = [c1 * s2, s1 * s2, c2];
    let mut frame = Moving {
        x: [c1 * c2, s1 * c2, -s2],
        y: z2,
        z: z3,
        p: scale(z3, UPPER_ARM_M),
    };
    frame.p[2] += SHOULDER_M;
    frame.turn_z(c3, s3);
    frame.shift_x(ELBOW_M);
    let elbow = frame.p;
    frame.twist(Twist::Quarter);
    let z4 = frame.z;
    frame.turn_z(c4, s4);
    frame.shift_x(-ELBOW_M);
    frame.shift_y(FOREARM_M);
    let wrist = frame.p;
    frame.twist(Twist::QuarterBack);
    let z5 = frame.z;
    frame.turn_z(c5, s5);
    frame.twist(Twist::Quarter);
    let z6 = frame.z;
    frame.turn_z(c6, s6);
    frame.shift_x(WRIST_M);
    frame.twist(Twist::Quarter);
    let z7 = frame.z;
    frame.p = [
        frame.p[0] + TOOL_M * z7[0],
        frame.p[1] + TOOL_M * z7[1],
        frame.p[2] + TOOL_M * z7[2],
    ];
    // The hand's turn joins that of joint 7.
    frame.turn_z(HAND_COS_SIN * (c7 + s7), HAND_COS_SIN * (s7 - c7));
    Skeleton {
        tip: frame,
        axes: [z2, z3, z4, z5, z6, z7],
        elbow,
        wrist,
    }
}

#[inline(always)]
fn column(v: Vector3, w: Vector3) -> [f64; 6] {
    [v[0], v[1], v[2], w[0], w[1], w[2]]
}

impl Arm<JOINTS> for Panda {
    fn limits(&self) -> &[JointLimits; JOINTS] {
        &LIMITS
    }

    fn reach_m(&self) -> f64 {
        // Every offset in full, as if they lay in one line.
        SHOULDER_M + UPPER_ARM_M + 2.0 * ELBOW_M + FOREARM_M + WRIST_M + TOOL_M
    }

    #[inline]
    fn tip(&self, q: &[f64; JOINTS]) -> Result<Frame, JointOutOfRange> {
        check(q)?;
        Ok(skeleton(q).tip.frame())
    }

    #[inline]
    fn solve(&self, q: &[f64; JOINTS]) -> Result<Solution<JOINTS>, JointOutOfRange> {
        check(q)?;
        let Skeleton {
            tip,
            axes: [z2, z3, z4, z5, z6, z7],
            elbow,
            wrist,
        } = skeleton(q);
        // The axes of joints 1, 2 and 3 meet in the shoulder, those of 5 and 6 in the wrist, and
        // the tool centre point lies on that of joint 7.
        let [x, y, h] = sub(tip.p, [0.0, 0.0, SHOULDER_M]);
        let from_shoulder = [x, y, h];
        let from_elbow = sub(tip.p, elbow);
        let from_wrist = sub(tip.p, wrist);
        let columns = [
            [-y, x, 0.0, 0.0, 0.0, 1.0],
            column([z2[1] * h, -z2[0] * h, z2[0] * y - z2[1] * x], z2),
            column(cross(z3, from_shoulder), z3),
            column(cross(z4, from_elbow), z4),
            column(cross(z5, from_wrist), z5),
            column(cross(z6, from_wrist), z6),
            column([0.0; 3], z7),
        ];
        Ok(Solution {
            tip: tip.frame(),
            jacobian: Jacobian { columns },
        })
    }
}

const QUARTER_X: Matrix3 = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
const QUARTER_BACK_X: Matrix3 = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
const HAND: Matrix3 = [
    [HAND_COS_SIN, HAND_COS_SIN, 0.0],
    [-HAND_COS_SIN, HAND_COS_SIN, 0.0],
    [0.0, 0.0, 1.0],
];

/// The Panda as a general chain, for what [`Panda`] does not offer: link frames, other tools.
///
/// # Errors
/// None with these constants; the signature is that of [`Chain::new`].
pub fn chain() -> Result<Chain<JOINTS>, ChainError> {
    let [l1, l2, l3, l4, l5, l6, l7] = LIMITS;
    let joint = |rotation, translation, limits| Joint {
        rotation,
        translation,
        axis: [0.0, 0.0, 1.0],
        kind: JointKind::Revolute,
        limits,
    };
    let joints = [
        joint(IDENTITY3, [0.0, 0.0, SHOULDER_M], l1),
        joint(QUARTER_BACK_X, [0.0; 3], l2),
        joint(QUARTER_X, [0.0, -UPPER_ARM_M, 0.0], l3),
        joint(QUARTER_X, [ELBOW_M, 0.0, 0.0], l4),
        joint(QUARTER_BACK_X, [-ELBOW_M, FOREARM_M, 0.0], l5),
        joint(QUARTER_X, [0.0; 3], l6),
        joint(QUARTER_X, [WRIST_M, 0.0, 0.0], l7),
    ];
    Chain::new(&joints, &HAND, [0.0, 0.0, TOOL_M])
}
