//! The FIT-MAC decision core: runtime assurance for a robot that runs a
//! vision-language-action (VLA) policy.
//!
//! The core sits between the policy and the robot. [`Controller::tick`] takes
//! the time and whatever arrived since the last tick, and answers with exactly
//! one command. It never reads a clock, never allocates and never fails: bad
//! input is a diagnosis, not an error.
#![no_std]
#![forbid(unsafe_code)]

pub mod evidence;
pub mod message;
pub mod reason;
pub mod wire;

mod controller;
mod params;

pub use controller::{Controller, State};
pub use params::{Params, ValidParams};
