//! The tables: the paper's in the paper's layout, then what the paper does not ask.

mod ablation;
mod backbones;
mod cost;
mod failures;
mod knowledge;
mod main_table;
mod remaining;
mod seeds;
mod sweeps;
mod timing;

pub use ablation::ablation;
pub use backbones::backbones;
pub use cost::{cost, pairs_of};
pub use failures::failures;
pub use knowledge::knowledge;
pub use main_table::main_table;
pub use remaining::{ceilings, remaining};
pub use seeds::seeds;
pub use sweeps::{by_displacement, displacement, sweeps};
pub use timing::{delays, timing};

use crate::paper::{Experiment, Paper};
use crate::select::{self, Episodes, PERTURBATIONS, Rates, SUITES, Setting};
use crate::stats::mean_and_spread;
use crate::table::{Cell, Column, Table};

/// What tables are made of.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Ours.
    pub episodes: &'a Episodes<'a>,
    /// The paper's.
    pub paper: &'a Paper,
}

/// All tables that the results can fill, by topic.
#[must_use]
pub fn all(source: Source<'_>) -> Vec<Table> {
    let mut tables = Vec::new();
    for setting in source.episodes.own_settings() {
        tables.extend(main_table(source, &setting));
        tables.extend(backbones(source, &setting));
        tables.extend(ablation(source, &setting));
        tables.extend(sweeps(source, &setting));
        tables.extend(seeds(source, &setting));
        tables.extend(displacement(source, &setting));
        tables.extend(timing(source, &setting));
        tables.extend(remaining(source, &setting));
        tables.extend(ceilings(source, &setting));
        tables.extend(failures(source, &setting));
    }
    tables.extend(cost(source));
    tables.extend(knowledge(source));
    tables.sort_by_key(|table| table.topic);
    tables
}

/// A suite as headings name it.
fn suite_title(suite: &str) -> String {
    let mut letters = suite.chars();
    let first = letters.next().map(|c| c.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

/// A row of the rates over the five perturbations, with the mean success rate at its end.
struct Line<'a> {
    experiment: Experiment,
    suite: &'a str,
    backbone: &'a str,
    config: &'a str,
    setting: &'a Setting,
}

/// Mean success rates over the five perturbations, in percent: ours and the paper's. A mean is
/// given only if all five cells are there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Means {
    ours: Option<f64>,
    paper: Option<f64>,
}

impl Means {
    fn cell(self) -> Cell {
        Cell::compared(self.ours, self.paper, 1)
    }

    /// Mean of two suites.
    fn with(self, other: Self) -> Self {
        let both = |a: Option<f64>, b: Option<f64>| Some(0.5 * (a? + b?));
        Self {
            ours: both(self.ours, other.ours),
            paper: both(self.paper, other.paper),
        }
    }

    /// Points more than another.
    fn over(self, other: Self) -> Self {
        let less = |a: Option<f64>, b: Option<f64>| Some(a? - b?);
        Self {
            ours: less(self.ours, other.ours),
            paper: less(self.paper, other.paper),
        }
    }
}

impl Line<'_> {
    fn rates(&self, source: Source<'_>, perturbation: &str) -> Option<Rates> {
        source.episodes.rates(&select::Cell {
            suite: self.suite,
            perturbation,
            backbone: self.backbone,
            config: self.config,
            setting: self.setting,
        })
    }

    fn cells(&self, source: Source<'_>) -> Vec<Cell> {
        PERTURBATIONS
            .iter()
            .map(|perturbation| Cell::Rates {
                ours: self.rates(source, perturbation),
                paper: self.paper(source, perturbation),
            })
            .chain([self.means(source).cell()])
            .collect()
    }

    fn paper(&self, source: Source<'_>, perturbation: &str) -> Option<crate::paper::PaperRates> {
        let Self {
            experiment,
            suite,
            backbone,
            config,
            ..
        } = self;
        source
            .paper
            .get(*experiment, suite, perturbation, backbone, config)
    }

    fn means(&self, source: Source<'_>) -> Means {
        let mean = |values: Vec<f64>| {
            mean_and_spread(&values)
                .filter(|_| values.len() == PERTURBATIONS.len())
                .map(|(mean, _)| mean)
        };
        let ours = PERTURBATIONS
            .iter()
            .filter_map(|p| Some(100.0 * self.rates(source, p)?.sr.share));
        let paper = PERTURBATIONS
            .iter()
            .filter_map(|p| Some(self.paper(source, p)?.sr));
        Means {
            ours: mean(ours.collect()),
            paper: mean(paper.collect()),
        }
    }
}

/// Columns of a [`Line`].
fn line_columns() -> Vec<Column> {
    PERTURBATIONS
        .iter()
        .map(|p| Column::new("SR/IR/RSR, %", *p))
        .chain([Column::new("", "mean SR")])
        .collect()
}

/// The two suites' means of a configuration.
fn both_suites(
    source: Source<'_>,
    experiment: Experiment,
    backbone: &str,
    config: &str,
    setting: &Setting,
) -> [Means; 2] {
    SUITES.map(|suite| {
        Line {
            experiment,
            suite,
            backbone,
            config,
            setting,
        }
        .means(source)
    })
}
