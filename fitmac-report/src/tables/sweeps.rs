//! The paper's Tables 4 and 11 to 18, and a sweep of our own.

use std::collections::BTreeMap;

use super::{Line, Source, both_suites, line_columns, suite_title};
use crate::paper::Experiment;
use crate::select::{BASE, FULL, Rates, SUITES, Setting};
use crate::table::{Cell, Column, Row, Table, Topic};

/// The paper's sweeps: parameter, its values, and which of them is the default.
const SWEEPS: [(&str, &[&str], &str); 4] = [
    ("gate.failure_streak", &["2", "3", "4"], "3"),
    ("gate.confidence", &["0.10", "0.12", "0.18"], "0.12"),
    ("gate.rescue_min_step", &["8", "12", "16"], "12"),
    ("horizon.execution_steps", &["1", "2", "3", "4"], "2"),
];

/// How much each of four parameters matters: in short (Table 4) and cell by cell.
#[must_use]
pub fn sweeps(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let mut tables = Vec::new();
    for backbone in source.episodes.backbones() {
        for (parameter, values, default) in SWEEPS {
            let config = |value: &str| format!("full+{parameter}={value}");
            if !values
                .iter()
                .any(|v| source.episodes.has(backbone, &config(v), setting))
            {
                continue;
            }
            let names: Vec<String> = values.iter().map(|v| config(v)).collect();
            let swept = names.iter().map(String::as_str).chain([FULL]);
            let players: Vec<_> = swept.map(|config| (backbone, config)).collect();
            let episodes = &source.episodes.on_common_draws(&players, setting);
            let sweep = Sweep {
                source: Source { episodes, ..source },
                backbone,
                parameter,
                values,
                default,
                setting,
            };
            tables.push(sweep.short());
            tables.extend(SUITES.map(|suite| sweep.whole(suite)));
        }
    }
    tables
}

struct Sweep<'a> {
    source: Source<'a>,
    backbone: &'a str,
    parameter: &'a str,
    values: &'a [&'a str],
    default: &'a str,
    setting: &'a Setting,
}

impl Sweep<'_> {
    /// The configuration that has a value: the default one is not run twice.
    fn config(&self, value: &str) -> String {
        let named = format!("full+{}={value}", self.parameter);
        let played = self
            .source
            .episodes
            .has(self.backbone, &named, self.setting);
        if value == self.default && !played {
            FULL.to_owned()
        } else {
            named
        }
    }

    fn name(&self, value: &str) -> String {
        let mark = if value == self.default {
            " (default)"
        } else {
            ""
        };
        format!("{} = {value}{mark}", self.parameter)
    }

    fn short(&self) -> Table {
        let row = |value: &&str| {
            let means = |config: &str| {
                let (experiment, backbone) = (Experiment::Sweeps, self.backbone);
                both_suites(self.source, experiment, backbone, config, self.setting)
            };
            let ours = means(&self.config(value));
            let paper = means(&format!("full+{}={value}", self.parameter));
            let suites = [0, 1].map(|i| super::Means {
                ours: ours[i].ours,
                paper: paper[i].paper,
            });
            let cells = [suites[0], suites[1], suites[0].with(suites[1])];
            Row::new(self.name(value), cells.map(super::Means::cell).to_vec())
        };
        Table {
            topic: Topic::Sweeps,
            id: format!(
                "sweep-{}-{}-{}",
                self.parameter,
                self.backbone,
                self.setting.slug()
            ),
            title: format!(
                "Sweep of {}, {} surrogate: {}",
                self.parameter,
                self.backbone,
                self.setting.label()
            ),
            caption: "Mean success rate over the five perturbations, %, as in the paper's Table \
                      4; all values on the same draws."
                .to_owned(),
            rows_are: "value".to_owned(),
            columns: ["Object", "Spatial", "mean"]
                .map(|n| Column::new("SR, %", n))
                .to_vec(),
            rows: self.values.iter().map(row).collect(),
        }
    }

    fn whole(&self, suite: &str) -> Table {
        let row = |value: &&str| {
            let config = self.config(value);
            let named = format!("full+{}={value}", self.parameter);
            let line = |config| Line {
                experiment: Experiment::Sweeps,
                suite,
                backbone: self.backbone,
                config,
                setting: self.setting,
            };
            let ours = line(&config).cells(self.source);
            let paper = line(&named).cells(self.source);
            let cells = ours.into_iter().zip(paper).map(|(o, p)| beside(o, p));
            Row::new(self.name(value), cells.collect())
        };
        Table {
            topic: Topic::Sweeps,
            id: format!(
                "sweep-{}-{}-{suite}-{}",
                self.parameter,
                self.backbone,
                self.setting.slug()
            ),
            title: format!(
                "Sweep of {}, {} surrogate on {}: {}",
                self.parameter,
                self.backbone,
                suite_title(suite),
                self.setting.label()
            ),
            caption: "As in the paper's Tables 11 to 18.".to_owned(),
            rows_are: "value".to_owned(),
            columns: line_columns(),
            rows: self.values.iter().map(row).collect(),
        }
    }
}

