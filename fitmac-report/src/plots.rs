//! Plots as SVG.

mod bars;
mod curves;
mod frame;

use std::collections::BTreeMap;

use self::bars::{Bar, Group, grouped};
use self::curves::{Curve, Point, Steps, curves, distribution};
pub(crate) use self::frame::escape;
use crate::Plot;
use crate::paper::Experiment;
use crate::select::{self, BASE, FULL, PERTURBATIONS, SUITES, Setting};
use crate::tables::{Source, by_displacement, delays};

/// All plots that the results can fill.
pub(crate) fn all(source: Source<'_>) -> Vec<Plot> {
    let mut plots = Vec::new();
    for setting in source.episodes.own_settings() {
        for backbone in source.episodes.backbones() {
            plots.extend(success(source, backbone, &setting));
        }
        plots.extend(displaced(source, &setting));
        plots.extend(detected(source, &setting));
    }
    plots
}

fn success(source: Source<'_>, backbone: &str, setting: &Setting) -> Option<Plot> {
    let mut groups = Vec::new();
    for suite in SUITES {
        for perturbation in std::iter::once("none").chain(PERTURBATIONS) {
            let bar = |config: &str| {
                let at = select::Cell {
                    suite,
                    perturbation,
                    backbone,
                    config,
                    setting,
                };
                let paper =
                    source
                        .paper
                        .get(Experiment::Backbones, suite, perturbation, backbone, config);
                source.episodes.rates(&at).map(|rates| Bar {
                    share: rates.sr,
                    paper: paper.map(|p| 0.01 * p.sr),
                })
            };
            let bars = [bar(BASE), bar(FULL)];
            if bars.iter().any(Option::is_some) {
                groups.push(Group {
                    name: perturbation.replace("none", "nominal"),
                    of: suite.to_owned(),
                    bars,
                });
            }
        }
    }
    if groups.is_empty() {
        return None;
    }
    let title = format!("Success, {backbone} surrogate: {}", setting.label());
    Some(Plot {
        id: format!("plot-success-{backbone}-{}", setting.slug()),
        caption: "Success rate by cell with its Wilson 95 % interval; a diamond is the paper's \
                  figure for the model that the surrogate is named after."
            .to_owned(),
        svg: grouped(&title, ["surrogate alone", "with FIT-MAC"], &groups),
        title,
    })
}

fn displaced(source: Source<'_>, setting: &Setting) -> Option<Plot> {
    let measured = by_displacement(source, setting);
    let curve =
        |((backbone, config), rates): (&(String, String), &BTreeMap<u32, select::Rates>)| {
            let what = if config == BASE {
                "alone"
            } else {
                "with FIT-MAC"
            };
            Curve {
                name: format!("{backbone} {what}"),
                points: rates
                    .iter()
                    .map(|(mm, rates)| Point {
                        x: f64::from(*mm) / 10.0,
                        share: rates.sr,
                    })
                    .collect(),
            }
        };
    let list: Vec<Curve> = measured.iter().map(curve).collect();
    if list.is_empty() {
        return None;
    }
    let title = format!("Displacement, surrogates: {}", setting.label());
    Some(Plot {
        id: format!("plot-displacement-{}", setting.slug()),
        caption: "Success rate over the distance by which the thing that Pos moves is displaced, \
                  with Wilson 95 % intervals."
            .to_owned(),
        svg: curves(&title, "displacement, cm", &list),
        title,
    })
}

fn detected(source: Source<'_>, setting: &Setting) -> Option<Plot> {
    let mut list = Vec::new();
    for backbone in source.episodes.backbones() {
        let records = source.episodes.of_config(backbone, FULL, setting);
        let mut values = delays(&records);
        values.sort_by(f64::total_cmp);
        if values.len() >= 2 {
            list.push(Steps {
                name: backbone.to_owned(),
                values,
            });
        }
    }
    if list.is_empty() {
        return None;
    }
    let title = format!(
        "Time to detect, surrogates with FIT-MAC: {}",
        setting.label()
    );
    Some(Plot {
        id: format!("plot-detection-{}", setting.slug()),
        caption: "Share of the episodes with an onset and an intervention in which the first \
                  action was replaced at most so many policy steps of 50 ms after the onset."
            .to_owned(),
        svg: distribution(&title, "steps after the onset", &list),
        title,
    })
}
