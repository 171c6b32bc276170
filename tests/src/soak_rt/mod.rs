//! A long run of one controller with demo after demo around it: what it holds
//! of the system, and whether that grows.

mod demos;
mod sample;
mod trace;
mod verdict;

pub use demos::Cell;
pub use sample::Sample;
pub use trace::{Kept, count, kept};
pub use verdict::grown;
