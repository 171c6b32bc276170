//! What a reported confidence is worth.

use super::Outcome;
use crate::grounder::Verdict;

/// Locks whose kappa lies in one tenth of the range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bin {
    /// Locks.
    pub locks: u32,
    /// Those that are right.
    pub right: u32,
    /// Sum of their kappas.
    pub kappa: f64,
}

/// The locks by tenths of their kappa.
#[must_use]
pub fn reliability(outcomes: &[Outcome]) -> [Bin; 10] {
    let mut bins = [Bin::default(); 10];
    for outcome in outcomes.iter().filter(|o| o.verdict != Verdict::NotFound) {
        let bin = &mut bins[((outcome.kappa * 10.0) as usize).min(9)];
        bin.locks += 1;
        bin.right += u32::from(outcome.right);
        bin.kappa += outcome.kappa;
    }
    bins
}

/// Expected calibration error: mean distance of what was told from what holds,
/// over all locks; 0 without any.
#[must_use]
pub fn calibration_error(bins: &[Bin]) -> f64 {
    let locks: u32 = bins.iter().map(|bin| bin.locks).sum();
    let off: f64 = bins
        .iter()
        .map(|bin| (bin.kappa - f64::from(bin.right)).abs())
        .sum();
    off / f64::from(locks.max(1))
}