/// Our figures of one cell with the paper's of another.
fn beside(ours: Cell, theirs: Cell) -> Cell {
    match (ours, theirs) {
        (Cell::Rates { ours, .. }, Cell::Rates { paper, .. }) => Cell::Rates { ours, paper },
        (
            Cell::Number {
                ours,
                spread,
                digits,
                ..
            },
            Cell::Number { paper, .. },
        ) => Cell::Number {
            ours,
            spread,
            paper,
            digits,
        },
        (ours, _) => ours,
    }
}

/// Success over the distance by which something is displaced, in mm, per configuration: what the
/// table and the plot of the displacement show. Empty unless something was displaced under this
/// setting.
#[must_use]
pub fn by_displacement(
    source: Source<'_>,
    setting: &Setting,
) -> BTreeMap<(String, String), BTreeMap<u32, Rates>> {
    let mut cells: BTreeMap<(String, String), BTreeMap<u32, Vec<_>>> = BTreeMap::new();
    for record in source.episodes.all() {
        let Some(distance) = distance_mm(record) else {
            continue;
        };
        let same = Setting::of(record) == *setting;
        if record.config == BASE || (record.config == FULL && same) {
            let who = (record.backbone.clone(), record.config.clone());
            cells
                .entry(who)
                .or_default()
                .entry(distance)
                .or_default()
                .push(*record);
        }
    }
    let mut rates: BTreeMap<_, BTreeMap<u32, Rates>> = BTreeMap::new();
    for (who, distances) in cells {
        let measured: BTreeMap<u32, Rates> = distances
            .into_iter()
            .filter_map(|(d, records)| Some((d, Rates::of(&records)?)))
            .collect();
        // Distance 0 alone is the nominal scene.
        if measured.keys().any(|d| *d > 0) {
            rates.insert(who, measured);
        }
    }
    let played = source.episodes.all().iter();
    let here = played.filter(|r| Setting::of(r) == *setting && distance_mm(r) > Some(0));
    if here.count() == 0 {
        rates.clear();
    }
    rates
}

/// By how much something is displaced in an episode; 0 in nominal ones, `None` in others.
fn distance_mm(record: &sim_harness::evaluation::EpisodeRecord) -> Option<u32> {
    if record.perturbation == "none" {
        return Some(0);
    }
    let metres = record
        .level
        .strip_prefix("displaced ")?
        .strip_suffix(" m")?;
    let metres: f64 = metres.parse().ok()?;
    // Saturating: what is negative or not a number becomes 0.
    Some((1000.0 * metres).round() as u32)
}

/// How far a thing can be displaced: a sweep that the paper does not have.
#[must_use]
pub fn displacement(source: Source<'_>, setting: &Setting) -> Option<Table> {
    let measured = by_displacement(source, setting);
    let mut distances: Vec<u32> = measured.values().flat_map(|m| m.keys().copied()).collect();
    distances.sort_unstable();
    distances.dedup();
    let rows: Vec<Row> = measured
        .iter()
        .map(|((backbone, config), rates)| {
            let what = if config == BASE {
                "alone"
            } else {
                "with FIT-MAC"
            };
            let cells = distances.iter().map(|d| Cell::Success {
                ours: rates.get(d).copied(),
                paper: None,
            });
            Row::new(format!("{backbone} surrogate {what}"), cells.collect())
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    Some(Table {
        topic: Topic::Sweeps,
        id: format!("displacement-{}", setting.slug()),
        title: format!("Displacement: {}", setting.label()),
        caption:
            "Success rate, %, over the distance by which the thing that Pos moves stands away \
                  from where it stood in training; on a full table the nearest distance that has \
                  a free place, at most 5 cm off. Not in the paper."
                .to_owned(),
        rows_are: "policy".to_owned(),
        columns: distances
            .iter()
            .map(|d| Column::new("displacement", format!("{} cm", f64::from(*d) / 10.0)))
            .collect(),
        rows,
    })
}
