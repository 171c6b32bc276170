//! Arm kinematics and jerk-limited motion.
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]
