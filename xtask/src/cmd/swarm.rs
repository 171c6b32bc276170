//! `cargo xtask swarm`.

use crate::{process, workspace::Workspace};

/// Arguments of `swarm`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Control ticks to run, at least; whole runs only.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    ticks: u64,
    /// The first seed; the next ones follow.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
}

/// Builds and becomes the swarm.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let mut swarm = process::cargo(workspace);
    swarm.args([
        "run",
        "--release",
        "--locked",
        "--quiet",
        "--package=fitmac-tests",
        "--bin=swarm",
        "--",
    ]);
    swarm.args(["--ticks", &args.ticks.to_string()]);
    swarm.args(["--seed", &args.seed.to_string()]);
    process::become_command(&mut swarm)
}
