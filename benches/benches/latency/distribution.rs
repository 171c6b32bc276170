//! How often which time was measured.

use std::collections::BTreeMap;

use serde_json::{Value, json};

/// Times, ns, and how often each was measured.
#[derive(Clone, Debug, Default)]
pub(crate) struct Distribution {
    counts: BTreeMap<u64, u64>,
    count: u64,
}

impl Distribution {
    /// Counts a time so often.
    pub(crate) fn add(&mut self, time_ns: u64, times: u64) {
        if times > 0 {
            *self.counts.entry(time_ns).or_default() += times;
            self.count += times;
        }
    }

    /// Counts everything of another one too.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (time_ns, times) in other.pairs() {
            self.add(time_ns, times);
        }
    }

    /// The times that occurred, in order, and how often.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (u64, u64)> {
        self.counts
            .iter()
            .map(|(&time_ns, &times)| (time_ns, times))
    }

    /// How many were measured.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// The time that so many of 1000 are at most, ns; 0 if there are none.
    pub(crate) fn quantile(&self, permille: u64) -> u64 {
        let rank = (self.count * permille).div_ceil(1000).max(1);
        let mut seen = 0;
        let reaches = |(_, times): &(u64, u64)| {
            seen += times;
            seen >= rank
        };
        self.pairs().find(reaches).map_or(0, |(time_ns, _)| time_ns)
    }

    /// The longest, ns.
    pub(crate) fn max(&self) -> u64 {
        self.counts
            .last_key_value()
            .map_or(0, |(&time_ns, _)| time_ns)
    }

    /// How many took at least so long.
    pub(crate) fn at_least(&self, time_ns: u64) -> u64 {
        self.counts.range(time_ns..).map(|(_, times)| times).sum()
    }

    /// The figures, us.
    pub(crate) fn json(&self) -> Value {
        let us = |ns: u64| ns as f64 * 1e-3;
        json!({
            "count": self.count,
            "p50_us": us(self.quantile(500)),
            "p99_us": us(self.quantile(990)),
            "p999_us": us(self.quantile(999)),
            "max_us": us(self.max()),
        })
    }
}

impl FromIterator<u64> for Distribution {
    fn from_iter<I: IntoIterator<Item = u64>>(times: I) -> Self {
        let mut all = Self::default();
        times.into_iter().for_each(|time_ns| all.add(time_ns, 1));
        all
    }
}

impl core::fmt::Display for Distribution {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let us = |ns: u64| ns as f64 * 1e-3;
        write!(
            f,
            "{:>9.2} {:>9.2} {:>9.2} {:>9.2}   {:>8}",
            us(self.quantile(500)),
            us(self.quantile(990)),
            us(self.quantile(999)),
            us(self.max()),
            self.count
        )
    }
}
