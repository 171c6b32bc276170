//! `cargo xtask mutants`: every small change of the core must be noticed by a test.
//!
//! cargo-mutants lists the changes. They are tried in a copy of the checkout (`out/mutants`), file
//! by file; what came out of a file is on record in `tests/core/mutants/tried.toml`, so that the
//! next run goes on where this one ended, and tries a file anew once its text has changed.
//! `tests/core/mutants/survivors.toml` lists, with reasons, the mutants that may survive.

mod copy;
mod names;
mod record;
mod trial;

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, bail};

use self::{
    names::{Mutant, Site},
    record::{Entry, Record},
    trial::Trial,
};
use crate::{
    lists::{self, Exception},
    process::step,
    workspace::Workspace,
};

/// The mutants that may survive, with reasons.
const SURVIVORS: &str = "tests/core/mutants/survivors.toml";
/// Explained survivors, of all viable mutants, at most.
const EXPLAINED_SHARE_MAX: f64 = 0.03;
/// These files first: what decides.
const FIRST: [&str; 25] = [
    "gate.rs",
    "diagnosis.rs",
    "monitor.rs",
    "phase.rs",
    "route.rs",
    "ladder.rs",
    "filter.rs",
    "lock.rs",
    "queue.rs",
    "tracking.rs",
    "signals.rs",
    "recovery/mod.rs",
    "recovery/active.rs",
    "recovery/stuck.rs",
    "recovery/scene.rs",
    "recovery/pick.rs",
    "recovery/place.rs",
    "recovery/geometry.rs",
    "recovery/waypoint.rs",
    "intake/chunk.rs",
    "intake/grounding.rs",
    "intake/robot.rs",
    "decide.rs",
    "controller/act.rs",
    "controller/play.rs",
];

/// Arguments of `mutants`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only this file, as `gate.rs` or `recovery/pick.rs`; may be given again.
    #[arg(long = "file", value_name = "FILE")]
    files: Vec<String>,
    /// Only what this diff touches (as `git diff` writes it); nothing goes on record.
    #[arg(long, value_name = "DIFF", conflicts_with = "files")]
    in_diff: Option<std::path::PathBuf>,
    /// Copies of the checkout to work in side by side.
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: u32,
    /// Try nothing: check the list and the record, and say what is left to try.
    #[arg(long)]
    check: bool,
}

/// Tries what has not been tried yet; fails on a survivor that is not on the list.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let root = workspace.root();
    let explained = lists::read(root, Path::new(SURVIVORS), "survivor", Some("mutant"))?;
    let mut record = Record::read(root)?;
    if args.check {
        return judge(&record, root, &explained, None);
    }
    let trial = Trial::new(workspace, args.jobs.max(1))?;
    let mutants = trial.list(args.in_diff.as_deref())?;
    if args.in_diff.is_some() {
        step(&format!("{} mutants in this diff", mutants.len()));
        let all: Vec<&Mutant> = mutants.iter().collect();
        let outcome = trial.run(&all)?;
        return complain(&open(root, &outcome.survivors, &explained)?);
    }
    let left = left(root, &record, &explained, &mutants, &args.files)?;
    let total: usize = left.iter().map(|(_, todo)| todo.len()).sum();
    step(&format!("{total} mutants in {} files", left.len()));
    for (n, (file, todo)) in left.iter().enumerate() {
        step(&format!(
            "{file}: {} mutants (file {} of {})",
            todo.len(),
            n + 1,
            left.len()
        ));
        let outcome = trial.run(todo)?;
        record.note(root, file, todo, &outcome)?;
    }
    judge(&record, root, &explained, Some(&mutants))
}

/// The files that are to be tried, in order, with their mutants: all of a file that has changed
/// since it was tried, or the survivors that have no reason yet.
fn left<'a>(
    root: &Path,
    record: &Record,
    explained: &[Exception],
    mutants: &'a [Mutant],
    only: &[String],
) -> anyhow::Result<Vec<(String, Vec<&'a Mutant>)>> {
    let mut files: BTreeMap<(usize, &str), Vec<&Mutant>> = BTreeMap::new();
    for mutant in mutants {
        let short = mutant.short_file();
        let rank = FIRST.iter().position(|first| *first == short);
        let rank = rank.unwrap_or(FIRST.len());
        files.entry((rank, short)).or_default().push(mutant);
    }
    for name in only {
        if !files.keys().any(|(_, short)| short == name) {
            bail!("--file {name}: fitmac-core/src has no such file with mutants");
        }
    }
    let mut left = Vec::new();
    for ((_, short), mut todo) in files {
        if !only.is_empty() && !only.iter().any(|name| name == short) {
            continue;
        }
        if let Some(entry) = record.fresh(root, short)? {
            todo.retain(|mutant| {
                let site = mutant.site(root);
                let has_reason = explained.iter().any(|e| site.is_explained_by(e));
                !has_reason && entry.survivors.contains(&site.key())
            });
        }
        if !todo.is_empty() {
            left.push((short.to_owned(), todo));
        }
    }
    Ok(left)
}

