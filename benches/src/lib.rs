//! Shared parts of the benchmarks.

pub mod callgrind;
pub mod peers;
pub mod rounds;
