//! Debian's packages, unpacked into a folder and never installed.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, bail};

use crate::{
    cmd::bare_metal::is_installed,
    process::{self, step},
    workspace::not_writable,
};

/// Whether packages can be fetched and unpacked here.
pub(crate) fn is_here() -> bool {
    is_installed("apt-get") && is_installed("dpkg-deb")
}

/// Fetches `packages` (`name=version`) and unpacks them into `folder`, unless it was made from just
/// these. `what` says on standard error what comes, and how much.
pub(crate) fn unpack(folder: &Path, packages: &[&str], what: &str) -> anyhow::Result<()> {
    let made_from = folder.join("made-from.txt");
    let wanted = packages.join("\n");
    if fs::read_to_string(&made_from).is_ok_and(|made| made == wanted) {
        return Ok(());
    }
    if !is_here() {
        bail!("{what} comes from Debian 12's packages, and this is no Debian");
    }
    step(&format!("Fetching {what} (once; nothing is installed)"));
    let fetched = folder.with_extension("packages");
    for place in [folder, &fetched] {
        if place.exists() {
            fs::remove_dir_all(place).map_err(|error| not_writable(place, &error))?;
        }
        fs::create_dir_all(place).map_err(|error| not_writable(place, &error))?;
    }
    let mut apt = Command::new("apt-get");
    apt.args(["download", "--quiet"]).args(packages);
    apt.current_dir(&fetched).stdout(process::to_stderr());
    process::run(&mut apt).context(
        "Debian 12's packages could not be fetched: run `apt-get update` and this again",
    )?;
    let entries = fs::read_dir(&fetched).map_err(|error| not_writable(&fetched, &error))?;
    for entry in entries {
        let package = entry.context("reading the fetched packages")?.path();
        let mut dpkg = Command::new("dpkg-deb");
        process::run(dpkg.arg("--extract").arg(package).arg(folder))?;
    }
    fs::remove_dir_all(&fetched).map_err(|error| not_writable(&fetched, &error))?;
    fs::write(&made_from, wanted).map_err(|error| not_writable(&made_from, &error))
}
