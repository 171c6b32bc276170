//! What can go wrong when a report is made.

use std::path::Path;

/// An error of the report. Each names what is wrong and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file or folder can't be read or written.
    #[error("{path}: {source}")]
    Io {
        /// Which.
        path: String,
        /// The cause.
        source: std::io::Error,
    },
    /// A folder without results.
    #[error("{0}: there are no results (*.jsonl); name a folder that `fitmac eval --out` wrote")]
    Empty(String),
    /// Results without a single usable episode.
    #[error("there is no usable episode; see the problems above")]
    Nothing,
    /// An embedded file is broken, which a test rules out.
    #[error("embedded {file}: {problem}")]
    Embedded {
        /// Which.
        file: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// The report can't be written as JSON.
    #[error("the report can't be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

impl ReportError {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io {
            path: path.display().to_string(),
            source,
        }
    }
}
