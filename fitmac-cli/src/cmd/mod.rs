//! The commands, one a file.

pub(crate) mod demo;
pub(crate) mod doctor;
pub(crate) mod sim;
pub(crate) mod vla;
