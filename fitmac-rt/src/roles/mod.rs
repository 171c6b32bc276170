//! The processes as library functions.

mod controller;

pub use controller::{ControllerError, ControllerReport, ControllerRole, controller};
