//! Confidence of a lock, calibrated.

use super::rank::Ranked;

/// What the confidence is computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Logarithm of the best weight over the second best, 0 to 6; 6 without a
    /// second.
    pub margin: f64,
    /// How well name and relation of the best hold together, 0 to 1.
    pub support: f64,
    /// The detector's confidence in the best, 0 to 1.
    pub detection: f64,
    /// The detector's mean confidence in all objects of the scene, 0 to 1: on a
    /// bad day a rival may be missed or misnamed.
    pub scene: f64,
    /// No other candidate was seen.
    pub alone: bool,
    /// The candidates are compared with each other ("nearest", "on the left"):
    /// one that wasn't seen may have been the one.
    pub compared: bool,
}

/// Number of terms of the logistic model of [`kappa`].
pub const TERMS: usize = 13;

/// What the terms are, in order.
pub const TERM_NAMES: [&str; TERMS] = [
    "constant",
    "margin",
    "support",
    "detection",
    "scene",
    "alone",
    "margin x support",
    "margin x detection",
    "margin x scene",
    "alone x scene",
    "compared",
    "compared x scene",
    "margin x scene x scene",
];

/// Coefficients of the logistic model of [`kappa`], one a term.
///
/// Fitted by `cargo run --release -p fitmac-agents --example reliability -- fit`
/// on generated scenes, seeds 1000 to 1019 with the default detector and 1020 to
/// 1039 with the harsh one, the correction on 1040 to 1069; the reliability that the
/// documentation quotes was measured on the seeds 7, 11, 13, 17 and 23.
pub const COEFFICIENTS: [f64; TERMS] = [
    -2.250, -0.728, 4.020, -1.125, -1.106, -5.262, 0.816, 0.918, 1.150, 5.518, -3.146, 5.337,
    -1.175,
];

/// The model's terms.
#[must_use]
pub fn terms(evidence: &Evidence) -> [f64; TERMS] {
    let Evidence {
        margin,
        support,
        detection,
        scene,
        alone,
        compared,
    } = *evidence;
    let compared = f64::from(u8::from(compared));
    let alone = f64::from(u8::from(alone));
    [
        1.0,
        margin,
        support,
        detection,
        scene,
        alone,
        margin * support,
        margin * detection,
        margin * scene,
        alone * scene,
        compared,
        compared * scene,
        margin * scene * scene,
    ]
}

/// What the logistic model says, and the share of right locks where it says
/// that, on scenes that it was not fitted to (see [`COEFFICIENTS`]): rising,
/// straight between the points.
pub const KNOTS: &[(f64, f64)] = &[
    (0.0, 0.0),
    (0.018, 0.007),
    (0.032, 0.010),
    (0.049, 0.020),
    (0.093, 0.102),
    (0.430, 0.468),
    (0.529, 0.505),
    (0.551, 0.507),
    (0.624, 0.623),
    (0.663, 0.637),
    (0.696, 0.672),
    (0.818, 0.900),
    (0.951, 0.958),
    (0.992, 0.973),
    (0.995, 0.994),
    (0.997, 0.995),
    (0.998, 0.996),
    (0.999, 0.999),
];

/// Probability that the best candidate is the one that is meant, in [0, 1].
#[must_use]
pub fn kappa(evidence: &Evidence) -> f64 {
    corrected(raw(evidence))
}

fn corrected(raw: f64) -> f64 {
    let above = KNOTS.partition_point(|knot| knot.0 < raw);
    match (
        above.checked_sub(1).and_then(|at| KNOTS.get(at)),
        KNOTS.get(above),
    ) {
        (Some(low), Some(high)) => {
            let part = (raw - low.0) / (high.0 - low.0);
            low.1 + part * (high.1 - low.1)
        }
        (Some(end), None) | (None, Some(end)) => end.1,
        (None, None) => raw,
    }
}

/// The logistic model's probability, not yet corrected by [`KNOTS`].
#[must_use]
pub fn raw(evidence: &Evidence) -> f64 {
    let sum: f64 = terms(evidence)
        .iter()
        .zip(COEFFICIENTS)
        .map(|(term, weight)| term * weight)
        .sum();
    1.0 / (1.0 + (-sum).exp())
}

/// What the whole scene and the whole phrase say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) confidence: f64,
    pub(super) compared: bool,
}

/// Evidence for the best of ranked candidates.
pub(super) fn evidence(best: &Ranked, second: Option<&Ranked>, look: Look) -> Evidence {
    let floor = 1e-9;
    let margin = second.map_or(6.0, |second| {
        ((best.weight + floor) / (second.weight + floor))
            .ln()
            .clamp(0.0, 6.0)
    });
    Evidence {
        margin,
        support: best.matched.fit * best.relation,
        detection: best.matched.confidence,
        scene: look.confidence,
        alone: second.is_none(),
        compared: look.compared,
    }
}
