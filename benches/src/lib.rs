//! Shared parts of the benchmarks.

pub mod baseline;
pub mod callgrind;
pub mod peers;
pub mod rounds;
pub mod ticks;
