//! Results on disk: one line of JSON an episode, appended as they come.
//!
//! A kill in the middle loses at most the line that was being written: a half line at the end is
//! cut off when the file is opened again. Results of another build of the program are not mixed
//! with those of this one, and two programs never write the same file.

use std::collections::{HashMap, HashSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::grid::{EpisodeSpec, Shard};
use super::record::{CORE_VERSION, EpisodeRecord};
use crate::error::SimError;

/// Where results go, and which ones count as there already.
#[derive(Clone, Copy, Debug)]
pub struct Destination<'a> {
    /// The folder. Every `*.jsonl` in it is looked through for episodes.
    pub folder: &'a Path,
    /// The share that is run; it has a file of its own.
    pub shard: Shard,
    /// Other builds whose episodes count as played, as they stand in the field `core`: for changes
    /// that are known to decide nothing.
    pub accepted_builds: &'a [String],
}

impl<'a> Destination<'a> {
    /// A whole grid, played by this build only.
    #[must_use]
    pub fn whole(folder: &'a Path) -> Self {
        Self {
            folder,
            shard: Shard::WHOLE,
            accepted_builds: &[],
        }
    }
}

/// A file of results that grows.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    file: File,
    /// The build that played, by the key of the episode.
    done: HashMap<String, String>,
    accepted: Vec<String>,
    /// Held as long as the file may be written.
    _lock: File,
}

