//! Results on disk: one line of JSON an episode, appended as they come.
//!
//! A kill in the middle loses at most the line that was being written: a half line at the end is
//! cut off when the file is opened again.

use std::collections::HashSet;
use std::fs::{File, OpenOptions};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::grid::{EpisodeSpec, Shard};
use super::record::EpisodeRecord;
use crate::error::SimError;

/// A file of results that grows.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    file: File,
    done: HashSet<String>,
}

impl Store {
    /// Opens or makes the file of a shard in a folder, and reads which episodes it already has.
    ///
    /// # Errors
    /// [`SimError::Io`] if the folder or file can't be made or read, [`SimError::Data`] if the
    /// file holds something else than episodes.
    pub fn open(folder: &Path, shard: Shard) -> Result<Self, SimError> {
        std::fs::create_dir_all(folder).map_err(|e| SimError::io(folder, e))?;
        let path = folder.join(format!("episodes-{}-of-{}.jsonl", shard.index, shard.count));
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
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        if whole < text.len() {
            file.set_len(whole as u64)
                .map_err(|e| SimError::io(&path, e))?;
        }
        file.seek(SeekFrom::End(0))
            .map_err(|e| SimError::io(&path, e))?;
        let records = parse(&path, &text[..whole])?;
        let done = records.iter().map(EpisodeRecord::key).collect();
        Ok(Self { path, file, done })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether an episode is already there.
    #[must_use]
    pub fn has(&self, spec: &EpisodeSpec) -> bool {
        self.done.contains(&spec.key())
    }

    /// Adds an episode; it is on its way to the disk when this returns.
    ///
    /// # Errors
    /// [`SimError::Io`] if it can't be written, for example on a full disk. Nothing that was
    /// written before is lost.
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
            return Err(SimError::io(&self.path, error));
        }
        self.done.insert(record.key());
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
        let place: std::collections::HashMap<String, usize> = order
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
        std::fs::write(&fresh, sorted).map_err(|e| SimError::io(&fresh, e))?;
        std::fs::rename(&fresh, &self.path).map_err(|e| SimError::io(&self.path, e))
    }

    /// Reads all results of a folder, without those that appear twice.
    ///
    /// # Errors
    /// [`SimError::Io`] or [`SimError::Data`], naming the file.
    pub fn load(folder: &Path) -> Result<Vec<EpisodeRecord>, SimError> {
        let entries = std::fs::read_dir(folder).map_err(|e| SimError::io(folder, e))?;
        let mut paths = Vec::new();
        for entry in entries {
            let path = entry.map_err(|e| SimError::io(folder, e))?.path();
            if path.extension().is_some_and(|e| e == "jsonl") {
                paths.push(path);
            }
        }
        paths.sort();
        let (mut records, mut seen) = (Vec::new(), HashSet::new());
        for path in paths {
            let text = std::fs::read_to_string(&path).map_err(|e| SimError::io(&path, e))?;
            let whole = text.rfind('\n').map_or(0, |end| end + 1);
            for record in parse(&path, &text[..whole])? {
                if seen.insert(record.key()) {
                    records.push(record);
                }
            }
        }
        Ok(records)
    }
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
            path,
            file,
            done: HashSet::new(),
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
