//! `cargo xtask demo`.

use std::ffi::OsString;

use crate::{mujoco, process, workspace::Workspace};

/// Arguments of `demo`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Arguments of `fitmac demo` (`cargo xtask demo --help` lists them).
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENT"
    )]
    arguments: Vec<OsString>,
}

/// Fetches what the build needs, builds, and becomes the demo.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    process::step("Building (a few minutes the first time)");
    let mut build = process::cargo(workspace);
    build.args(["build", "--release", "--locked", "--package=fitmac-cli"]);
    process::run(&mut build)?;
    let mut demo = process::cargo(workspace);
    demo.args([
        "run",
        "--release",
        "--locked",
        "--quiet",
        "--package=fitmac-cli",
        "--",
        "demo",
    ]);
    process::become_command(demo.args(&args.arguments))
}
