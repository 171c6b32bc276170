//! How failures failed, and what kept the gate shut: not in the paper.

use std::collections::BTreeMap;

use sim_harness::evaluation::{EpisodeRecord, Failure};

use super::{Source, suite_title};
use crate::select::{BASE, FULL, PERTURBATIONS, SUITES, Setting};
use crate::table::{Cell, Column, Row, Table, Topic};

/// Failures by kind, for each surrogate alone and with FIT-MAC.
#[must_use]
pub fn failures(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let mut tables = Vec::new();
    for backbone in source.episodes.backbones() {
        for (config, what) in [(BASE, "alone"), (FULL, "with FIT-MAC")] {
            let records = source.episodes.of_config(backbone, config, setting);
            let who = format!("{backbone} surrogate {what}");
            tables.extend(kinds(
                &records,
                &format!("{backbone}-{config}"),
                &who,
                setting,
            ));
            if config == FULL {
                tables.extend(gate(&records, backbone, setting));
            }
        }
    }
    tables
}

fn kinds(records: &[&EpisodeRecord], id: &str, who: &str, setting: &Setting) -> Option<Table> {
    let occurs = |kind: &&Failure| records.iter().any(|r| r.failure == Some(**kind));
    let kinds: Vec<Failure> = Failure::ALL.iter().filter(occurs).copied().collect();
    let mut rows = Vec::new();
    for suite in SUITES {
        for perturbation in std::iter::once("none").chain(PERTURBATIONS) {
            let here = |r: &&&EpisodeRecord| r.suite == suite && r.perturbation == perturbation;
            let chosen: Vec<_> = records.iter().filter(here).collect();
            let failed: Vec<_> = chosen.iter().filter(|r| !r.success).collect();
            if failed.is_empty() {
                continue;
            }
            let count = |n: usize| Cell::Count { ours: n as u64 };
            let mut cells = vec![count(chosen.len()), count(failed.len())];
            cells.extend(
                kinds
                    .iter()
                    .map(|k| count(failed.iter().filter(|r| r.failure == Some(*k)).count())),
            );
            cells.push(count(failed.iter().filter(|r| !r.graspable).count()));
            rows.push(Row::new(
                format!("{}, {perturbation}", suite_title(suite)),
                cells,
            ));
        }
    }
    if rows.is_empty() {
        return None;
    }
    let mut columns = vec![
        Column::new("episodes", "all"),
        Column::new("episodes", "failed"),
    ];
    columns.extend(kinds.iter().map(|k| Column::new("how it failed", k.name())));
    columns.push(Column::new("", "of these, wider than the gripper"));
    Some(Table {
        topic: Topic::Failures,
        id: format!("failures-{id}-{}", setting.slug()),
        title: format!("Failures, {who}: {}", setting.label()),
        caption: "The first kind that applies, judged by the simulator at the end of an episode. \
                  An object that is wider than the gripper opens can't be grasped: such episodes \
                  are a ceiling of the cell."
            .to_owned(),
        rows_are: "cell".to_owned(),
        columns,
        rows,
    })
}

fn gate(records: &[&EpisodeRecord], backbone: &str, setting: &Setting) -> Option<Table> {
    let mut reasons: BTreeMap<&str, u64> = BTreeMap::new();
    for record in records.iter().filter(|r| !r.success) {
        for reason in &record.gate_reasons {
            *reasons.entry(reason).or_default() += 1;
        }
    }
    if reasons.is_empty() {
        return None;
    }
    let mut sorted: Vec<_> = reasons.into_iter().collect();
    sorted.sort_by_key(|(name, count)| (std::cmp::Reverse(*count), *name));
    Some(Table {
        topic: Topic::Failures,
        id: format!("gate-{backbone}-{}", setting.slug()),
        title: format!(
            "What kept the gate shut, {backbone} surrogate: {}",
            setting.label()
        ),
        caption: "In failed episodes with FIT-MAC: reasons for which a diagnosed failure was not \
                  corrected at some query, each counted once an episode."
            .to_owned(),
        rows_are: "reason".to_owned(),
        columns: vec![Column::new("", "failed episodes")],
        rows: sorted
            .into_iter()
            .map(|(name, ours)| Row::new(name, vec![Cell::Count { ours }]))
            .collect(),
    })
}
