//! Writes a report: Markdown for people and pull requests, JSON for programs, one HTML page for
//! looking around, and a page for the documentation.

mod html;
mod markdown;
mod page;

use std::path::{Path, PathBuf};

pub use html::html;
pub use markdown::markdown;
pub use page::page;

use crate::{Report, ReportError};

/// The report as JSON, indented. Episodes are not repeated in it.
///
/// # Errors
/// [`ReportError::Json`] if a number can't be written, which does not happen.
pub fn json(report: &Report) -> Result<String, ReportError> {
    let mut text = serde_json::to_string_pretty(report)?;
    text.push('\n');
    Ok(text)
}

/// Writes `report.md`, `report.json` and `report.html` into a folder, and gives their paths.
///
/// # Errors
/// [`ReportError::Io`] if the folder can't be made or a file not written.
pub fn write(report: &Report, folder: &Path) -> Result<[PathBuf; 3], ReportError> {
    std::fs::create_dir_all(folder).map_err(|e| ReportError::io(folder, e))?;
    let files = [
        ("report.html", html(report)?),
        ("report.md", markdown(report)),
        ("report.json", json(report)?),
    ];
    for (name, text) in &files {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|e| ReportError::io(&path, e))?;
    }
    Ok(files.map(|(name, _)| folder.join(name)))
}

/// One sentence on what the controller does under a setting.
fn sentence(verdict: &crate::Verdict) -> String {
    let pairs = &verdict.pairs;
    let of = |share: Option<crate::stats::Share>| {
        share.map_or_else(
            || "none of 0".to_owned(),
            |s| format!("{} of {} ({:.2} %)", s.hits, s.of, 100.0 * s.share),
        )
    };
    let bound = pairs.harmed_upper.map_or_else(String::new, |u| {
        format!(", exact 95 % upper bound {:.2} %", 100.0 * u)
    });
    format!(
        "Where a surrogate succeeds alone, {} fail with FIT-MAC{bound}; it intervened unneeded in \
         {}. Where a surrogate fails alone, {} succeed with FIT-MAC.",
        of(pairs.harmed),
        of(pairs.unneeded),
        of(pairs.saved),
    )
}

/// The line that says what the policies are.
fn surrogates(report: &Report) -> String {
    let list: Vec<String> = report
        .about
        .surrogates
        .iter()
        .map(|s| {
            let name = s
                .stands_for
                .map_or_else(String::new, |m| format!(", named after {m}"));
            format!("{}{name} (parameters {})", s.name, s.hashes.join(", "))
        })
        .collect();
    format!(
        "All policies are surrogates in a simulator, not the models they are named after: {}.",
        list.join("; ")
    )
}

/// The line that says which seeds were used.
fn seeds(report: &Report) -> String {
    let about = &report.about;
    let list: Vec<String> = about.seeds.iter().map(u64::to_string).collect();
    let shown = if list.len() > 12 {
        format!(
            "{} to {} ({} of them)",
            list[0],
            list[list.len() - 1],
            list.len()
        )
    } else {
        list.join(", ")
    };
    format!(
        "{} episodes. Seeds {shown}: {}. Controller version {}.",
        about.episodes,
        about.seed_class.meaning(),
        about.versions.join(", ")
    )
}
