//! `cargo xtask doctor`.

use std::process::{Command, Stdio};

use anyhow::bail;

use crate::{mujoco, python::Python, workspace::Workspace};

/// Arguments of `doctor`.
#[derive(clap::Args)]
pub(crate) struct Args {}

/// Says what is there and what is missing; fetches and builds nothing.
pub(crate) fn run(workspace: &Workspace, _args: &Args) -> anyhow::Result<()> {
    let python = Python::find();
    let pip = python.as_ref().ok().map(Python::require_pip);
    let venv = python.as_ref().ok().map(Python::require_venv);
    let checks = [
        ("C compiler", require_cc()),
        (
            "Python 3",
            python
                .as_ref()
                .map(|_| ())
                .map_err(|error| anyhow::anyhow!("{error}")),
        ),
        ("pip", pip.unwrap_or_else(|| bail!("needs Python 3"))),
        ("venv", venv.unwrap_or_else(|| bail!("needs Python 3"))),
    ];
    let missing = checks.iter().filter(|(_, result)| result.is_err()).count();
    for (name, result) in &checks {
        match result {
            Ok(()) => println!("ok       {name}"),
            Err(error) => println!("missing  {name}: {error}"),
        }
    }
    if mujoco::is_installed(workspace) {
        println!("ok       MuJoCo's library");
    } else {
        println!("later    MuJoCo's library: `cargo xtask setup` fetches it");
    }
    if missing > 0 {
        bail!("{missing} of {} things are missing", checks.len());
    }
    Ok(())
}

fn require_cc() -> anyhow::Result<()> {
    let mut cc = Command::new("cc");
    let quiet = cc
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    match quiet.status() {
        Ok(status) if status.success() => Ok(()),
        _ => bail!("Rust links with `cc`: install it (Debian, Ubuntu: `apt-get install gcc`)"),
    }
}
