//! Cargo's additional commands, each with its version, kept in the checkout.

use std::path::PathBuf;

use anyhow::Context;

use crate::{
    process::{self, step},
    workspace::Workspace,
};

/// The folder of a tool's program; installs it first where it is missing.
pub(crate) fn install(workspace: &Workspace, name: &str, version: &str) -> anyhow::Result<PathBuf> {
    let folder = workspace
        .root()
        .join(format!("third_party/{name}-{version}"));
    let programs = folder.join("bin");
    // Cargo writes the program last.
    if programs.join(name).exists() {
        return Ok(programs);
    }
    step(&format!(
        "Building {name} {version} into {} (once, some minutes)",
        workspace.shown(&folder)
    ));
    let mut cargo = process::cargo(workspace);
    cargo
        .args(["install", "--quiet", "--locked", "--root"])
        .arg(&folder)
        .args([name, "--version", &format!("={version}")])
        .env_remove("RUSTFLAGS");
    process::run(&mut cargo).with_context(|| {
        format!("{name} comes from crates.io: check the network or the proxy and run this again")
    })?;
    Ok(programs)
}
