//! `cargo xtask docs`: documents that are printed by the code itself.

use std::{fs, process::Stdio};

use anyhow::{Context, bail};

use crate::{
    mujoco, process,
    workspace::{Workspace, not_writable},
};

/// Each document, and the arguments of `cargo run` that print it.
const DOCUMENTS: &[(&str, &[&str])] = &[
    (
        "docs/parameters.md",
        &["--package=fitmac-cli", "--", "config", "--reference"],
    ),
    (
        "docs/state-machine.md",
        &[
            "--package=fitmac-tests",
            "--example=page",
            "--",
            "state-machine",
        ],
    ),
    (
        "docs/faults.md",
        &["--package=fitmac-tests", "--example=page", "--", "faults"],
    ),
];

/// Arguments of `docs`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Write nothing; fail if a document is not what the code prints.
    #[arg(long)]
    pub(super) check: bool,
}

/// Writes every document, or checks it.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    let mut stale = Vec::new();
    for (path, arguments) in DOCUMENTS {
        let printed = print(workspace, arguments)?;
        let file = workspace.root().join(path);
        if fs::read(&file).is_ok_and(|found| found == printed) {
            continue;
        }
        if args.check {
            stale.push(*path);
            continue;
        }
        let folder = file.parent().unwrap_or(workspace.root());
        fs::create_dir_all(folder)
            .and_then(|()| fs::write(&file, printed))
            .map_err(|error| not_writable(&file, &error))?;
        process::step(&format!("Wrote {path}"));
    }
    if !stale.is_empty() {
        bail!(
            "{} is not what the code prints: run `cargo xtask docs`",
            stale.join(", ")
        );
    }
    Ok(())
}

fn print(workspace: &Workspace, arguments: &[&str]) -> anyhow::Result<Vec<u8>> {
    let mut run = process::cargo(workspace);
    run.args(["run", "--quiet", "--locked"]).args(arguments);
    let output = run
        .stderr(Stdio::inherit())
        .output()
        .context("cargo could not be started")?;
    if !output.status.success() {
        bail!(
            "`cargo run {}` failed ({})",
            arguments.join(" "),
            output.status
        );
    }
    Ok(output.stdout)
}
