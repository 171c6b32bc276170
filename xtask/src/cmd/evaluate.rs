//! `cargo xtask evaluate`.

use std::path::PathBuf;

use anyhow::bail;

use crate::{mujoco, process, workspace::Workspace};

/// Every experiment, what matters most first. They share episodes, which are played once.
const PRESETS: &str =
    "main,harm,backbones,ablation,seeds,sweeps,contrast,displacement,ablation-pi05,learned";
/// Episodes a task of the first round: all cells of the main table are there early.
const FIRST_ROUND: &str = "10";

/// Arguments of `evaluate`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  cargo xtask evaluate                        everything: hours
  cargo xtask evaluate --presets main         the main table only
  cargo xtask evaluate --page docs/evaluation.md

Interrupt it when you like: the same command goes on from there. Progress and the
time that is left are shown as it runs.")]
pub(crate) struct Args {
    /// Experiments, by the names of `fitmac eval --preset`.
    #[arg(long, value_name = "NAMES", default_value = PRESETS)]
    presets: String,
    /// The folder for results; the report goes into its folder `report`.
    #[arg(long, value_name = "FOLDER", default_value = "out/evaluation")]
    out: PathBuf,
    /// Threads; 0 for all cores.
    #[arg(long, default_value_t = 0)]
    jobs: usize,
    /// Failed and saved episodes that are played again for pictures.
    #[arg(long, value_name = "N", default_value_t = 200)]
    pictures: usize,
    /// Writes the documentation's page, too.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Make the report of what is there, without playing.
    #[arg(long)]
    report_only: bool,
}

/// Builds, plays what is missing, and makes the report.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    process::step("Building (a few minutes the first time)");
    let mut build = process::cargo(workspace);
    build.args(["build", "--release", "--locked", "--package=fitmac-cli"]);
    process::run(&mut build)?;
    if !args.report_only {
        if args.presets.split(',').any(|name| name == "main") {
            process::step("Playing the first ten episodes of each cell of the main table");
            play(workspace, args, "main", &["--episodes", FIRST_ROUND])?;
        }
        process::step("Playing the rest");
        play(workspace, args, &args.presets, &[])?;
    }
    process::step("Making the report");
    let mut report = fitmac(workspace, "report");
    report.arg(&args.out);
    report.arg("--out").arg(args.out.join("report"));
    report.args(["--pictures", &args.pictures.to_string()]);
    if let Some(page) = &args.page {
        report.arg("--page").arg(page);
    }
    process::become_command(&mut report)
}

fn play(workspace: &Workspace, args: &Args, presets: &str, more: &[&str]) -> anyhow::Result<()> {
    let mut eval = fitmac(workspace, "eval");
    eval.args(["--preset", presets]).args(more);
    eval.args(["--jobs", &args.jobs.to_string()]);
    eval.arg("--out").arg(&args.out);
    let status = eval.status()?;
    if !status.success() {
        bail!("the evaluation ended early ({status}): the same command goes on from there");
    }
    Ok(())
}

fn fitmac(workspace: &Workspace, command: &str) -> std::process::Command {
    let mut cargo = process::cargo(workspace);
    cargo.args([
        "run",
        "--release",
        "--locked",
        "--quiet",
        "--package=fitmac-cli",
        "--",
        command,
    ]);
    cargo
}
