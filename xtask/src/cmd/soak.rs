//! `cargo xtask soak`.

use std::thread;

use crate::{process, workspace::Workspace};

/// Arguments of `soak`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Control ticks to play, in whole runs; a run is cut short by a tie, which one in some
    /// hundreds comes to.
    #[arg(long, value_name = "N", default_value_t = 10_100_000)]
    ticks: u64,
    /// The first seed; the next ones follow.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
}

/// Builds and becomes the soak, on every core; with debug assertions, for they
/// check the core too.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let mut soak = process::cargo(workspace);
    soak.args([
        "run",
        "--locked",
        "--quiet",
        "--package=fitmac-tests",
        "--no-default-features",
        "--bin=soak",
        "--",
    ]);
    soak.args([args.ticks, args.seed].map(|n| n.to_string()));
    process::become_command(soak.arg(threads.to_string()))
}
