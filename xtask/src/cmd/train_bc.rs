//! `cargo xtask train-bc`.

use std::ffi::OsString;

use crate::{mujoco, process, workspace::Workspace};

/// Arguments of `train-bc`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Arguments of the training (`cargo xtask train-bc -- --help` lists them).
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENT"
    )]
    arguments: Vec<OsString>,
}

/// Builds and becomes the training.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    let mut train = process::cargo(workspace);
    train.args([
        "run",
        "--release",
        "--locked",
        "--quiet",
        "--package=fitmac-train",
        "--bin=train-bc",
        "--",
    ]);
    process::become_command(train.args(&args.arguments))
}
