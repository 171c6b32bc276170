//! Arm kinematics and jerk-limited motion.
//!
//! No heap, no panic, and the same bits on every machine. Units are SI, angles radians,
//! quaternions (w, x, y, z) of unit length in Hamilton's convention, matrices row-major.
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

pub mod arm;
pub mod chain;
pub mod clearance;
pub mod diff_ik;
pub mod elementary;
pub mod jacobian;
mod linear;
pub mod object;
pub mod otg;
pub mod panda;
pub mod pose;
pub mod pose_ik;
pub mod rotation;
#[cfg(feature = "std")]
pub mod urdf;
pub mod vector;

pub use arm::Arm;
pub use chain::Chain;
pub use pose::Pose;
pub use rotation::UnitQuaternion;
