//! `cargo xtask setup`.

use crate::{mujoco, oracles, process::step, workspace::Workspace};

/// Arguments of `setup`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Also make the Python environment of the test oracles.
    #[arg(long)]
    oracles: bool,
}

/// Fetches what the build needs.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    if args.oracles {
        oracles::install(workspace)?;
    }
    step("Set up");
    Ok(())
}
