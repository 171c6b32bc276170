//! A histogram that the control thread fills and any thread reads.

use core::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Buckets per power of two: values are kept to 1/64, about 1.6 %.
const SUB: u32 = 64;
const SUB_BITS: u32 = SUB.trailing_zeros();
/// Values up to 2^40 ns, about 18 minutes; larger ones count as that.
const MAX_BITS: u32 = 40;
const BUCKETS: usize = ((MAX_BITS - SUB_BITS + 1) * SUB) as usize;

/// Counts durations in buckets of constant relative width. One thread records,
/// without locked instructions; any thread may take a [`Summary`] at any time.
#[derive(Debug)]
pub struct Histogram {
    buckets: Box<[AtomicU64]>,
    max: AtomicU64,
}

/// Percentiles of a histogram, in its unit (ns).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Summary {
    /// Values recorded.
    pub count: u64,
    /// Half of the values are at most this.
    pub p50: u64,
    /// 99 of 100 are.
    pub p99: u64,
    /// 999 of 1000 are.
    pub p999: u64,
    /// The largest, exactly.
    pub max: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

impl Histogram {
    /// An empty histogram.
    #[must_use]
    pub fn new() -> Self {
        Self {
            buckets: (0..BUCKETS).map(|_| AtomicU64::new(0)).collect(),
            max: AtomicU64::new(0),
        }
    }

    /// Counts a value. To be called from one thread only: a second one would
    /// lose counts.
    pub fn record(&self, value: u64) {
        let bucket = &self.buckets[index_of(value)];
        bucket.store(bucket.load(Relaxed) + 1, Relaxed);
        if value > self.max.load(Relaxed) {
            self.max.store(value, Relaxed);
        }
    }

    /// The percentiles so far.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let counts: Vec<u64> = self.buckets.iter().map(|b| b.load(Relaxed)).collect();
        let count: u64 = counts.iter().sum();
        let max = self.max.load(Relaxed);
        let percentile = |permille: u64| {
            // The rank of the value below which that share lies, at least 1.
            let rank = (count * permille).div_ceil(1000).max(1);
            let mut seen = 0;
            counts
                .iter()
                .position(|n| {
                    seen += n;
                    seen >= rank
                })
                .map_or(0, |i| upper_bound(i).min(max))
        };
        Summary {
            count,
            p50: percentile(500),
            p99: percentile(990),
            p999: percentile(999),
            max,
        }
    }

    /// The buckets that hold something: (largest value of the bucket, count).
    #[must_use]
    pub fn filled(&self) -> Vec<(u64, u64)> {
        self.buckets
            .iter()
            .enumerate()
            .map(|(i, n)| (upper_bound(i), n.load(Relaxed)))
            .filter(|(_, n)| *n > 0)
            .collect()
    }
}

fn index_of(value: u64) -> usize {
    let value = value.min((1 << MAX_BITS) - 1);
    if value < u64::from(SUB) {
        return value as usize;
    }
    // The leading bit and the SUB_BITS below it.
    let shift = 63 - value.leading_zeros() - SUB_BITS;
    let sub = (value >> shift) as u32 - SUB;
    ((shift + 1) * SUB + sub) as usize
}

fn upper_bound(index: usize) -> u64 {
    let index = index as u64;
    let (octave, sub) = (index / u64::from(SUB), index % u64::from(SUB));
    match octave {
        0 => sub,
        _ => ((u64::from(SUB) + sub + 1) << (octave - 1)) - 1,
    }
}

impl core::fmt::Display for Summary {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let us = |ns: u64| ns as f64 / 1e3;
        write!(
            f,
            "p50 {:.2} us, p99 {:.2} us, p99.9 {:.2} us, max {:.2} us (n = {})",
            us(self.p50),
            us(self.p99),
            us(self.p999),
            us(self.max),
            self.count
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_lies_in_its_bucket_within_the_promised_width() {
        let mut values: Vec<u64> = (0..5000).collect();
        values.extend((13..40).flat_map(|b| [(1 << b) - 1, 1 << b, (1 << b) + 12_345 % (1 << b)]));
        for v in values {
            let i = index_of(v);
            let upper = upper_bound(i);
            assert!(upper >= v, "{v} above its bucket {upper}");
            assert!(
                upper as f64 <= v as f64 * (1.0 + 1.0 / 64.0),
                "{v}: {upper}"
            );
            assert!(i == 0 || upper_bound(i - 1) < v, "{v} fits a lower bucket");
        }
        assert_eq!(index_of(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn percentiles_agree_with_sorting() {
        let h = Histogram::new();
        let mut sorted: Vec<u64> = (0..10_000_u64).map(|i| i * i % 70_001).collect();
        sorted.iter().for_each(|&v| h.record(v));
        sorted.sort_unstable();
        let s = h.summary();
        for (got, rank) in [(s.p50, 5000), (s.p99, 9900), (s.p999, 9990)] {
            let exact = sorted[rank - 1];
            assert!(
                got >= exact && got as f64 <= exact as f64 * 1.016 + 1.0,
                "{got} {exact}"
            );
        }
        assert_eq!((s.count, s.max), (10_000, sorted[9999]));
        assert_eq!(Histogram::new().summary(), Summary::default());
    }
}
