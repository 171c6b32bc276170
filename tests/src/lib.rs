//! What crosses crates.

pub mod fitmac;
pub mod invariants;
pub mod link;
pub mod oracle;
pub mod swarm;
pub mod world;
