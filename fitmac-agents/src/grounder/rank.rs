//! Weights of candidates: name, relation, detection.

use crate::planner::{Relation, SpatialPhrase};

use super::category::Words;
use super::pool::{Match, Pool};
use super::relation::{Volume, score, step};
use super::viewpoint::ViewAxes;

/// A candidate with what speaks for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    pub(super) matched: Match,
    /// How well the relations hold, 0 to 1.
    pub(super) relation: f64,
    /// Product of fit, relation and detection.
    pub(super) weight: f64,
}

/// Softness of a comparison between candidates, m.
const RANK_SOFT_M: f64 = 0.015;

/// Weight of a relation whose reference isn't in the scene.
const UNKNOWN_RELATION: f64 = 0.5;

/// Weighs the matches of `name` by its ranking words and by `phrase`.
pub(super) fn rank(
    pool: &Pool<'_>,
    name: &str,
    matches: Vec<Match>,
    phrase: Option<&SpatialPhrase>,
    axes: &ViewAxes,
) -> Vec<Ranked> {
    let mut relations = vec![1.0; matches.len()];
    if let Some(phrase) = phrase {
        apply_phrase(pool, &matches, phrase, axes, &mut relations);
    }
    let words = Words::of(name);
    for word in words.ranking() {
        apply_word(word, &matches, axes, &mut relations);
    }
    matches
        .into_iter()
        .zip(relations)
        .map(|(matched, relation)| {
            let seen = 0.5 + 0.5 * matched.confidence;
            Ranked {
                matched,
                relation,
                weight: matched.fit * relation * seen,
            }
        })
        .collect()
}

fn apply_phrase(
    pool: &Pool<'_>,
    matches: &[Match],
    phrase: &SpatialPhrase,
    axes: &ViewAxes,
    relations: &mut [f64],
) {
    let references = references(pool, phrase, axes);
    let holds: Vec<f64> = match phrase.relation {
        Relation::NearestTo | Relation::FarthestFrom => {
            let sign = if phrase.relation == Relation::NearestTo {
                -1.0
            } else {
                1.0
            };
            match references.first().and_then(|list| best_fit(list)) {
                Some(reference) => {
                    let value = |matched: &Match| sign * matched.volume.gap(&reference);
                    leads(matches, value)
                }
                None => vec![UNKNOWN_RELATION; matches.len()],
            }
        }
        Relation::AtLeft => leads(matches, |matched| left(matched, axes)),
        Relation::AtRight => leads(matches, |matched| -left(matched, axes)),
        Relation::AtBack => leads(matches, |matched| away(matched, axes)),
        Relation::AtFront => leads(matches, |matched| -away(matched, axes)),
        relation => matches
            .iter()
            .map(|matched| holds(relation, matched, &references, axes))
            .collect(),
    };
    for (relation, holds) in relations.iter_mut().zip(holds) {
        *relation *= if phrase.negated { 1.0 - holds } else { holds };
    }
}

/// For each reference of the phrase, the things that it may mean.
pub(super) fn references(
    pool: &Pool<'_>,
    phrase: &SpatialPhrase,
    axes: &ViewAxes,
) -> Vec<Vec<Match>> {
    let meant = |name: &String| {
        let matches = pool.named(name);
        let ranked = rank(pool, name, matches, phrase.qualifier.as_deref(), axes);
        let best = ranked
            .iter()
            .map(|ranked| ranked.weight)
            .fold(0.0, f64::max);
        // Relative to the best: one reference is meant.
        ranked
            .into_iter()
            .filter(|ranked| ranked.weight > 0.05 * best)
            .map(|ranked| Match {
                fit: ranked.weight / best,
                ..ranked.matched
            })
            .collect()
    };
    phrase.references.iter().map(meant).collect()
}

fn best_fit(list: &[Match]) -> Option<Volume> {
    let best = list.iter().max_by(|a, b| a.fit.total_cmp(&b.fit));
    best.map(|matched| matched.volume)
}

