//! Reads results, line by line: what is wrong is named and left out, the rest is kept.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sim_harness::evaluation::{EpisodeRecord, SCHEMA};

use crate::ReportError;

/// Something in the results that is not an episode, or contradicts another.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: usize,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
}

impl core::fmt::Display for Problem {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            file,
            line,
            what,
            remedy,
        } = self;
        write!(f, "{file}:{line}: {what}; {remedy}")
    }
}

/// The results of some folders.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The episodes, in the order of files and lines, each once.
    pub records: Vec<EpisodeRecord>,
    /// What could not be used.
    pub problems: Vec<Problem>,
    /// Lines that repeat an episode exactly.
    pub repeated: usize,
    /// The files that were read.
    pub files: Vec<String>,
}

/// Reads all `*.jsonl` files of some folders.
///
/// # Errors
/// [`ReportError::Io`] if a folder or file can't be read, [`ReportError::Empty`] if a folder has
/// no results at all.
pub fn load(folders: &[PathBuf]) -> Result<Loaded, ReportError> {
    let mut all = Reader::default();
    for folder in folders {
        let paths = results_in(folder)?;
        if paths.is_empty() {
            return Err(ReportError::Empty(folder.display().to_string()));
        }
        for path in paths {
            let bytes = fs::read(&path).map_err(|e| ReportError::io(&path, e))?;
            all.read(&path.display().to_string(), &bytes);
        }
    }
    Ok(all.loaded)
}

fn results_in(folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(|e| ReportError::io(folder, e))? {
        let path = entry.map_err(|e| ReportError::io(folder, e))?.path();
        if path.extension().is_some_and(|e| e == "jsonl") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

#[derive(Default)]
struct Reader {
    loaded: Loaded,
    /// Where each episode was found: its place among the records, file and line.
    seen: HashMap<String, (usize, String, usize)>,
}

impl Reader {
    fn read(&mut self, file: &str, bytes: &[u8]) {
        self.loaded.files.push(file.to_owned());
        let ends = bytes.ends_with(b"\n");
        let lines: Vec<&[u8]> = bytes.split(|b| *b == b'\n').collect();
        // What follows the last newline is empty in a whole file.
        let count = if ends { lines.len() - 1 } else { lines.len() };
        for (i, line) in lines.into_iter().take(count).enumerate() {
            if line.trim_ascii().is_empty() {
                continue;
            }
            let cut = !ends && i + 1 == count;
            match episode(line) {
                Ok(record) => self.keep(file, i + 1, record),
                Err(_) if cut => self.problem(
                    file,
                    i + 1,
                    "the last line is cut off".to_owned(),
                    "the run was killed: the same `fitmac eval` command plays what is missing",
                ),
                Err((what, remedy)) => self.problem(file, i + 1, what, remedy),
            }
        }
    }

    fn keep(&mut self, file: &str, line: usize, record: EpisodeRecord) {
        if let Some(what) = contradiction(&record) {
            let remedy = "delete the line and run `fitmac eval` again";
            return self.problem(file, line, what, remedy);
        }
        let key = record.key();
        if let Some((at, other_file, other_line)) = self.seen.get(&key) {
            if self.loaded.records[*at] == record {
                self.loaded.repeated += 1;
                return;
            }
            let what = format!("{key} has another result at {other_file}:{other_line}");
            let remedy = "two versions are mixed: report on their folders separately";
            return self.problem(file, line, what, remedy);
        }
        let place = (self.loaded.records.len(), file.to_owned(), line);
        self.seen.insert(key, place);
        self.loaded.records.push(record);
    }

    fn problem(&mut self, file: &str, line: usize, what: String, remedy: &str) {
        self.loaded.problems.push(Problem {
            file: file.to_owned(),
            line,
            what,
            remedy: remedy.to_owned(),
        });
    }
}

/// What a line says it is.
#[derive(Deserialize)]
struct Head {
    schema: Option<u32>,
}

fn episode(line: &[u8]) -> Result<EpisodeRecord, (String, &'static str)> {
    let head: Head = serde_json::from_slice(line).map_err(|e| {
        let what = format!("no line of JSON: {}", plain(&e));
        (what, "delete the line and run `fitmac eval` again")
    })?;
    match head.schema {
        Some(SCHEMA) => {}
        Some(other) => {
            let what = format!("field `schema` is {other}, this program reads {SCHEMA}");
            return Err((
                what,
                "report with the program that wrote it, or evaluate into a new folder",
            ));
        }
        None => {
            return Err((
                "field `schema` is missing".to_owned(),
                "name folders that `fitmac eval` wrote, and no others",
            ));
        }
    }
    serde_json::from_slice(line).map_err(|e| {
        let what = format!("no episode: {}", plain(&e));
        (what, "delete the line and run `fitmac eval` again")
    })
}

/// The error without its position: a line's number within itself is always 1.
fn plain(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let column = error.column();
    match text.rsplit_once(" at line ") {
        Some((what, _)) => format!("{what} (column {column})"),
        None => text,
    }
}

/// What can't be true of one episode.
fn contradiction(record: &EpisodeRecord) -> Option<String> {
    let EpisodeRecord {
        success,
        intervened,
        activations,
        ..
    } = record;
    if *success == record.failure.is_some() {
        return Some("field `failure` contradicts `success`".to_owned());
    }
    if *intervened == activations.is_empty() {
        return Some("field `activations` contradicts `intervened`".to_owned());
    }
    if activations.iter().any(|a| a.end_step < a.start_step) {
        return Some("field `activations`: one ends before it starts".to_owned());
    }
    None
}
