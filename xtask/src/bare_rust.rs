//! A compiler for processors without an operating system: the installed one where it has their
//! libraries, else Debian's, unpacked under `target/bare-metal` and never installed.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, bail};

use crate::{
    cmd::bare_metal::is_installed,
    process::{self, step},
    workspace::{Workspace, not_writable},
};

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
        if !is_installed("apt-get") || !is_installed("dpkg-deb") {
            bail!(
                "the compiler has no libraries for {}: run `rustup target add {}` and this again",
                targets.join(" and "),
                targets.join(" ")
            );
        }
        let folder = workspace.root().join("target/bare-metal/debian");
        unpack_debian(&folder)?;
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

fn unpack_debian(folder: &Path) -> anyhow::Result<()> {
    let made_from = folder.join("made-from.txt");
    let wanted = PACKAGES.join("\n");
    if fs::read_to_string(&made_from).is_ok_and(|made| made == wanted) {
        return Ok(());
    }
    step("Fetching Debian's Rust compiler for bare metal (once, 137 MB; nothing is installed)");
    let packages = folder.with_extension("packages");
    for place in [folder, &packages] {
        if place.exists() {
            fs::remove_dir_all(place).map_err(|error| not_writable(place, &error))?;
        }
        fs::create_dir_all(place).map_err(|error| not_writable(place, &error))?;
    }
    let mut apt = Command::new("apt-get");
    apt.args(["download", "--quiet"]).args(PACKAGES);
    apt.current_dir(&packages).stdout(process::to_stderr());
    process::run(&mut apt).context(
        "Debian 12's packages could not be fetched: run `apt-get update` and this again, or \
         `rustup target add` the targets",
    )?;
    let entries = fs::read_dir(&packages).map_err(|error| not_writable(&packages, &error))?;
    for entry in entries {
        let package = entry.context("reading the fetched packages")?.path();
        let mut dpkg = Command::new("dpkg-deb");
        process::run(dpkg.arg("--extract").arg(package).arg(folder))?;
    }
    fs::remove_dir_all(&packages).map_err(|error| not_writable(&packages, &error))?;
    fs::write(&made_from, wanted).map_err(|error| not_writable(&made_from, &error))
}
