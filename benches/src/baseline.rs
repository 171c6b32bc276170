//! The instructions of a tick as they were when they were last looked at:
//! `benches/baseline/core.toml`.

use std::{collections::BTreeMap, fs, path::PathBuf};

use anyhow::Context;
use serde::{Deserialize, Serialize};

use crate::ticks::Cost;

/// A count may be higher by this share: another patch release of the C library, say.
const TOLERANCE: f64 = 0.02;

/// Instructions of the ticks of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Ticks that were counted.
    pub ticks: usize,
    /// Without the motion generator, median.
    pub decision_median: u64,
    /// Without the motion generator, the dearest.
    pub decision_most: u64,
    /// The motion generator, median.
    pub motion_median: u64,
    /// The motion generator, the dearest.
    pub motion_most: u64,
}

/// By kind of tick.
pub type Table = BTreeMap<String, Counts>;

impl Counts {
    /// What there is to say of these ticks.
    #[must_use]
    pub fn of(costs: &[Cost]) -> Self {
        let sorted = |pick: fn(&Cost) -> u64| {
            let mut all: Vec<u64> = costs.iter().map(pick).collect();
            all.sort_unstable();
            let at = |i: usize| all.get(i).copied().unwrap_or(0);
            (at(all.len() / 2), at(all.len().saturating_sub(1)))
        };
        let (decision_median, decision_most) = sorted(|c| c.decision);
        let (motion_median, motion_most) = sorted(|c| c.motion);
        Self {
            ticks: costs.len(),
            decision_median,
            decision_most,
            motion_median,
            motion_most,
        }
    }

    fn named(&self) -> [(&'static str, u64); 4] {
        [
            ("decision, median", self.decision_median),
            ("decision, dearest", self.decision_most),
            ("motion, median", self.motion_median),
            ("motion, dearest", self.motion_most),
        ]
    }
}

/// All costs, by kind, and over all kinds as `dearest`.
#[must_use]
pub fn table(costs: &BTreeMap<String, Vec<Cost>>) -> Table {
    let mut table = Table::new();
    let mut faults = Vec::new();
    for (kind, costs) in costs {
        if kind.starts_with("faults") {
            faults.extend_from_slice(costs);
        } else {
            table.insert(kind.clone(), Counts::of(costs));
        }
    }
    if !faults.is_empty() {
        table.insert("faults".to_owned(), Counts::of(&faults));
    }
    table
}

/// Where the baseline is kept.
#[must_use]
pub fn file() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/baseline/core.toml"))
}

/// The baseline.
///
/// # Errors
/// Where it is not there or not understood.
pub fn read() -> anyhow::Result<Table> {
    let shown = "benches/baseline/core.toml";
    let text = fs::read_to_string(file()).with_context(|| format!("{shown} cannot be read"))?;
    toml::from_str(&text).with_context(|| format!("{shown} is not understood"))
}

/// Writes a new baseline.
///
/// # Errors
/// Where it cannot be written.
pub fn write(table: &Table) -> anyhow::Result<()> {
    let head = "# Instructions of a tick by its kind, x86-64, fat LTO.\n\
                # Made by `cargo xtask bench core --renew`, compared by every test run.\n\n";
    let text = toml::to_string(table).context("the baseline as TOML")?;
    fs::write(file(), head.to_owned() + &text).context("the baseline cannot be written")
}

/// What is worse than the baseline, a sentence each.
#[must_use]
pub fn worse(baseline: &Table, now: &Table) -> Vec<String> {
    let mut worse = Vec::new();
    for (kind, was) in baseline {
        let Some(is) = now.get(kind) else {
            worse.push(format!("{kind}: no such tick was seen"));
            continue;
        };
        for ((what, was), (_, is)) in was.named().into_iter().zip(is.named()) {
            if is as f64 > was as f64 * (1.0 + TOLERANCE) {
                worse.push(format!(
                    "{kind}: {what}: {is} instructions instead of {was}"
                ));
            }
        }
    }
    worse
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(decision: u64) -> Table {
        let one = Cost {
            decision,
            motion: 100,
        };
        table(&BTreeMap::from([("idle".to_owned(), vec![one; 3])]))
    }

    #[test]
    fn a_count_that_grew_is_worse_and_one_that_shrank_is_not() {
        assert_eq!(worse(&counts(1000), &counts(1020)), Vec::<String>::new());
        assert_eq!(worse(&counts(1000), &counts(900)), Vec::<String>::new());
        let found = worse(&counts(1000), &counts(1021));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("1021 instructions instead of 1000"));
        assert_eq!(worse(&counts(1000), &Table::new()).len(), 1);
    }
}
