//! Copies of the checkout to try mutants in.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use anyhow::{Context, bail};

use super::names::SOURCE;
use crate::workspace::not_writable;

/// Copies what git knows or would add, so that a mutant never touches the checkout itself. What is
/// the same stays untouched, and so need not be compiled again. `edit` may change a file's text.
pub(super) fn copy(
    from: &Path,
    to: &Path,
    edit: impl Fn(&str, Vec<u8>) -> Vec<u8>,
) -> anyhow::Result<()> {
    let mut git = Command::new("git");
    git.args([
        "ls-files",
        "-z",
        "--cached",
        "--others",
        "--exclude-standard",
    ]);
    let output = git
        .current_dir(from)
        .output()
        .context("the checkout is copied by `git ls-files`: install git")?;
    if !output.status.success() {
        bail!("`git ls-files` fails: mutants are tried in a clone of the repository");
    }
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let files: BTreeSet<&str> = text.split('\0').filter(|f| !f.is_empty()).collect();
    for file in &files {
        // A file that git knows may be gone.
        let Ok(text) = fs::read(from.join(file)) else {
            continue;
        };
        let wanted = edit(file, text);
        let target = to.join(file);
        if fs::read(&target).is_ok_and(|found| found == wanted) {
            continue;
        }
        fs::create_dir_all(target.parent().unwrap_or(to))
            .and_then(|()| fs::write(&target, wanted))
            .map_err(|error| not_writable(&target, &error))?;
    }
    let sources = to.join(SOURCE);
    for file in super::sources(&sources, SOURCE)? {
        if !files.contains(file.as_str()) {
            fs::remove_file(to.join(&file)).map_err(|error| not_writable(&sources, &error))?;
        }
    }
    Ok(())
}
