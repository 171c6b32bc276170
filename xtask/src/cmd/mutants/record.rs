//! What came out of each file, kept in the repository.

use std::{collections::BTreeMap, fs, path::Path, process::Command};

use anyhow::Context;
use sha2::{Digest, Sha256};

use super::{
    names::{Key, Mutant, SOURCE},
    trial::Outcome,
};
use crate::workspace::not_writable;

/// Where it is kept.
const TRIED: &str = "tests/core/mutants/tried.toml";
const HEAD: &str = "\
# What came out of each file of the core, written by `cargo xtask mutants`: how many mutants were
# caught by a test, ended too late, did not compile, and which survived.
";

/// What is on record, by file.
#[derive(Default)]
pub(super) struct Record {
    pub(super) files: BTreeMap<String, Entry>,
}

/// What came out of one file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Entry {
    /// The file's text, hashed.
    source: String,
    /// The commit on which it was tried.
    pub(super) commit: String,
    pub(super) caught: usize,
    pub(super) timeouts: usize,
    pub(super) unviable: usize,
    pub(super) survivors: Vec<Key>,
}

impl Entry {
    /// Mutants that compile.
    pub(super) fn viable(&self) -> usize {
        self.caught + self.timeouts + self.survivors.len()
    }

    /// Adds another file's counts.
    pub(super) fn add(&mut self, other: &Self) {
        self.caught += other.caught;
        self.timeouts += other.timeouts;
        self.unviable += other.unviable;
        self.survivors.extend(other.survivors.iter().cloned());
    }

    fn read(table: &toml::Value) -> Option<Self> {
        let text = |key: &str| table.get(key)?.as_str().map(str::to_owned);
        let count = |key: &str| usize::try_from(table.get(key)?.as_integer()?).ok();
        let survivors = table.get("survivors")?.as_array()?.iter().map(|survivor| {
            let text = |key: &str| survivor.get(key)?.as_str().map(str::to_owned);
            Some(Key {
                line: text("line")?,
                mutant: text("mutant")?,
            })
        });
        Some(Self {
            source: text("source")?,
            commit: text("commit")?,
            caught: count("caught")?,
            timeouts: count("timeouts")?,
            unviable: count("unviable")?,
            survivors: survivors.collect::<Option<_>>()?,
        })
    }

    fn write(&self, file: &str) -> String {
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let mut text = format!(
            "\n[{}]\nsource = {}\ncommit = {}\ncaught = {}\ntimeouts = {}\nunviable = {}\nsurvivors = [",
            quoted(file),
            quoted(&self.source),
            quoted(&self.commit),
            self.caught,
            self.timeouts,
            self.unviable
        );
        for Key { line, mutant } in &self.survivors {
            let (line, mutant) = (quoted(line), quoted(mutant));
            text += &format!("\n    {{ line = {line}, mutant = {mutant} }},");
        }
        if !self.survivors.is_empty() {
            text += "\n";
        }
        text + "]\n"
    }
}

impl Record {
    /// Reads it.
    pub(super) fn read(root: &Path) -> anyhow::Result<Self> {
        let text = fs::read_to_string(root.join(TRIED)).unwrap_or_default();
        let table: toml::Table = text
            .parse()
            .with_context(|| format!("{TRIED} is no TOML"))?;
        let mut files = BTreeMap::new();
        for (file, entry) in &table {
            let entry = Entry::read(entry)
                .with_context(|| format!("{TRIED}: the entry of {file} is not whole: remove it"))?;
            files.insert(file.clone(), entry);
        }
        Ok(Self { files })
    }

    /// The entry of a file, if the file's text is still the one that was tried.
    pub(super) fn fresh(&self, root: &Path, file: &str) -> anyhow::Result<Option<&Entry>> {
        let Some(entry) = self.files.get(file) else {
            return Ok(None);
        };
        Ok((entry.source == hash(root, file)?).then_some(entry))
    }

    /// Notes what came out of the mutants of a file that were tried, and writes it down. Where
    /// only survivors of an earlier run were tried, the others stay as they were.
    pub(super) fn note(
        &mut self,
        root: &Path,
        file: &str,
        tried: &[&Mutant],
        out: &Outcome,
    ) -> anyhow::Result<()> {
        let before = self.fresh(root, file)?.cloned().unwrap_or_default();
        let tried: Vec<_> = tried.iter().map(|m| m.site(root).key()).collect();
        let still = out.survivors.iter().map(|m| m.site(root).key());
        let others = before.survivors.iter().filter(|key| !tried.contains(key));
        let mut survivors: Vec<_> = still.chain(others.cloned()).collect();
        survivors.sort();
        let entry = Entry {
            source: hash(root, file)?,
            commit: commit(root),
            caught: before.caught + out.caught,
            timeouts: before.timeouts + out.timeouts,
            unviable: before.unviable + out.unviable,
            survivors,
        };
        self.files.insert(file.to_owned(), entry);
        let entries = self.files.iter().map(|(file, entry)| entry.write(file));
        let text = HEAD.to_owned() + &entries.collect::<String>();
        let path = root.join(TRIED);
        fs::write(&path, text).map_err(|error| not_writable(&path, &error))
    }
}

fn hash(root: &Path, file: &str) -> anyhow::Result<String> {
    let path = root.join(SOURCE).join(file);
    let Ok(text) = fs::read(&path) else {
        return Ok(String::new());
    };
    let digest = Sha256::digest(&text);
    Ok(digest
        .iter()
        .take(8)
        .map(|byte| format!("{byte:02x}"))
        .collect())
}

/// The commit that is checked out, for the record.
fn commit(root: &Path) -> String {
    let mut git = Command::new("git");
    git.args(["rev-parse", "--short", "HEAD"]).current_dir(root);
    let output = git.output().ok().filter(|output| output.status.success());
    output.map_or_else(
        || "unknown".to_owned(),
        |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_read_as_it_was_written() {
        let key = Key {
            line: r#"a("b") < 'c'"#.to_owned(),
            mutant: "9: replace < with <= in a".to_owned(),
        };
        let entry = Entry {
            source: "00ff".to_owned(),
            commit: "abc".to_owned(),
            caught: 3,
            timeouts: 1,
            unviable: 2,
            survivors: vec![key.clone(), key],
        };
        let table: toml::Table = entry.write("recovery/pick.rs").parse().expect("TOML");
        assert_eq!(Entry::read(&table["recovery/pick.rs"]), Some(entry.clone()));
        assert_eq!(entry.viable(), 6);
    }
}
