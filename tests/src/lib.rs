//! What crosses crates.

pub mod bytes;
pub mod docs;
#[cfg(feature = "programs")]
pub mod fitmac;
pub mod invariants;
pub mod link;
pub mod oracle;
pub mod swarm;
pub mod world;
