//! What crosses crates.

pub mod oracle;
pub mod world;
