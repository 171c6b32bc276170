//! Every test of the core that needs nothing but the core.

mod bytes;
mod edges;
mod invariants;
mod profiles;
mod quick;
mod recoveries;
mod soak;
mod swarm;
mod table_19;
