//! What crosses crates.

#[cfg(feature = "programs")]
pub mod cell;
pub mod docs;
#[cfg(feature = "programs")]
pub mod faults;
#[cfg(feature = "programs")]
pub mod fitmac;
pub mod link;
pub mod meter;
#[cfg(feature = "programs")]
pub mod openpi;
pub mod oracle;
#[cfg(feature = "programs")]
pub mod soak_rt;
