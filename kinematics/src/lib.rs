//! Arm kinematics and jerk-limited motion.
//!
//! No heap, no panic, and the same bits on every machine. Units are SI, angles radians,
//! quaternions (w, x, y, z) of unit length in Hamilton's convention, matrices row-major.
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

pub mod elementary;
pub mod otg;
pub mod pose;
pub mod rotation;
pub mod vector;

pub use pose::Pose;
pub use rotation::UnitQuaternion;
