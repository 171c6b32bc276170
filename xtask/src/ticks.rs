//! The harness `benches/ticks`: ticks of the core for a tool that watches them. It is a workspace
//! of its own, with profiles of its own.

use std::{
    path::PathBuf,
    process::{Command, Stdio},
};

use anyhow::{Context, bail};

use crate::{process, workspace::Workspace};

/// How it is compiled.
#[derive(Clone, Copy)]
pub(crate) struct Build {
    /// What a person calls it.
    pub(crate) name: &'static str,
    profile: &'static str,
    rustflags: &'static str,
    toolchain: Option<&'static str>,
}

/// Without optimisation.
pub(crate) const DEBUG: Build = Build {
    name: "debug",
    profile: "dev",
    rustflags: "",
    toolchain: None,
};
/// Optimised, crate by crate.
pub(crate) const RELEASE: Build = Build {
    name: "release",
    profile: "plain",
    ..DEBUG
};
/// Optimised as a whole: what is counted and measured.
pub(crate) const LTO: Build = Build {
    name: "link-time optimised",
    profile: "release",
    ..DEBUG
};
/// The same with every instruction that this processor has.
pub(crate) const NATIVE: Build = Build {
    name: "this processor only",
    rustflags: "-Ctarget-cpu=native",
    ..LTO
};
/// With the real-time sanitizer, which only a nightly compiler has.
pub(crate) const SANITIZED: Build = Build {
    name: "real-time sanitizer",
    rustflags: "-Zsanitizer=realtime --cfg rtsan",
    toolchain: Some("nightly"),
    ..RELEASE
};

const TARGET: &str = "x86_64-unknown-linux-gnu";

impl Build {
    /// Builds the harness.
    pub(crate) fn program(&self, workspace: &Workspace) -> anyhow::Result<PathBuf> {
        let mut folder = workspace.root().join("target/ticks");
        let mut cargo = match self.toolchain {
            None => process::cargo(workspace),
            Some(toolchain) => {
                let mut rustup = Command::new("rustup");
                rustup.args(["run", toolchain, "cargo"]);
                rustup.env_remove("RUSTUP_TOOLCHAIN");
                rustup
            }
        };
        cargo.current_dir(workspace.root().join("benches/ticks"));
        cargo.args(["build", "--quiet", "--locked", "--profile", self.profile]);
        cargo.env_remove("RUSTFLAGS");
        if !self.rustflags.is_empty() {
            // A target that is named keeps the flags from build scripts.
            cargo.env("RUSTFLAGS", self.rustflags);
            cargo.args(["--target", TARGET]);
            folder = folder.with_file_name(format!("ticks-{}", self.name.replace(' ', "-")));
        }
        process::step(&format!("Building the ticks: {}", self.name));
        process::run(cargo.arg("--target-dir").arg(&folder))?;
        if !self.rustflags.is_empty() {
            folder.push(TARGET);
        }
        let profile = match self.profile {
            "dev" => "debug",
            other => other,
        };
        Ok(folder.join(profile).join("ticks"))
    }

    /// Builds it and runs it with these words; gives what it prints.
    pub(crate) fn says(&self, workspace: &Workspace, words: &[&str]) -> anyhow::Result<String> {
        let program = self.program(workspace)?;
        let mut ticks = Command::new(program);
        ticks.args(words).stderr(Stdio::inherit());
        let output = ticks.output().context("the ticks could not be started")?;
        if !output.status.success() {
            bail!("the ticks ended with {} (see above)", output.status);
        }
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }
}
