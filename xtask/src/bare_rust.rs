//! A compiler for processors without an operating system: the installed one where it has their
//! libraries, else Debian's, unpacked under `target/bare-metal` and never installed.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, bail};

use crate::{debian, workspace::Workspace};

/// Debian 12's compiler with the source of its core library.
const PACKAGES: [&str; 5] = [
    "rustc-web=1.96.0+dfsg1-1~deb12u2",
    "libstd-rust-web-1.96=1.96.0+dfsg1-1~deb12u2",
    "libstd-rust-web-dev=1.96.0+dfsg1-1~deb12u2",
    "rust-web-src=1.96.0+dfsg1-1~deb12u2",
    "libllvm22=1:22.1.8-1~deb12u1",
];

/// Where the compiler comes from.
pub(crate) enum Compiler {
    /// The installed one.
    Installed,
    /// Debian's, unpacked in this folder.
    Debian(PathBuf),
}

impl Compiler {
    /// The installed compiler if it has all `targets`; else Debian's is fetched.
    pub(crate) fn find(workspace: &Workspace, targets: &[&str]) -> anyhow::Result<Self> {
        if targets.iter().all(|target| has_target(target)) {
            return Ok(Self::Installed);
        }
        if !debian::is_here() {
            bail!(
                "the compiler has no libraries for {}: run `rustup target add {}` and this again",
                targets.join(" and "),
                targets.join(" ")
            );
        }
        let folder = workspace.root().join("target/bare-metal/debian");
        debian::unpack(
            &folder,
            &PACKAGES,
            "Debian's Rust compiler for bare metal, 137 MB",
        )
        .context("or `rustup target add` the targets")?;
        Ok(Self::Debian(folder))
    }

    /// What it calls itself.
    pub(crate) fn version(&self) -> anyhow::Result<String> {
        let mut command = match self {
            Self::Installed => Command::new("rustc"),
            Self::Debian(folder) => {
                let mut rustc = Command::new(folder.join("usr/bin/rustc"));
                rustc.env("LD_LIBRARY_PATH", libraries(folder));
                rustc
            }
        };
        let output = command.arg("--version").output();
        let output = output.context("the compiler could not be started")?;
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// Makes cargo use it.
    pub(crate) fn equip(&self, cargo: &mut Command) {
        if let Self::Debian(folder) = self {
            cargo.env("RUSTC", folder.join("usr/bin/rustc"));
            cargo.env("LD_LIBRARY_PATH", libraries(folder));
            // Debian ships no core library for these targets, but its source: cargo builds it.
            cargo.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
        }
    }
}

fn libraries(folder: &Path) -> PathBuf {
    folder.join("usr/lib/x86_64-linux-gnu")
}

fn has_target(target: &str) -> bool {
    let mut rustc = Command::new("rustc");
    rustc.args(["--print=target-libdir", "--target", target]);
    let output = rustc.stderr(Stdio::null()).output();
    output.is_ok_and(|output| {
        let folder = String::from_utf8_lossy(&output.stdout);
        Path::new(folder.trim()).is_dir()
    })
}
