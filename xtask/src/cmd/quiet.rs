//! `cargo xtask quiet`.

use crate::{process, workspace::Workspace};

/// Arguments of `quiet`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Control ticks.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    ticks: u64,
    /// Ticks a second, 250 to 2000.
    #[arg(long, value_name = "HZ", default_value_t = 2000)]
    rate: u64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Builds and becomes the count; with debug assertions, for they must be quiet too.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let mut quiet = process::cargo(workspace);
    quiet.args([
        "run",
        "--locked",
        "--quiet",
        "--package=fitmac-tests",
        "--bin=quiet",
        "--",
    ]);
    quiet.args(["--ticks", &args.ticks.to_string()]);
    quiet.args(["--rate", &args.rate.to_string()]);
    if args.json {
        quiet.arg("--json");
    }
    process::become_command(&mut quiet)
}
