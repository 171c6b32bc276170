//! The paper's Tables 7 and 8, which it leaves blank.

use super::{Source, suite_title};
use crate::select::{self, FULL, PERTURBATIONS, Rates, SUITES, Setting};
use crate::stats::mean_and_spread;
use crate::table::{Cell, Column, Row, Table, Topic};

/// How much depends on the seed, for each surrogate that was run with at least two.
#[must_use]
pub fn seeds(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let mut tables = Vec::new();
    for backbone in source.episodes.backbones() {
        for suite in SUITES {
            tables.extend(table(source, suite, backbone, setting));
        }
    }
    tables
}

fn table(source: Source<'_>, suite: &str, backbone: &str, setting: &Setting) -> Option<Table> {
    let records = source.episodes.of_config(backbone, FULL, setting);
    let mut seeds: Vec<u64> = records
        .iter()
        .filter(|r| r.suite == suite && r.perturbation != "none")
        .map(|r| r.seed)
        .collect();
    seeds.sort_unstable();
    seeds.dedup();
    if seeds.len() < 2 {
        return None;
    }
    let rates = |seed: u64, perturbation: &str| {
        let mut chosen = source.episodes.cell(&select::Cell {
            suite,
            perturbation,
            backbone,
            config: FULL,
            setting,
        });
        chosen.retain(|r| r.seed == seed);
        Rates::of(&chosen)
    };
    let mut rows: Vec<Row> = seeds
        .iter()
        .map(|seed| {
            let cells = PERTURBATIONS.iter().map(|p| Cell::Rates {
                ours: rates(*seed, p),
                paper: None,
            });
            Row::new(format!("seed {seed}"), cells.collect())
        })
        .collect();
    let over_seeds = |what: fn(&Rates) -> Option<f64>| -> Vec<Cell> {
        let cell = |p: &&str| {
            let values: Vec<f64> = seeds
                .iter()
                .filter_map(|s| Some(100.0 * what(&rates(*s, p)?)?))
                .collect();
            let both = mean_and_spread(&values);
            Cell::Number {
                ours: both.map(|(mean, _)| mean),
                spread: both.map(|(_, spread)| spread),
                paper: None,
                digits: 1,
            }
        };
        PERTURBATIONS.iter().map(cell).collect()
    };
    rows.push(Row::new("SR, mean ± sd", over_seeds(|r| Some(r.sr.share))));
    rows.push(Row::new("IR, mean ± sd", over_seeds(|r| Some(r.ir.share))));
    rows.push(Row::new(
        "RSR, mean ± sd",
        over_seeds(|r| r.rsr.map(|s| s.share)),
    ));
    Some(Table {
        topic: Topic::Seeds,
        id: format!("seeds-{backbone}-{suite}-{}", setting.slug()),
        title: format!(
            "Seeds, {backbone} surrogate with FIT-MAC on {}: {}",
            suite_title(suite),
            setting.label()
        ),
        caption:
            "In the layout of the paper's Tables 7 and 8, whose cells the paper leaves blank. \
                  Mean and standard deviation over seeds by its equation 11."
                .to_owned(),
        rows_are: "seed".to_owned(),
        columns: PERTURBATIONS
            .iter()
            .map(|p| Column::new("SR/IR/RSR, %", *p))
            .collect(),
        rows,
    })
}
