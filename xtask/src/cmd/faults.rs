//! `cargo xtask faults`.

use std::{
    fs,
    process::Stdio,
    time::{SystemTime, UNIX_EPOCH},
};

use anyhow::{Context, bail};

use crate::{
    mujoco, process,
    workspace::{Workspace, not_writable},
};

/// Where the measurements stand.
const MEASURED: &str = "tests/data/faults.json";

/// Arguments of `faults`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// What the page says of the run: the machine, how busy it was.
    #[arg(long, value_name = "TEXT", default_value = "two cores")]
    machine: String,
}

/// Runs the tests of faults one by one and keeps what they measure.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    mujoco::install(workspace)?;
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs();
    let folder = std::env::temp_dir().join(format!("fitmac-faults-{seconds}"));
    fs::create_dir_all(&folder).map_err(|error| not_writable(&folder, &error))?;
    process::step("Running every fault against a real controller (about two minutes)");
    let mut test = process::cargo(workspace);
    test.args([
        "test",
        "--locked",
        "--package=fitmac-tests",
        "--test=faults",
    ]);
    test.args(["--", "--test-threads=1"]);
    process::run(test.env("FITMAC_FAULTS", &folder))?;
    let mut gather = process::cargo(workspace);
    gather.args(["run", "--quiet", "--locked", "--package=fitmac-tests"]);
    gather
        .args(["--bin=gather", "--"])
        .arg(&folder)
        .arg(&args.machine);
    let output = gather
        .stderr(Stdio::inherit())
        .output()
        .context("cargo could not be started")?;
    if !output.status.success() {
        bail!("the measurements could not be gathered");
    }
    let file = workspace.root().join(MEASURED);
    fs::write(&file, output.stdout).map_err(|error| not_writable(&file, &error))?;
    fs::remove_dir_all(&folder).context("removing what was measured")?;
    process::step(&format!(
        "Wrote {MEASURED}; `cargo xtask docs` makes the page"
    ));
    Ok(())
}
