//! The invariants of the core, by number. What each says, and where those that
//! are not here are tested, stands in `fitmac_core_tests::invariants`; [`index`]
//! fails if a number has no test.

mod budget;
mod determinism;
mod gate;
mod lock;
mod monitor;
mod output;
mod phases;
mod routing;
mod stand;