/// How well the relation holds for the best choice of references.
fn holds(relation: Relation, matched: &Match, references: &[Vec<Match>], axes: &ViewAxes) -> f64 {
    let others = |list: &[Match]| -> Vec<Match> {
        list.iter()
            .filter(|other| other.thing != matched.thing)
            .copied()
            .collect()
    };
    let mut lists = references.iter().map(|list| others(list));
    match (relation.arity(), lists.next(), lists.next()) {
        (2, Some(first), Some(second)) => {
            if first.is_empty() || second.is_empty() {
                return UNKNOWN_RELATION;
            }
            let pairs = first
                .iter()
                .flat_map(|one| second.iter().map(move |two| (one, two)));
            pairs
                .filter(|(one, two)| one.thing != two.thing)
                .map(|(one, two)| {
                    one.fit
                        * two.fit
                        * score(relation, &matched.volume, &[one.volume, two.volume], axes)
                })
                .fold(0.0, f64::max)
        }
        (_, Some(list), _) => {
            if list.is_empty() {
                return UNKNOWN_RELATION;
            }
            list.iter()
                .map(|one| one.fit * score(relation, &matched.volume, &[one.volume], axes))
                .fold(0.0, f64::max)
        }
        _ => 0.0,
    }
}

/// For each match, how plainly its value leads all others'.
fn leads(matches: &[Match], value: impl Fn(&Match) -> f64) -> Vec<f64> {
    let values: Vec<f64> = matches.iter().map(value).collect();
    // A thing that hardly fits the name is no rival.
    let rival = |index: usize| matches[index].fit >= 0.3;
    let lead = |at: usize| {
        let best_other = (0..values.len())
            .filter(|index| *index != at && rival(*index))
            .map(|index| values[index])
            .fold(f64::NEG_INFINITY, f64::max);
        if best_other == f64::NEG_INFINITY {
            1.0
        } else {
            step(values[at] - best_other, RANK_SOFT_M)
        }
    };
    (0..values.len()).map(lead).collect()
}

fn left(matched: &Match, axes: &ViewAxes) -> f64 {
    let [x, y, _] = matched.volume.centre_m;
    axes.components([x, y]).0
}

fn away(matched: &Match, axes: &ViewAxes) -> f64 {
    let [x, y, _] = matched.volume.centre_m;
    axes.components([x, y]).1
}

fn apply_word(word: &str, matches: &[Match], axes: &ViewAxes, relations: &mut [f64]) {
    let volume = |matched: &Match| matched.volume.size_m.iter().product::<f64>().cbrt();
    let height = |matched: &Match| matched.volume.size_m[2];
    let holds = match word {
        "left" | "leftmost" => leads(matches, |matched| left(matched, axes)),
        "right" | "rightmost" => leads(matches, |matched| -left(matched, axes)),
        "back" | "rear" => leads(matches, |matched| away(matched, axes)),
        "front" => leads(matches, |matched| -away(matched, axes)),
        "large" | "largest" | "big" | "biggest" | "huge" => leads(matches, volume),
        "small" | "smallest" | "little" | "tiny" => leads(matches, |matched| -volume(matched)),
        "tall" | "tallest" => leads(matches, height),
        "short" | "shortest" => leads(matches, |matched| -height(matched)),
        "middle" | "center" | "centre" | "central" => middle(matches),
        _ => return,
    };
    for (relation, holds) in relations.iter_mut().zip(holds) {
        *relation *= holds;
    }
}

/// Nearest to the mean of all that fit.
fn middle(matches: &[Match]) -> Vec<f64> {
    let fitting: Vec<&Match> = matches
        .iter()
        .filter(|matched| matched.fit >= 0.3)
        .collect();
    let count = fitting.len().max(1) as f64;
    let mean = |axis: usize| {
        fitting
            .iter()
            .map(|matched| matched.volume.centre_m[axis])
            .sum::<f64>()
            / count
    };
    let centre = [mean(0), mean(1)];
    leads(matches, |matched| {
        let [x, y, _] = matched.volume.centre_m;
        -(x - centre[0]).hypot(y - centre[1])
    })
}