impl Store {
    /// Opens or makes the file of a shard in a folder, and reads which episodes the folder
    /// already has.
    ///
    /// # Errors
    /// [`SimError::Io`] if the folder or file can't be made or read, [`SimError::Data`] if a file
    /// holds something else than episodes, [`SimError::OtherBuild`] if another build played them,
    /// [`SimError::Busy`] if another program writes there.
    pub fn open(destination: &Destination<'_>) -> Result<Self, SimError> {
        let Destination {
            folder,
            shard,
            accepted_builds,
        } = *destination;
        std::fs::create_dir_all(folder).map_err(|e| SimError::io(folder, e))?;
        let path = folder.join(format!("episodes-{}-of-{}.jsonl", shard.index, shard.count));
        let lock = lock(&path.with_extension("lock"))?;
        let mut done = HashMap::new();
        for other in results_in(folder)?.iter().filter(|other| **other != path) {
            let text = std::fs::read_to_string(other).map_err(|e| SimError::io(other, e))?;
            note(&mut done, other, whole_lines(&text), accepted_builds)?;
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(|e| SimError::io(&path, e))?;
        let mut text = String::new();
        file.read_to_string(&mut text)
            .map_err(|e| SimError::io(&path, e))?;
        let whole = whole_lines(&text);
        note(&mut done, &path, whole, accepted_builds)?;
        if whole.len() < text.len() {
            file.set_len(whole.len() as u64)
                .map_err(|e| SimError::io(&path, e))?;
        }
        file.seek(SeekFrom::End(0))
            .map_err(|e| SimError::io(&path, e))?;
        Ok(Self {
            path,
            file,
            done,
            accepted: accepted_builds.to_vec(),
            _lock: lock,
        })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether an episode is already there; `build` is what would play it now.
    ///
    /// # Errors
    /// [`SimError::OtherBuild`] if it was played on another version of a suite's file.
    pub fn has(&self, spec: &EpisodeSpec, build: &str) -> Result<bool, SimError> {
        let Some(found) = self.done.get(&spec.key()) else {
            return Ok(false);
        };
        if suite_file(found) == suite_file(build) || self.accepted.contains(found) {
            Ok(true)
        } else {
            Err(other_build(&self.path, found, build))
        }
    }

    /// Adds an episode; it is on its way to the disk when this returns.
    ///
    /// # Errors
    /// [`SimError::Io`] if it can't be written, for example on a full disk. Nothing that was
    /// written before is lost, and later ones can be added once there is room.
    pub fn append(&mut self, record: &EpisodeRecord) -> Result<(), SimError> {
        let mut line = line_of(record)?;
        line.push('\n');
        let end = self
            .file
            .stream_position()
            .map_err(|e| SimError::io(&self.path, e))?;
        if let Err(error) = self.file.write_all(line.as_bytes()) {
            // Half a line would be cut off by the next run; better not to leave it at all.
            let _ = self.file.set_len(end);
            let _ = self.file.seek(SeekFrom::Start(end));
            return Err(SimError::io(&self.path, error));
        }
        self.done.insert(record.key(), record.core.clone());
        Ok(())
    }

    /// Puts the lines into the grid's order, so that the file does not depend on who finished
    /// first. The old file stays until the new one is complete.
    ///
    /// # Errors
    /// [`SimError::Io`] if the new file can't be written.
    pub fn sort(mut self, order: &[EpisodeSpec]) -> Result<(), SimError> {
        self.file
            .seek(SeekFrom::Start(0))
            .map_err(|e| SimError::io(&self.path, e))?;
        let mut text = String::new();
        self.file
            .read_to_string(&mut text)
            .map_err(|e| SimError::io(&self.path, e))?;
        let place: HashMap<String, usize> = order
            .iter()
            .enumerate()
            .map(|(i, spec)| (spec.key(), i))
            .collect();
        let mut records = parse(&self.path, &text)?;
        // Episodes of another grid keep their order, after those of this one.
        records.sort_by_key(|r| place.get(&r.key()).copied().unwrap_or(usize::MAX));
        let mut sorted = String::with_capacity(text.len());
        for record in &records {
            sorted.push_str(&line_of(record)?);
            sorted.push('\n');
        }
        let fresh = self.path.with_extension("jsonl.new");
        replace(&self.path, &fresh, sorted.as_bytes()).map_err(|e| {
            let _ = std::fs::remove_file(&fresh);
            SimError::io(&fresh, e)
        })
    }

    /// Reads all results of a folder, without those that appear twice.
    ///
    /// # Errors
    /// [`SimError::Io`] or [`SimError::Data`], naming the file.
    pub fn load(folder: &Path) -> Result<Vec<EpisodeRecord>, SimError> {
        let (mut records, mut seen) = (Vec::new(), HashSet::new());
        for path in results_in(folder)? {
            let text = std::fs::read_to_string(&path).map_err(|e| SimError::io(&path, e))?;
            for record in parse(&path, whole_lines(&text))? {
                if seen.insert(record.key()) {
                    records.push(record);
                }
            }
        }
        Ok(records)
    }
}

/// Takes a lock for as long as the file is open.
fn lock(path: &Path) -> Result<File, SimError> {
    let file = OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
        .map_err(|e| SimError::io(path, e))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(SimError::Busy {
            path: path.display().to_string(),
        }),
        Err(TryLockError::Error(e)) => Err(SimError::io(path, e)),
    }
}

/// The files of results in a folder, sorted.
fn results_in(folder: &Path) -> Result<Vec<PathBuf>, SimError> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| SimError::io(folder, e))? {
        let path = entry.map_err(|e| SimError::io(folder, e))?.path();
        if path.extension().is_some_and(|e| e == "jsonl") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// The text without a half line at the end.
fn whole_lines(text: &str) -> &str {
    &text[..text.rfind('\n').map_or(0, |end| end + 1)]
}

/// Notes who played the episodes of a file.
fn note(
    done: &mut HashMap<String, String>,
    path: &Path,
    text: &str,
    accepted: &[String],
) -> Result<(), SimError> {
    for record in parse(path, text)? {
        if program(&record.core) != CORE_VERSION && !accepted.contains(&record.core) {
            return Err(other_build(path, &record.core, CORE_VERSION));
        }
        done.insert(record.key(), record.core);
    }
    Ok(())
}

/// The program's part of a build.
fn program(build: &str) -> &str {
    build.split_once('/').map_or(build, |(program, _)| program)
}

/// The part of a build that stands for the suite's file.
fn suite_file(build: &str) -> Option<&str> {
    build.split_once('/').map(|(_, file)| file)
}

fn other_build(path: &Path, found: &str, own: &str) -> SimError {
    SimError::OtherBuild {
        path: path.display().to_string(),
        found: found.to_owned(),
        own: own.to_owned(),
    }
}

/// Writes a new file and puts it in the place of the old one, which stays until then.
fn replace(path: &Path, fresh: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = File::create(fresh)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(fresh, path)
}

fn line_of(record: &EpisodeRecord) -> Result<String, SimError> {
    serde_json::to_string(record).map_err(|e| SimError::Data {
        file: record.key(),
        message: format!("it can't be written as JSON: {e}"),
    })
}

fn parse(path: &Path, text: &str) -> Result<Vec<EpisodeRecord>, SimError> {
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(i, line)| {
            serde_json::from_str(line).map_err(|e| SimError::Data {
                file: path.display().to_string(),
                message: format!("line {} is no episode: {e}", i + 1),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> EpisodeRecord {
        let text = r#"{"schema":1,"core":"0.1.0","suite":"object","task_index":4,"task":"milk",
            "perturbation":"pos","level":"standard","backbone":"hold","backbone_hash":"",
            "config":"full","profile":"guarded","perception":"truth","knowledge":"agents",
            "seed":1,"episode":0,"success":false,"intervened":true,"activations":[
            {"correction":0,"kind":"pick","start_step":9,"end_step":30,"outcome":"episode-end"}],
            "onset_step":null,"first_failure_step":8,"first_intervention_step":9,"steps":30,
            "sim_seconds":1.5,"failure":"timeout","gate_reasons":["streak_short"],"rebinds":0,
            "graspable":true,"end_distance_m":0.5,"drawn":""}"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_full_disk_is_an_error_that_names_the_file() {
        let path = PathBuf::from("/dev/full");
        let file = OpenOptions::new().write(true).open(&path).unwrap();
        let mut store = Store {
            _lock: file.try_clone().unwrap(),
            path,
            file,
            done: HashMap::new(),
            accepted: Vec::new(),
        };
        let error = store.append(&record()).unwrap_err().to_string();
        assert!(error.contains("/dev/full"), "{error}");
        assert!(
            store.done.is_empty(),
            "an episode that was not written is not done"
        );
    }

    #[test]
    fn a_line_reads_back_as_it_was_written() {
        let line = line_of(&record()).unwrap();
        assert_eq!(
            serde_json::from_str::<EpisodeRecord>(&line).unwrap(),
            record()
        );
        assert_eq!(record().correction_steps(), 22);
    }
}
