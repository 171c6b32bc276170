//! `cargo xtask soak-rt`.

use crate::{mujoco, process, workspace::Workspace};

/// Arguments of `soak-rt`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// How long, s.
    #[arg(long, value_name = "S", default_value_t = 1800)]
    seconds: u64,
    /// How long each demo lasts, s.
    #[arg(long, value_name = "S", default_value_t = 30)]
    demo_seconds: u64,
    /// The first demo's seed; the next ones follow.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

/// Builds and becomes the soak, which builds `fitmac`.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    let mut soak = process::cargo(workspace);
    soak.args(["run", "--quiet", "--locked", "--package=fitmac-tests"]);
    soak.args(["--bin=soak_rt", "--"]);
    soak.args(["--seconds", &args.seconds.to_string()]);
    soak.args(["--demo-seconds", &args.demo_seconds.to_string()]);
    soak.args(["--seed", &args.seed.to_string()]);
    process::become_command(&mut soak)
}
