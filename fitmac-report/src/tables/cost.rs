//! What the controller costs and saves, pair by pair: not in the paper.

use super::Source;
use crate::pairs::{Pairs, pair};
use crate::select::{BASE, FULL, Setting};
use crate::stats::Share;
use crate::table::{Cell, Column, Row, Table, Topic};

/// Which episodes a row is about.
#[derive(Clone, Copy)]
enum Scope {
    All,
    Nominal,
    Perturbed,
}

/// The pairs of a setting, of one surrogate or of all.
#[must_use]
pub fn pairs_of(source: Source<'_>, backbone: Option<&str>, setting: &Setting) -> Option<Pairs> {
    scoped(source, backbone, setting, Scope::All)
}

fn scoped(
    source: Source<'_>,
    backbone: Option<&str>,
    setting: &Setting,
    scope: Scope,
) -> Option<Pairs> {
    let names = source.episodes.backbones();
    let names = names.iter().filter(|n| backbone.is_none_or(|b| b == **n));
    let (mut alone, mut with) = (Vec::new(), Vec::new());
    for name in names {
        alone.extend(source.episodes.of_config(name, BASE, setting));
        with.extend(source.episodes.of_config(name, FULL, setting));
    }
    with.retain(|r| match scope {
        Scope::All => true,
        Scope::Nominal => r.perturbation == "none",
        Scope::Perturbed => r.perturbation != "none",
    });
    pair(&alone, &with)
}

/// Harm, unneeded interventions and what is saved.
#[must_use]
pub fn cost(source: Source<'_>) -> Option<Table> {
    let mut rows = Vec::new();
    for setting in source.episodes.settings() {
        let label = setting.label();
        let mut add = |name: String, pairs: Option<Pairs>| {
            rows.extend(pairs.map(|p| Row::new(format!("{name}: {label}"), cells(&p))));
        };
        add(
            "all surrogates, all scenes".to_owned(),
            pairs_of(source, None, &setting),
        );
        for (scope, name) in [
            (Scope::Nominal, "all surrogates, nominal scenes"),
            (Scope::Perturbed, "all surrogates, perturbed scenes"),
        ] {
            add(name.to_owned(), scoped(source, None, &setting, scope));
        }
        for backbone in source.episodes.backbones() {
            let name = format!("{backbone} surrogate, all scenes");
            add(name, pairs_of(source, Some(backbone), &setting));
        }
    }
    if rows.is_empty() {
        return None;
    }
    let columns = [
        ("", "pairs"),
        ("where it succeeds alone", "episodes"),
        ("where it succeeds alone", "harmed"),
        ("where it succeeds alone", "harm, %"),
        ("where it succeeds alone", "exact upper bound, %"),
        ("where it succeeds alone", "unneeded interventions, %"),
        ("where it fails alone", "saved, %"),
        ("", "p, saved against harmed"),
    ];
    Some(Table {
        topic: Topic::Cost,
        id: "cost".to_owned(),
        title: "What FIT-MAC costs, and what it saves".to_owned(),
        caption: "Every episode with FIT-MAC beside the one in which the same surrogate plays \
                  alone on the same draws. Harmed: the surrogate alone succeeds and the episode \
                  with FIT-MAC fails. Unneeded: it succeeds alone, and FIT-MAC replaced at least \
                  one action. Saved: it fails alone and succeeds with FIT-MAC. The exact bound is \
                  Clopper and Pearson's, one-sided, 95 %; p is McNemar's exact test, two-sided."
            .to_owned(),
        rows_are: "episodes".to_owned(),
        columns: columns.map(|(g, n)| Column::new(g, n)).to_vec(),
        rows,
    })
}

fn cells(pairs: &Pairs) -> Vec<Cell> {
    let count = |share: Option<Share>, what: fn(Share) -> u64| Cell::Count {
        ours: share.map_or(0, what),
    };
    vec![
        Cell::Count { ours: pairs.pairs },
        count(pairs.harmed, |s| s.of),
        count(pairs.harmed, |s| s.hits),
        Cell::share(pairs.harmed),
        Cell::number(pairs.harmed_upper.map(|u| 100.0 * u), 2),
        Cell::share(pairs.unneeded),
        Cell::share(pairs.saved),
        Cell::Text {
            ours: p_value(pairs.p_value),
        },
    ]
}

fn p_value(p: f64) -> String {
    if p < 0.001 {
        "< 0.001".to_owned()
    } else {
        format!("{p:.3}")
    }
}
