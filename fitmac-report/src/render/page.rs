//! The report as a page of the project's documentation, with its pictures in files beside it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use sim_harness::evaluation::{EpisodeRecord, Failure, Profile};

use crate::gallery::Frame;
use crate::select::{FULL, MAIN, STANDARD};
use crate::{Report, ReportError};

/// Kinds of failures that the page shows pictures of, at most.
const MOST_SHOWN: usize = 40;
/// The folder of pictures beside the page.
const PICTURES: &str = "pictures";

/// Writes the page, its plots and some pictures of failures, and gives the paths. Pictures go into
/// `pictures/` beside the page; their names begin with the page's own.
///
/// # Errors
/// [`ReportError::Io`] if a file can't be written.
pub fn page(report: &Report, path: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let stem = path
        .file_stem()
        .map_or_else(|| "report".into(), |s| s.to_string_lossy().into_owned());
    let beside = path.parent().unwrap_or(Path::new("."));
    let folder = beside.join(PICTURES);
    std::fs::create_dir_all(&folder).map_err(|e| ReportError::io(&folder, e))?;
    let mut files = Vec::new();
    let mut text = introduction(report);
    for plot in &report.plots {
        let name = format!("{stem}-{}.svg", plot.id);
        files.push((folder.join(&name), plot.svg.clone().into_bytes()));
        let _ = writeln!(
            text,
            "![{}]({PICTURES}/{name})\n\n{}\n",
            plot.title, plot.caption
        );
    }
    super::markdown::tables(&mut text, report);
    let shown = failures(report);
    if !shown.is_empty() {
        text.push_str(
            "\n## Pictures of what still fails\n\nOne episode of each kind, played again, those of \
             the main table first: where the policy went wrong or FIT-MAC first acted, and the \
             end.\n",
        );
    }
    for (at, (record, frames)) in shown.iter().enumerate() {
        let _ = writeln!(text, "\n{}:\n", described(record));
        for (part, frame) in frames.iter().enumerate() {
            let name = format!("{stem}-failure-{}-{}.png", at + 1, part + 1);
            files.push((folder.join(&name), frame.png.clone()));
            let _ = writeln!(text, "![{}]({PICTURES}/{name})", frame.caption);
        }
    }
    files.insert(0, (path.to_owned(), text.into_bytes()));
    for (path, bytes) in &files {
        std::fs::write(path, bytes).map_err(|e| ReportError::io(path, e))?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

fn introduction(report: &Report) -> String {
    let mut text = String::from(
        "# Evaluation\n\nWritten by `cargo xtask evaluate`, not by hand. It plays every episode \
         below in simulation; the same command gives the same episodes, bit for bit. A whole run \
         has 50 episodes a task and cell in the main table, 10 for surrogates, modules, seeds and \
         harm, and 5 (the paper: 10) for sweeps, displacements, the published parameters and the \
         modules of a second surrogate. Where a run has ended early there are dashes.\n\n",
    );
    super::markdown::summary(&mut text, report);
    text.push_str(
        "\nA cell reads: measured here [Wilson 95 % interval] (the paper's figure, of the model \
         itself). SR is the success rate, IR the share of episodes in which at least one action \
         was replaced, RSR the success rate among those.\n\n",
    );
    text
}

/// One episode of each kind of failure in the project's own profile that has pictures.
fn failures(report: &Report) -> Vec<(&EpisodeRecord, Vec<&Frame>)> {
    let mut kinds = BTreeSet::new();
    let mut shown = Vec::new();
    let mut records: Vec<&EpisodeRecord> = report.episodes.iter().collect();
    // What the main table counts comes first; the sort is stable.
    records.sort_by_key(|r| (r.backbone != MAIN, r.level != STANDARD));
    for record in records {
        let own = record.config == FULL && record.profile == Profile::Guarded.name();
        let Some(frames) = report.pictures.get(&record.key()) else {
            continue;
        };
        let kind = (
            &record.suite,
            &record.perturbation,
            &record.task,
            record.failure,
        );
        if own && !record.success && kinds.insert(kind) {
            let telling = frames.iter().filter(|frame| {
                frame.caption.starts_with("onset") || frame.caption.starts_with("end")
            });
            shown.push((record, telling.collect()));
        }
    }
    shown.truncate(MOST_SHOWN);
    shown
}

fn described(record: &EpisodeRecord) -> String {
    let kind = record.failure.map_or("", Failure::name);
    let ceiling = if record.graspable {
        ""
    } else {
        "; the target is wider than the gripper opens"
    };
    format!(
        "{}, {} ({}), `{}`, {} surrogate, seed {}, episode {}: {kind}{ceiling}",
        record.suite,
        record.perturbation,
        record.drawn,
        record.task,
        record.backbone,
        record.seed,
        record.episode,
    )
}
