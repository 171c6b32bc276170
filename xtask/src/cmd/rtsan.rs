//! `cargo xtask rtsan`.

use std::process::Command;

use anyhow::{Context, bail};

use crate::{process, ticks, workspace::Workspace};

/// Arguments of `rtsan`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seeds of the swarm, 1,500 ticks each.
    #[arg(long, value_name = "N", default_value_t = 60)]
    seeds: u64,
}

/// Ticks under the real-time sanitizer, after an allocation that it has to notice.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let mut nightly = Command::new("rustup");
    nightly.args(["run", "nightly", "rustc", "--version"]);
    if !nightly.output().is_ok_and(|output| output.status.success()) {
        bail!("only a nightly compiler has the sanitizer: run `rustup toolchain install nightly`");
    }
    let program = ticks::SANITIZED.program(workspace)?;
    process::step("Control: an allocation where none may be");
    let mut control = Command::new(&program);
    control.args(["realtime", "control"]);
    let output = control
        .output()
        .context("the control could not be started")?;
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() || !said.contains("RealtimeSanitizer") {
        bail!("the sanitizer has not noticed an allocation, so it would prove nothing: {said}");
    }
    let noticed = said.lines().find(|line| line.contains("ERROR"));
    println!("control: {}", noticed.unwrap_or("noticed"));
    process::step("The ticks");
    let mut ticks = Command::new(&program);
    process::run(ticks.args(["realtime", &args.seeds.to_string()]))
}
