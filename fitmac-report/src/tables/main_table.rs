//! The paper's Tables 1 and 2.

use super::{Line, Means, Source, suite_title};
use crate::paper::{Experiment, PaperRates};
use crate::select::{self, BASE, FULL, MAIN, PERTURBATIONS, SUITES, Setting};
use crate::table::{Cell, Column, Row, Table, Topic};

/// Success beside the published methods (Table 1), and how it comes about (Table 2).
#[must_use]
pub fn main_table(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let has = |config| source.episodes.has(MAIN, config, setting);
    if !has(BASE) && !has(FULL) {
        return Vec::new();
    }
    let players = [(MAIN, BASE), (MAIN, FULL)];
    let episodes = &source.episodes.on_common_draws(&players, setting);
    let source = Source { episodes, ..source };
    vec![comparison(source, setting), behaviour(source, setting)]
}

fn comparison(source: Source<'_>, setting: &Setting) -> Table {
    let mut columns = Vec::new();
    for suite in SUITES {
        let group = suite_title(suite);
        columns.push(Column::new(&group, "nominal"));
        columns.extend(PERTURBATIONS.iter().map(|p| Column::new(&group, *p)));
    }
    columns.push(Column::new("", "mean of ten"));
    let mut rows: Vec<Row> = source
        .paper
        .others()
        .into_iter()
        .map(|model| Row::new(format!("{model} (published)"), published(source, model)))
        .collect();
    rows.push(Row::new(
        format!("{MAIN} surrogate alone"),
        ours(source, BASE, setting),
    ));
    rows.push(Row::new(
        format!("{MAIN} surrogate with FIT-MAC"),
        ours(source, FULL, setting),
    ));
    Table {
        topic: Topic::Success,
        id: format!("main-{}", setting.slug()),
        title: format!("Success: {}", setting.label()),
        caption: "Success rate, %, in the layout of the paper's Table 1. The last two rows are \
                  measured here, of a surrogate policy on the same draws; beside them the paper's figures, \
                  which are of OpenVLA itself. The rows above are published figures of other methods, from \
                  the same table."
            .to_owned(),
        rows_are: "method".to_owned(),
        columns,
        rows,
    }
}

fn published(source: Source<'_>, model: &str) -> Vec<Cell> {
    let mut cells = Vec::new();
    for suite in SUITES {
        cells.push(Cell::Empty);
        cells.extend(PERTURBATIONS.iter().map(|p| {
            let paper = source
                .paper
                .of_model(Experiment::Others, suite, p, model, BASE);
            match paper {
                Some(_) => Cell::Success { ours: None, paper },
                None => Cell::Empty,
            }
        }));
    }
    cells.push(Cell::Empty);
    cells
}

fn line<'a>(suite: &'a str, config: &'a str, setting: &'a Setting) -> Line<'a> {
    Line {
        experiment: Experiment::Main,
        suite,
        backbone: MAIN,
        config,
        setting,
    }
}

fn ours(source: Source<'_>, config: &str, setting: &Setting) -> Vec<Cell> {
    let mut cells = Vec::new();
    for suite in SUITES {
        let nominal = select::Cell {
            suite,
            perturbation: "none",
            backbone: MAIN,
            config,
            setting,
        };
        cells.push(Cell::Success {
            ours: source.episodes.rates(&nominal),
            paper: None,
        });
        let line = line(suite, config, setting);
        cells.extend(PERTURBATIONS.iter().map(|p| Cell::Success {
            ours: line.rates(source, p),
            paper: line.paper(source, p),
        }));
    }
    let [object, spatial]: [Means; 2] = SUITES.map(|s| line(s, config, setting).means(source));
    cells.push(object.with(spatial).cell());
    cells
}

fn behaviour(source: Source<'_>, setting: &Setting) -> Table {
    let columns = SUITES
        .iter()
        .flat_map(|s| ["SR, %", "IR, %", "RSR, %"].map(|name| Column::new(suite_title(s), name)))
        .collect();
    let row = |perturbation: &&str| {
        let cells = SUITES
            .iter()
            .flat_map(|suite| {
                let line = line(suite, FULL, setting);
                let rates = line.rates(source, perturbation);
                let paper: Option<PaperRates> = line.paper(source, perturbation);
                [
                    Cell::Share {
                        ours: rates.map(|r| r.sr),
                        paper: paper.map(|p| p.sr),
                    },
                    Cell::Share {
                        ours: rates.map(|r| r.ir),
                        paper: paper.and_then(|p| p.ir),
                    },
                    Cell::Share {
                        ours: rates.and_then(|r| r.rsr),
                        paper: paper.and_then(|p| p.rsr),
                    },
                ]
            })
            .collect();
        Row::new(*perturbation, cells)
    };
    Table {
        topic: Topic::Success,
        id: format!("behaviour-{}", setting.slug()),
        title: format!("Interventions and recoveries: {}", setting.label()),
        caption: format!(
            "The paper's Table 2, of the {MAIN} surrogate with FIT-MAC: success rate, share of \
             episodes in which at least one action of the policy was replaced, and success among \
             those."
        ),
        rows_are: "perturbation".to_owned(),
        columns,
        rows: std::iter::once(&"none")
            .chain(&PERTURBATIONS)
            .map(row)
            .collect(),
    }
}
