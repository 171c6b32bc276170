//! What crosses crates.

pub mod link;
pub mod oracle;
pub mod world;
