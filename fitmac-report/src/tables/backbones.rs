//! The paper's Tables 5 and 6.

use super::{Line, Source, both_suites, line_columns, suite_title};
use crate::paper::Experiment;
use crate::select::{BASE, FULL, SUITES, Setting};
use crate::table::{Cell, Column, Row, Table, Topic};

/// All surrogates: cell by cell (Table 5), and on average (Table 6).
#[must_use]
pub fn backbones(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let names = source.episodes.backbones();
    let players: Vec<_> = names
        .iter()
        .flat_map(|name| [(*name, BASE), (*name, FULL)])
        .collect();
    let episodes = &source.episodes.on_common_draws(&players, setting);
    let source = Source { episodes, ..source };
    let rows = |suite: &str| -> Vec<Row> {
        let mut rows = Vec::new();
        for backbone in &names {
            for (config, what) in [(BASE, "alone"), (FULL, "with FIT-MAC")] {
                if episodes.has(backbone, config, setting) {
                    let line = Line {
                        experiment: Experiment::Backbones,
                        suite,
                        backbone,
                        config,
                        setting,
                    };
                    rows.push(Row::new(
                        format!("{backbone} surrogate {what}"),
                        line.cells(source),
                    ));
                }
            }
        }
        rows
    };
    let mut tables: Vec<Table> = SUITES
        .iter()
        .filter(|suite| episodes.values(|r| &r.suite).contains(suite))
        .map(|suite| Table {
            topic: Topic::Surrogates,
            id: format!("backbones-{suite}-{}", setting.slug()),
            title: format!("Surrogates on {}: {}", suite_title(suite), setting.label()),
            caption: "In the layout of the paper's Table 5; small figures are the paper's, of the \
                      model that a surrogate is named after. All policies on the same draws."
                .to_owned(),
            rows_are: "policy".to_owned(),
            columns: line_columns(),
            rows: rows(suite),
        })
        .collect();
    tables.extend(averages(source, &names, setting));
    tables
}

fn averages(source: Source<'_>, names: &[&str], setting: &Setting) -> Option<Table> {
    let has = |name: &str, config| source.episodes.has(name, config, setting);
    let both = |name: &&&str| has(name, BASE) && has(name, FULL);
    let names: Vec<&str> = names.iter().filter(both).copied().collect();
    if names.is_empty() {
        return None;
    }
    let mut rows = Vec::new();
    for (i, suite) in SUITES.iter().enumerate() {
        let means = |config: &str| -> Vec<_> {
            names
                .iter()
                .map(|n| both_suites(source, Experiment::Backbones, n, config, setting)[i])
                .collect()
        };
        let (alone, with) = (means(BASE), means(FULL));
        let gain = with.iter().zip(&alone).map(|(w, a)| w.over(*a));
        let title = suite_title(suite);
        let cells = |means: &[super::Means]| means.iter().map(|m| m.cell()).collect();
        rows.push(Row::new(format!("{title}, alone"), cells(&alone)));
        rows.push(Row::new(format!("{title}, with FIT-MAC"), cells(&with)));
        rows.push(Row::new(
            format!("{title}, gain in points"),
            gain.map(|m| m.cell()).collect::<Vec<Cell>>(),
        ));
    }
    Some(Table {
        topic: Topic::Surrogates,
        id: format!("averages-{}", setting.slug()),
        title: format!("Surrogates on average: {}", setting.label()),
        caption: "Mean success rate over the five perturbations, %, as in the paper's Table 6."
            .to_owned(),
        rows_are: "suite".to_owned(),
        columns: names
            .iter()
            .map(|n| Column::new("", format!("{n} surrogate")))
            .collect(),
        rows,
    })
}
