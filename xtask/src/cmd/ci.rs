//! `cargo xtask ci`.

use std::time::Instant;

use super::{docs, test};
use crate::{mujoco, process, workspace::Workspace};

/// Arguments of `ci`.
#[derive(clap::Args)]
pub(crate) struct Args {}

/// Formatting, lints, documentation, tests: the quick ones first.
pub(crate) fn run(workspace: &Workspace, _args: &Args) -> anyhow::Result<()> {
    let started = Instant::now();
    process::step("Formatting");
    process::run(process::cargo(workspace).args(["fmt", "--all", "--check"]))?;
    mujoco::install(workspace)?;
    process::step("Lints");
    let mut clippy = process::cargo(workspace);
    clippy.args([
        "clippy",
        "--workspace",
        "--all-targets",
        "--locked",
        "--",
        "-Dwarnings",
    ]);
    process::run(&mut clippy)?;
    process::step("Documentation");
    let mut doc = process::cargo(workspace);
    doc.args([
        "doc",
        "--workspace",
        "--no-deps",
        "--locked",
        "--document-private-items",
    ]);
    process::run(doc.env("RUSTDOCFLAGS", "-Dwarnings"))?;
    test::run(workspace, &test::Args::default())?;
    docs::run(
        workspace,
        &docs::Args {
            check: true,
            pictures: false,
        },
    )?;
    let minutes = started.elapsed().as_secs_f64() / 60.0;
    println!("cargo xtask ci: everything is green after {minutes:.1} minutes");
    Ok(())
}
