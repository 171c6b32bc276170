//! Rates, intervals, paired comparisons, quantiles.
//!
//! Intervals treat episodes as independent draws. Tasks are the suite's own and not a sample of
//! any, so an interval says what other seeds would give, not what other tasks would.

use serde::Serialize;

/// The 97.5th percentile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;
/// Error probability of the one-sided exact bounds.
pub const ONE_SIDED: f64 = 0.05;

/// So many of so many, as a share from 0 to 1 with its Wilson 95 % interval
/// (E. B. Wilson, JASA 22, 1927).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// How many.
    pub hits: u64,
    /// Of how many; never 0.
    pub of: u64,
    /// The share.
    pub share: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

impl Share {
    /// `hits` of `of`; `None` of none, or of fewer than hit.
    #[must_use]
    pub fn new(hits: u64, of: u64) -> Option<Self> {
        if of == 0 || hits > of {
            return None;
        }
        let (n, share) = (of as f64, hits as f64 / of as f64);
        let centre = share + Z * Z / (2.0 * n);
        let spread = Z * libm::sqrt(share * (1.0 - share) / n + Z * Z / (4.0 * n * n));
        let scale = 1.0 / (1.0 + Z * Z / n);
        // The formula gives 0 and 1 up to a rounding error.
        let low = if hits == 0 {
            0.0
        } else {
            scale * (centre - spread)
        };
        let high = if hits == of {
            1.0
        } else {
            scale * (centre + spread)
        };
        Some(Self {
            hits,
            of,
            share,
            low,
            high,
        })
    }

    /// The share of those for which `hit` holds.
    pub fn of<T>(items: impl IntoIterator<Item = T>, hit: impl Fn(&T) -> bool) -> Option<Self> {
        let (mut hits, mut of) = (0, 0);
        for item in items {
            of += 1;
            hits += u64::from(hit(&item));
        }
        Self::new(hits, of)
    }

    /// The exact one-sided 95 % upper bound (C. J. Clopper and E. S. Pearson, Biometrika 26, 1934).
    #[must_use]
    pub fn exact_upper(&self) -> f64 {
        clopper_pearson_upper(self.hits, self.of, ONE_SIDED)
    }
}

/// The share at which `hits` or fewer of `of` would have probability `alpha`.
#[must_use]
pub fn clopper_pearson_upper(hits: u64, of: u64, alpha: f64) -> f64 {
    if hits >= of {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(hits, of, middle) > alpha {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The probability of `hits` or fewer of `of` at the given share, which lies inside (0, 1).
fn at_most(hits: u64, of: u64, share: f64) -> f64 {
    let n = of as f64;
    let (yes, no) = (libm::log(share), libm::log1p(-share));
    let whole = libm::lgamma(n + 1.0);
    (0..=hits)
        .map(|k| {
            let k = k as f64;
            let ways = whole - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
            libm::exp(ways + k * yes + (n - k) * no)
        })
        .sum::<f64>()
        .min(1.0)
}

/// The two-sided exact p-value of McNemar's test: how surprising it is that of the pairs that
/// differ `one` go one way and `other` the other, if both were as likely. 1 if no pair differs.
#[must_use]
pub fn mcnemar_exact(one: u64, other: u64) -> f64 {
    if one + other == 0 {
        return 1.0;
    }
    (2.0 * at_most(one.min(other), one + other, 0.5)).min(1.0)
}

/// What is known of some numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// How many there are; never 0.
    pub count: u64,
    /// The median.
    pub median: f64,
    /// The 90th percentile.
    pub p90: f64,
    /// The greatest.
    pub max: f64,
}

impl Summary {
    /// Of some numbers; `None` of none, or if one is not a number.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        if values.iter().any(|v| v.is_nan()) {
            return None;
        }
        values.sort_by(f64::total_cmp);
        Some(Self {
            count: values.len() as u64,
            median: quantile(&values, 0.5)?,
            p90: quantile(&values, 0.9)?,
            max: *values.last()?,
        })
    }
}

/// A quantile of sorted numbers, interpolated (R's type 7); `None` of none.
#[must_use]
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let below = at as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (at - below as f64) * (sorted[above] - sorted[below]))
}

/// Mean and population standard deviation, as the paper's equation 11; `None` of none.
#[must_use]
pub fn mean_and_spread(values: &[f64]) -> Option<(f64, f64)> {
    if values.is_empty() {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    Some((mean, libm::sqrt(square)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} is not {b}");
    }

    /// R. G. Newcombe, Statistics in Medicine 17, 1998, Table I: methods 3 (score) and 5 (exact).
    const NEWCOMBE: [(u64, u64, f64, f64, f64); 4] = [
        (81, 263, 0.2553, 0.3662, 0.3676),
        (15, 148, 0.0624, 0.1605, 0.1617),
        (0, 20, 0.0, 0.1611, 0.1684),
        (1, 29, 0.0061, 0.1718, 0.1776),
    ];

    #[test]
    fn intervals_agree_with_published_values() {
        for (hits, of, low, high, exact) in NEWCOMBE {
            let share = Share::new(hits, of).unwrap();
            close(share.low, low, 5e-5);
            close(share.high, high, 5e-5);
            close(clopper_pearson_upper(hits, of, 0.025), exact, 5e-5);
        }
    }

    #[test]
    fn the_ends_are_exact() {
        assert_eq!(Share::new(0, 7).unwrap().low, 0.0);
        assert_eq!(Share::new(7, 7).unwrap().high, 1.0);
        assert_eq!(Share::new(7, 7).unwrap().exact_upper(), 1.0);
        assert!(Share::new(0, 0).is_none() && Share::new(3, 2).is_none());
        // Of n without a hit the bound is 1 - 0.05^(1/n).
        let none_of_300 = Share::new(0, 300).unwrap().exact_upper();
        close(none_of_300, 1.0 - 0.05_f64.powf(1.0 / 300.0), 1e-9);
    }

    #[test]
    fn the_exact_bound_holds_for_many() {
        // 600 of 60,000: the normal approximation of the bound is 0.0107 here.
        let bound = clopper_pearson_upper(600, 60_000, 0.05);
        close(bound, 0.01069, 2e-5);
    }

    #[test]
    fn mcnemar_is_what_the_hand_computes() {
        // 1 against 9: two tails of (C(10,0) + C(10,1)) / 2^10 = 11 / 1024.
        close(mcnemar_exact(1, 9), 22.0 / 1024.0, 1e-12);
        assert_eq!(mcnemar_exact(9, 1), mcnemar_exact(1, 9));
        close(mcnemar_exact(4, 4), 1.0, 1e-12);
        assert_eq!(mcnemar_exact(0, 0), 1.0);
        close(mcnemar_exact(0, 5), 2.0 / 32.0, 1e-12);
    }

    #[test]
    fn quantiles_and_spreads() {
        let summary = Summary::of(vec![4.0, 1.0, 2.0, 3.0]).unwrap();
        assert_eq!((summary.median, summary.max, summary.count), (2.5, 4.0, 4));
        close(summary.p90, 3.7, 1e-12);
        assert!(Summary::of(Vec::new()).is_none() && Summary::of(vec![f64::NAN]).is_none());
        let (mean, spread) = mean_and_spread(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
        assert_eq!((mean, spread), (5.0, 2.0));
    }
}
