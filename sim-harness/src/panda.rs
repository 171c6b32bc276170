//! The robot: its files, names and rest posture.

/// The robot as MJCF, with primitive geometry. The sources of its figures stand in the file.
pub const MJCF: &str = include_str!("../assets/panda.xml");
/// The robot as URDF: the same kinematics, limits and inertias.
pub const URDF: &str = include_str!("../assets/panda.urdf");

/// Joints of the arm.
pub const ARM_JOINTS: usize = 7;
/// Site of the tool centre point in the MJCF.
pub const TCP_SITE: &str = "tcp";
/// Bodies of the fingers.
pub const FINGER_BODIES: [&str; 2] = ["left_finger", "right_finger"];
/// Opening of the gripper when fully open, m.
pub const GRIPPER_OPEN_M: f64 = 0.08;
/// Rest posture: robosuite's initial posture of the Panda, rad. The hand points down.
pub const HOME_RAD: [f64; ARM_JOINTS] = [
    0.0,
    -0.161_037_389,
    0.0,
    -2.444_597_47,
    0.0,
    2.226_752_2,
    core::f64::consts::FRAC_PI_4,
];
/// Set point of the gripper's half opening when told to open, m.
pub const GRIPPER_OPEN_SETPOINT_M: f64 = 0.04;
/// Set point of the gripper's half opening when told to close, m: below zero, so that it presses.
pub const GRIPPER_CLOSE_SETPOINT_M: f64 = -0.02;
/// Speed of that set point, m/s: a full swing takes eight policy steps, as in LIBERO.
pub const GRIPPER_RATE_M_S: f64 = 0.1;
