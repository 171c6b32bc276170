//! What crosses crates.

pub mod bytes;
#[cfg(feature = "programs")]
pub mod cell;
pub mod docs;
#[cfg(feature = "programs")]
pub mod faults;
#[cfg(feature = "programs")]
pub mod fitmac;
pub mod invariants;
pub mod link;
pub mod model;
#[cfg(feature = "programs")]
pub mod openpi;
pub mod oracle;
pub mod replay;
pub mod soak;
pub mod swarm;
pub mod world;
