//! The commands, one a file.

pub(crate) mod bare_metal;
pub(crate) mod bench;
pub(crate) mod ci;
pub(crate) mod coverage;
pub(crate) mod demo;
pub(crate) mod docs;
pub(crate) mod doctor;
pub(crate) mod evaluate;
pub(crate) mod faults;
pub(crate) mod fuzz;
pub(crate) mod install;
pub(crate) mod mutants;
pub(crate) mod quiet;
pub(crate) mod replay_identity;
pub(crate) mod rtsan;
pub(crate) mod setup;
pub(crate) mod soak;
pub(crate) mod soak_rt;
pub(crate) mod stack;
pub(crate) mod swarm;
pub(crate) mod test;
pub(crate) mod train_bc;
