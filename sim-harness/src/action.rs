//! Actions as LIBERO's policies speak them.

/// Seven numbers: x, y, z, rotation vector, gripper.
///
/// The first six are increments in the base frame, normalised so that 1 is [`POSITION_SCALE_M`]
/// or [`ROTATION_SCALE_RAD`]; the gripper is -1 to open and +1 to close (robosuite's `OSC_POSE`
/// as LIBERO configures it).
pub type Action = [f64; 7];

/// Metres of one unit of translation.
pub const POSITION_SCALE_M: f64 = 0.05;
/// Radians of one unit of rotation.
pub const ROTATION_SCALE_RAD: f64 = 0.5;
/// Policy steps a second.
pub const POLICY_RATE_HZ: f64 = 20.0;
/// Duration of a policy step, s.
pub const POLICY_STEP_S: f64 = 1.0 / POLICY_RATE_HZ;
/// Duration of a physics step, s.
pub const PHYSICS_STEP_S: f64 = 0.002;
/// Physics steps of one policy step.
pub const SUBSTEPS: u32 = 25;
/// Stand still with the gripper open: what LIBERO's evaluations play while the scene settles.
pub const WAIT: Action = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
