//! What crosses crates.

pub mod oracle;
