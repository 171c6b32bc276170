//! Every test of the core that needs nothing but the core.

mod bytes;
mod invariants;
mod recoveries;
mod soak;
mod swarm;
mod table_19;
