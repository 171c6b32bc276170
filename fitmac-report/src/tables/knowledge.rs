//! What grounding by the simulator's knowledge would have given: not in the paper.

use std::collections::HashMap;

use super::Source;
use crate::select::{FULL, PERTURBATIONS, Setting};
use crate::stats::Share;
use crate::table::{Cell, Column, Row, Table, Topic};

/// Who grounds by itself.
const OWN: &str = "agents";

/// An episode as both played it: whether it succeeded with our grounding, and with the
/// simulator's.
type Both = (bool, bool);

/// Our planner and grounder beside the simulator's answer, episode by episode.
#[must_use]
pub fn knowledge(source: Source<'_>) -> Option<Table> {
    let mut rows = Vec::new();
    let settings = source.episodes.settings();
    let told = settings.iter().filter(|s| s.knowledge != OWN);
    for setting in told {
        let own = Setting {
            knowledge: OWN.to_owned(),
            ..setting.clone()
        };
        for backbone in source.episodes.backbones() {
            let pairs = pairs(source, backbone, &own, setting);
            for perturbation in ["none"].iter().chain(&PERTURBATIONS) {
                let both: Vec<Both> = pairs
                    .iter()
                    .filter(|(p, _)| p == perturbation)
                    .map(|(_, both)| *both)
                    .collect();
                if !both.is_empty() {
                    let name = format!("{perturbation}, {backbone} surrogate: {}", own.label());
                    rows.push(Row::new(name, cells(&both)));
                }
            }
        }
    }
    if rows.is_empty() {
        return None;
    }
    let columns = [
        ("", "pairs"),
        ("SR, %", "own grounding"),
        ("SR, %", "the simulator's"),
        ("succeeds only with", "own grounding"),
        ("succeeds only with", "the simulator's"),
    ];
    Some(Table {
        topic: Topic::Cost,
        id: "knowledge".to_owned(),
        title: "What the simulator's knowledge would have given".to_owned(),
        caption: "The same episodes with our own planner and grounder, and with agents that know \
                  the answer: what imperfect grounding costs."
            .to_owned(),
        rows_are: "episodes".to_owned(),
        columns: columns.map(|(g, n)| Column::new(g, n)).to_vec(),
        rows,
    })
}

/// The perturbation and outcome of every episode that both played.
fn pairs<'a>(
    source: Source<'a>,
    backbone: &str,
    own: &Setting,
    told: &Setting,
) -> Vec<(&'a str, Both)> {
    let of = |setting| source.episodes.of_config(backbone, FULL, setting);
    let with_own: HashMap<String, bool> =
        of(own).iter().map(|r| (r.pair_key(), r.success)).collect();
    of(told)
        .into_iter()
        .filter_map(|r| {
            let own = *with_own.get(&r.pair_key())?;
            Some((r.perturbation.as_str(), (own, r.success)))
        })
        .collect()
}

fn cells(both: &[Both]) -> Vec<Cell> {
    let count = |only: Both| Cell::Count {
        ours: both.iter().filter(|b| **b == only).count() as u64,
    };
    vec![
        Cell::Count {
            ours: both.len() as u64,
        },
        Cell::share(Share::of(both, |b| b.0)),
        Cell::share(Share::of(both, |b| b.1)),
        count((true, false)),
        count((false, true)),
    ]
}
