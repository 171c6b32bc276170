//! `fitmac report`: tables, plots and a page of results.

use std::path::PathBuf;

use fitmac_report::{Report, ReportError, gallery, load::load, render};
use indicatif::{ProgressBar, ProgressStyle};

use crate::exit::{BadInput, Exit};

/// Arguments of `report`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac report out/main --out out/main/report
  fitmac report out/main out/ablation out/sweeps --out out/report
  fitmac report out/main --out out/main/report --pictures 24
  fitmac report out/main --out out/main/report --pictures 200 --page docs/evaluation.md

Reads every *.jsonl of the folders that `fitmac eval` wrote, and writes report.html
(one page that needs nothing else), report.md and report.json: the paper's tables
with the paper's figures beside ours, intervals, what FIT-MAC costs and saves pair
by pair, time to detect, lengths of corrections, kinds of failures. All policies are
surrogates, and every table says so.

Seeds 1000 to 9999 are for choosing parameters: a report on them is marked. They are
left out where there are episodes with the paper's seeds 7, 11, 13, 17, 23.

A line that is no episode is named on standard error and left out; the report is
written all the same, and the exit status is then 1.")]
pub(crate) struct Args {
    /// Folders with results.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// The folder for the report.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Writes a Markdown page for the documentation, too, its pictures in `pictures/` beside it.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Plays up to N episodes again and puts pictures of them into the page: harmed ones first,
    /// then other failures with FIT-MAC, one of each kind before the second of any, then some
    /// that it saved. A few seconds each.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pictures: usize,
}

/// Makes the report.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let loaded = load(&args.folders).map_err(usage)?;
    for problem in &loaded.problems {
        eprintln!("fitmac: {problem}");
    }
    let mut report = Report::of(&loaded).map_err(usage)?;
    for warning in &report.about.warnings {
        eprintln!("fitmac: {warning}");
    }
    let filmed = film(&mut report, args.pictures)?;
    for path in render::write(&report, &args.out)? {
        println!("{}", path.display());
    }
    if let Some(page) = &args.page {
        for path in render::page(&report, page)? {
            println!("{}", path.display());
        }
    }
    Ok(if loaded.problems.is_empty() && filmed {
        Exit::Done
    } else {
        Exit::Negative
    })
}

/// Takes the pictures; false if an episode could not be played as it was recorded.
fn film(report: &mut Report, most: usize) -> anyhow::Result<bool> {
    let chosen: Vec<_> = gallery::choose(&report.episodes, most)
        .into_iter()
        .cloned()
        .collect();
    let bar = ProgressBar::new(chosen.len() as u64).with_style(ProgressStyle::with_template(
        "pictures of {pos} of {len} episodes, {eta} left",
    )?);
    let mut all_filmed = true;
    for record in &chosen {
        match gallery::film(record) {
            Ok(frames) => {
                report.pictures.insert(record.key(), frames);
            }
            Err(error) => {
                all_filmed = false;
                bar.suspend(|| eprintln!("fitmac: no pictures: {error}"));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(all_filmed)
}

/// A folder that is not one of results is the user's mistake, not the machine's.
fn usage(error: ReportError) -> anyhow::Error {
    match error {
        ReportError::Io { .. } | ReportError::Empty(_) | ReportError::Nothing => {
            BadInput(error.to_string()).into()
        }
        ReportError::Embedded { .. } | ReportError::Json(_) => error.into(),
    }
}
