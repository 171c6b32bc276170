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
    /// Also draw the README's pictures anew: runs the demo (two minutes).
    #[arg(long, conflicts_with = "check")]
    pub(super) pictures: bool,
}

/// The README's pictures, and the files of the demo that they are copies of.
const PICTURES: &[(&str, &str)] = &[
    ("docs/pictures/demo-strip.png", "fit-mac/strip.png"),
    ("docs/pictures/demo-plot.png", "fit-mac/plot.png"),
];

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
    if args.pictures {
        draw(workspace)?;
    }
    Ok(())
}

fn draw(workspace: &Workspace) -> anyhow::Result<()> {
    process::step("Running the demo for its pictures");
    let out = workspace.root().join("out/pictures");
    let mut demo = process::cargo(workspace);
    demo.args([
        "run",
        "--release",
        "--quiet",
        "--locked",
        "--package=fitmac-cli",
        "--",
    ])
    .args(["demo", "--seed", "3", "--out"])
    .arg(&out);
    process::run(&mut demo)?;
    for (picture, drawn) in PICTURES {
        let file = workspace.root().join(picture);
        fs::create_dir_all(file.parent().unwrap_or(workspace.root()))
            .and_then(|()| fs::copy(out.join(drawn), &file))
            .map_err(|error| not_writable(&file, &error))?;
        process::step(&format!("Drew {picture}"));
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
