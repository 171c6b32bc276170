//! Time to detect, lengths and ends of corrections: not in the paper.

use sim_harness::evaluation::{Activation, Ending, EpisodeRecord, Routine};

use super::{Source, suite_title};
use crate::select::{FULL, PERTURBATIONS, SUITES, Setting};
use crate::stats::Summary;
use crate::table::{Cell, Column, Row, Table, Topic};

/// How soon a failure is met, and how long corrections take, for each surrogate.
#[must_use]
pub fn timing(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let mut tables = Vec::new();
    for backbone in source.episodes.backbones() {
        let records = source.episodes.of_config(backbone, FULL, setting);
        tables.extend(detection(&records, backbone, setting));
        tables.extend(corrections(&records, backbone, setting));
    }
    tables
}

/// Policy steps from the onset of a failure to the first replaced action, of the episodes that
/// have both.
#[must_use]
pub fn delays(records: &[&EpisodeRecord]) -> Vec<f64> {
    records
        .iter()
        .filter_map(|r| Some(r.first_intervention_step? as f64 - r.onset_step? as f64))
        .collect()
}

fn detection(records: &[&EpisodeRecord], backbone: &str, setting: &Setting) -> Option<Table> {
    let mut rows = Vec::new();
    for suite in SUITES {
        for perturbation in std::iter::once("none").chain(PERTURBATIONS) {
            let chosen: Vec<_> = records
                .iter()
                .copied()
                .filter(|r| r.suite == suite && r.perturbation == perturbation)
                .collect();
            let intervened = chosen.iter().filter(|r| r.intervened).count() as u64;
            if intervened == 0 {
                continue;
            }
            let ahead = |r: &&&EpisodeRecord| r.intervened && r.onset_step.is_none();
            let missed =
                |r: &&&EpisodeRecord| !r.intervened && r.onset_step.is_some() && !r.success;
            let delay = Summary::of(delays(&chosen));
            let number = |what: fn(Summary) -> f64| Cell::number(delay.map(what), 0);
            let name = format!("{}, {perturbation}", suite_title(suite));
            let count = |n: usize| Cell::Count { ours: n as u64 };
            let cells = vec![
                Cell::Count {
                    ours: chosen.len() as u64,
                },
                count(chosen.iter().filter(ahead).count()),
                Cell::Count {
                    ours: delay.map_or(0, |d| d.count),
                },
                count(chosen.iter().filter(missed).count()),
                number(|d| d.median),
                number(|d| d.p90),
                number(|d| d.max),
            ];
            rows.push(Row::new(name, cells));
        }
    }
    if rows.is_empty() {
        return None;
    }
    let columns = [
        ("episodes", "all"),
        ("episodes", "intervened before any onset"),
        ("episodes", "intervened after an onset"),
        ("episodes", "failed after an onset, no intervention"),
        ("onset to first replaced action, steps", "median"),
        ("onset to first replaced action, steps", "90 %"),
        ("onset to first replaced action, steps", "longest"),
    ];
    Some(Table {
        topic: Topic::Timing,
        id: format!("detection-{backbone}-{}", setting.slug()),
        title: format!("Time to detect, {backbone} surrogate: {}", setting.label()),
        caption:
            "Steps of 50 ms. The onset is seen by the simulator: the policy closes on another \
                  object or on nothing, or lets go of the target elsewhere. Where FIT-MAC steps in \
                  before that, no onset is ever seen."
                .to_owned(),
        rows_are: "cell".to_owned(),
        columns: columns.map(|(g, n)| Column::new(g, n)).to_vec(),
        rows,
    })
}

fn corrections(records: &[&EpisodeRecord], backbone: &str, setting: &Setting) -> Option<Table> {
    let parts: Vec<&Activation> = records.iter().flat_map(|r| &r.activations).collect();
    let rows: Vec<Row> = Routine::ALL
        .iter()
        .filter_map(|kind| {
            let own: Vec<_> = parts.iter().filter(|a| a.kind == *kind).collect();
            let length = Summary::of(own.iter().map(|a| a.steps() as f64).collect())?;
            let mut cells = vec![
                Cell::Count { ours: length.count },
                Cell::number(Some(length.median), 0),
                Cell::number(Some(length.p90), 0),
                Cell::number(Some(length.max), 0),
            ];
            cells.extend(Ending::ALL.iter().map(|ending| Cell::Count {
                ours: own.iter().filter(|a| a.outcome == *ending).count() as u64,
            }));
            Some(Row::new(kind.name(), cells))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let mut columns = vec![Column::new("", "parts")];
    columns.extend(["median", "90 %", "longest"].map(|n| Column::new("length, steps", n)));
    columns.extend(
        Ending::ALL
            .iter()
            .map(|e| Column::new("how it ended", e.name())),
    );
    Some(Table {
        topic: Topic::Timing,
        id: format!("corrections-{backbone}-{}", setting.slug()),
        title: format!("Corrections, {backbone} surrogate: {}", setting.label()),
        caption: "Stretches of policy steps, 50 ms each, in which a routine replaced the policy's \
                  actions. A pick that goes on to a place is one correction of several parts."
            .to_owned(),
        rows_are: "routine".to_owned(),
        columns,
        rows,
    })
}
