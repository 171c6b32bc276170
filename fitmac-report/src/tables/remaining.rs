//! What still fails with the controller, task by task, and what no controller could change: not in
//! the paper.

use std::collections::BTreeMap;

use sim_harness::evaluation::{EpisodeRecord, Failure};

use super::{Source, suite_title};
use crate::select::{FULL, PERTURBATIONS, SUITES, Setting};
use crate::stats::Share;
use crate::table::{Cell, Column, Row, Table, Topic};

/// Episodes that are named in a row; the page has all of them.
const NAMED: usize = 6;

/// Every failure of the whole controller, by task and kind, with the episodes.
#[must_use]
pub fn remaining(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    source
        .episodes
        .backbones()
        .into_iter()
        .filter_map(|backbone| {
            let records = source.episodes.of_config(backbone, FULL, setting);
            by_task(&records, backbone, setting)
        })
        .collect()
}

fn by_task(records: &[&EpisodeRecord], backbone: &str, setting: &Setting) -> Option<Table> {
    type Class<'a> = (usize, usize, u32, &'a str, Failure);
    let place = |list: &[&str], name: &str| list.iter().position(|n| *n == name);
    let mut classes: BTreeMap<Class<'_>, Vec<&EpisodeRecord>> = BTreeMap::new();
    for record in records {
        let Some(kind) = record.failure else { continue };
        let class = (
            place(&SUITES, &record.suite).unwrap_or(SUITES.len()),
            place(&PERTURBATIONS, &record.perturbation).map_or(0, |at| at + 1),
            record.task_index,
            record.task.as_str(),
            kind,
        );
        classes.entry(class).or_default().push(record);
    }
    if classes.is_empty() {
        return None;
    }
    let played = |example: &EpisodeRecord| {
        let same = |r: &&&EpisodeRecord| {
            (&r.suite, &r.perturbation, &r.task)
                == (&example.suite, &example.perturbation, &example.task)
        };
        records.iter().filter(same).count() as u64
    };
    let rows = classes
        .into_values()
        .map(|failed| {
            let first = failed[0];
            let cells = vec![
                Cell::Count {
                    ours: failed.len() as u64,
                },
                Cell::Count {
                    ours: played(first),
                },
                text(first.failure.map_or("", Failure::name)),
                text(why_shut(&failed)),
                text(episodes(&failed)),
            ];
            let name = format!(
                "{}, {}, {}",
                suite_title(&first.suite),
                first.perturbation,
                first.task
            );
            Row::new(name, cells)
        })
        .collect();
    Some(Table {
        topic: Topic::Failures,
        id: format!("remaining-{backbone}-{}", setting.slug()),
        title: format!(
            "What still fails, {backbone} surrogate with FIT-MAC: {}",
            setting.label()
        ),
        caption: "Every failed episode, by task and kind. Episodes are named by seed and number; \
                  the page shows each of them, and pictures of those that were played again."
            .to_owned(),
        rows_are: "cell and task".to_owned(),
        columns: vec![
            Column::new("episodes", "failed"),
            Column::new("episodes", "played"),
            Column::new("", "how it failed"),
            Column::new("", "what kept the gate shut"),
            Column::new("", "which"),
        ],
        rows,
    })
}

fn text(ours: impl Into<String>) -> Cell {
    Cell::Text { ours: ours.into() }
}

fn why_shut(failed: &[&EpisodeRecord]) -> String {
    let mut reasons: Vec<&str> = failed
        .iter()
        .flat_map(|r| r.gate_reasons.iter().map(String::as_str))
        .collect();
    reasons.sort_unstable();
    reasons.dedup();
    if reasons.is_empty() {
        "–".to_owned()
    } else {
        reasons.join(", ")
    }
}

fn episodes(failed: &[&EpisodeRecord]) -> String {
    let mut names: Vec<String> = failed
        .iter()
        .take(NAMED)
        .map(|r| format!("{}/{}", r.seed, r.episode))
        .collect();
    if failed.len() > NAMED {
        names.push(format!("and {} more", failed.len() - NAMED));
    }
    names.join(", ")
}

/// Cells with targets that do not fit between the fingers: the most that anybody could reach there.
#[must_use]
pub fn ceilings(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let tables = source.episodes.backbones().into_iter().map(|backbone| {
        let records = source.episodes.of_config(backbone, FULL, setting);
        ceilings_of(&records, backbone, setting)
    });
    tables.flatten().collect()
}

fn ceilings_of(records: &[&EpisodeRecord], backbone: &str, setting: &Setting) -> Option<Table> {
    let mut rows = Vec::new();
    for suite in SUITES {
        for perturbation in std::iter::once("none").chain(PERTURBATIONS) {
            let here: Vec<_> = records
                .iter()
                .filter(|r| r.suite == suite && r.perturbation == perturbation)
                .collect();
            if here.iter().all(|r| r.graspable) {
                continue;
            }
            let fitting = here.iter().filter(|r| r.graspable);
            let cells = vec![
                Cell::share(Share::of(&here, |r| r.graspable)),
                Cell::share(Share::of(&here, |r| r.success)),
                Cell::share(Share::of(fitting.collect::<Vec<_>>(), |r| r.success)),
            ];
            rows.push(Row::new(
                format!("{}, {perturbation}", suite_title(suite)),
                cells,
            ));
        }
    }
    (!rows.is_empty()).then(|| Table {
        topic: Topic::Failures,
        id: format!("ceilings-{backbone}-{}", setting.slug()),
        title: format!(
            "Physical ceilings, {backbone} surrogate with FIT-MAC: {}",
            setting.label()
        ),
        caption: "Cells in which some targets are wider than the gripper opens (80 mm): no \
                  controller can grasp those."
            .to_owned(),
        rows_are: "cell".to_owned(),
        columns: vec![
            Column::new("of all episodes, %", "target fits"),
            Column::new("of all episodes, %", "success"),
            Column::new("", "success where it fits, %"),
        ],
        rows,
    })
}