/// The survivors that are not on the list.
fn open<'a>(
    root: &Path,
    survivors: &'a [Mutant],
    explained: &[Exception],
) -> anyhow::Result<Vec<Site<'a>>> {
    let mut open = Vec::new();
    for mutant in survivors {
        let site = mutant.site(root);
        if !explained.iter().any(|e| site.is_explained_by(e)) {
            open.push(site);
        }
    }
    Ok(open)
}

/// Fails with drafts of the entries that are missing.
fn complain(open: &[Site<'_>]) -> anyhow::Result<()> {
    if open.is_empty() {
        println!("cargo xtask mutants: no mutant survives without a reason");
        return Ok(());
    }
    for site in open {
        println!("{}", site.draft());
    }
    bail!(
        "{} mutants survive: write a test that notices them, or their reason into {SURVIVORS}",
        open.len()
    )
}

/// Says what is on record; fails on a survivor without a reason, on too many with one, and on a
/// reason for one that no longer survives.
fn judge(
    record: &Record,
    root: &Path,
    explained: &[Exception],
    mutants: Option<&[Mutant]>,
) -> anyhow::Result<()> {
    let mut sum = Entry::default();
    let (mut open, mut reasons) = (Vec::new(), 0);
    println!("file                      viable  caught  late  survive  unexplained  tried at");
    for (file, entry) in &record.files {
        let fresh = record.fresh(root, file)?.is_some();
        let keys = entry.survivors.iter();
        let nameless: Vec<_> = keys
            .filter(|k| !explained.iter().any(|e| k.is(file, e)))
            .collect();
        println!(
            "{file:<24} {:>7} {:>7} {:>5} {:>8} {:>12}  {}{}",
            entry.viable(),
            entry.caught,
            entry.timeouts,
            entry.survivors.len(),
            nameless.len(),
            entry.commit,
            if fresh { "" } else { ", changed since" },
        );
        reasons += entry.survivors.len() - nameless.len();
        open.extend(nameless.into_iter().map(|key| key.draft(file)));
        sum.add(entry);
    }
    for e in explained {
        let short = names::short(&e.file);
        let Some(entry) = record.fresh(root, short)? else {
            continue;
        };
        if !entry.survivors.iter().any(|key| key.is(short, e)) {
            bail!(
                "{SURVIVORS}: {} at `{}` does not survive: remove it",
                e.what,
                e.line
            );
        }
    }
    let viable = sum.viable().max(1);
    let share = reasons as f64 / viable as f64;
    println!(
        "{} files: {} viable mutants, {} survive, {reasons} of them with a reason ({:.1} %); {} do \
         not compile",
        record.files.len(),
        sum.viable(),
        sum.survivors.len(),
        share * 100.0,
        sum.unviable
    );
    let whole = untried(root, record, explained, mutants)?;
    if !open.is_empty() {
        open.iter().for_each(|draft| println!("{draft}"));
        bail!(
            "{} mutants survive: write tests that notice them, or their reasons into {SURVIVORS}",
            open.len()
        );
    }
    // Of a few files a share says little.
    if whole && share >= EXPLAINED_SHARE_MAX {
        bail!(
            "{:.1} % survive with a reason, 3 % is the bound",
            share * 100.0
        );
    }
    Ok(())
}

/// Says which files are not on record as they are now; true if it is known that there is none.
fn untried(
    root: &Path,
    record: &Record,
    explained: &[Exception],
    mutants: Option<&[Mutant]>,
) -> anyhow::Result<bool> {
    let mut missing = Vec::new();
    match mutants {
        Some(mutants) => {
            let left = left(root, record, explained, mutants, &[])?;
            missing.extend(left.into_iter().map(|(file, _)| file));
        }
        None => {
            for short in sources(&root.join("fitmac-core/src"), "")? {
                if record.fresh(root, &short)?.is_none() {
                    missing.push(short);
                }
            }
        }
    }
    if !missing.is_empty() {
        println!(
            "not tried as they are now (or without mutants): {}",
            missing.join(", ")
        );
    }
    Ok(mutants.is_some() && missing.is_empty())
}

/// The source files below a folder, but for tests.
fn sources(folder: &Path, prefix: &str) -> anyhow::Result<Vec<String>> {
    let mut found = Vec::new();
    let entries =
        fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            found.extend(sources(&path, &format!("{prefix}{name}/"))?);
        } else if name != "tests.rs" {
            found.push(format!("{prefix}{name}"));
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The short form: nothing is tried, but the list and the record are sound.
    #[test]
    fn the_list_and_the_record_are_sound() {
        let workspace = Workspace::at(None);
        let check = Args {
            files: Vec::new(),
            in_diff: None,
            jobs: 1,
            check: true,
        };
        if let Err(error) = run(&workspace, &check) {
            panic!("{error:#}");
        }
    }
}
