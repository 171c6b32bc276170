//! The paper's Tables 3, 9 and 10.

use super::{Line, Source, both_suites, line_columns, suite_title};
use crate::paper::Experiment;
use crate::select::{BASE, FULL, SUITES, Setting};
use crate::table::{Column, Row, Table, Topic};

/// Configurations with one part switched off.
const WITHOUT: [(&str, &str); 4] = [
    ("wo-target", "without target correction"),
    ("wo-execution", "without execution correction"),
    ("wo-hard-pick", "without hard pick"),
    ("wo-hard-place", "without hard place"),
];

/// What each module is worth: in short (Table 3) and cell by cell (Tables 9 and 10), for each
/// surrogate with at least one part switched off.
#[must_use]
pub fn ablation(source: Source<'_>, setting: &Setting) -> Vec<Table> {
    let has = |name: &str, config| source.episodes.has(name, config, setting);
    let ablated = |name: &&str| WITHOUT.iter().any(|(config, _)| has(name, config));
    let mut tables = Vec::new();
    for backbone in source.episodes.backbones().into_iter().filter(ablated) {
        let configs = WITHOUT.iter().map(|(config, _)| *config);
        let players: Vec<_> = configs
            .chain([BASE, FULL])
            .map(|config| (backbone, config))
            .collect();
        let episodes = &source.episodes.on_common_draws(&players, setting);
        let source = Source { episodes, ..source };
        tables.push(short(source, backbone, setting));
        tables.extend(SUITES.map(|suite| whole(source, suite, backbone, setting)));
    }
    tables
}

fn short(source: Source<'_>, backbone: &str, setting: &Setting) -> Table {
    let means = |config: &str| both_suites(source, Experiment::Ablation, backbone, config, setting);
    let full = means(FULL);
    let row = |(config, name): &(&str, &str)| {
        let [object, spatial] = means(config);
        let cells = [
            object,
            spatial,
            object.with(spatial),
            object.over(full[0]),
            spatial.over(full[1]),
        ];
        Row::new(*name, cells.map(super::Means::cell).to_vec())
    };
    let columns = [
        ("SR, %", "Object"),
        ("SR, %", "Spatial"),
        ("SR, %", "mean"),
        ("points against full", "Object"),
        ("points against full", "Spatial"),
    ];
    Table {
        topic: Topic::Modules,
        id: format!("ablation-{backbone}-{}", setting.slug()),
        title: format!("Modules, {backbone} surrogate: {}", setting.label()),
        caption: "Mean success rate over the five perturbations, as in the paper's Table 3; all \
                  configurations on the same draws. What target correction changes is the prompt, \
                  which the surrogates named after models follow in at most 1 of 100 draws; a pick \
                  recovery goes to the grounded object without it."
            .to_owned(),
        rows_are: "configuration".to_owned(),
        columns: columns.map(|(g, n)| Column::new(g, n)).to_vec(),
        rows: std::iter::once(&(FULL, "FIT-MAC"))
            .chain(&WITHOUT)
            .map(row)
            .collect(),
    }
}

fn whole(source: Source<'_>, suite: &str, backbone: &str, setting: &Setting) -> Table {
    let configs = [(BASE, "surrogate alone"), (FULL, "FIT-MAC")];
    let row = |(config, name): &(&str, &str)| {
        let line = Line {
            experiment: Experiment::Ablation,
            suite,
            backbone,
            config,
            setting,
        };
        Row::new(*name, line.cells(source))
    };
    let title = suite_title(suite);
    Table {
        topic: Topic::Modules,
        id: format!("ablation-{backbone}-{suite}-{}", setting.slug()),
        title: format!(
            "Modules, {backbone} surrogate on {title}: {}",
            setting.label()
        ),
        caption: "As in the paper's Tables 9 and 10.".to_owned(),
        rows_are: "configuration".to_owned(),
        columns: line_columns(),
        rows: configs.iter().chain(&WITHOUT).map(row).collect(),
    }
}
