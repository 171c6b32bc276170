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
}

/// Coefficients of the logistic model of [`kappa`]: constant, margin, support,
/// detection, margin times support, margin times detection.
///
/// Fitted by `cargo run --release -p fitmac-agents --example reliability -- fit`
/// on generated scenes, seeds 1000 to 1019 with the default detector and 1020 to
/// 1039 with the harsh one; the reliability that the
/// documentation quotes was measured on the seeds 7, 11, 13, 17 and 23.
pub const COEFFICIENTS: [f64; 6] = [-2.899, -0.621, 4.004, -1.306, 0.473, 1.144];

/// The model's terms.
#[must_use]
pub fn terms(evidence: &Evidence) -> [f64; 6] {
    let Evidence {
        margin,
        support,
        detection,
    } = *evidence;
    [
        1.0,
        margin,
        support,
        detection,
        margin * support,
        margin * detection,
    ]
}

/// Probability that the best candidate is the one that is meant, in [0, 1].
#[must_use]
pub fn kappa(evidence: &Evidence) -> f64 {
    let sum: f64 = terms(evidence)
        .iter()
        .zip(COEFFICIENTS)
        .map(|(term, weight)| term * weight)
        .sum();
    1.0 / (1.0 + (-sum).exp())
}

/// Evidence for the best of ranked candidates.
pub(super) fn evidence(best: &Ranked, second: Option<&Ranked>) -> Evidence {
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
    }
}
