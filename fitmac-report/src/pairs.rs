//! What the controller does to a policy, episode by episode: each is compared with the one in
//! which the same policy played alone on the same draws.

use std::collections::HashMap;

use serde::Serialize;
use sim_harness::evaluation::EpisodeRecord;

use crate::stats::{Share, mcnemar_exact};

/// Pairs of episodes with and without the controller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pairs {
    /// Pairs in all.
    pub pairs: u64,
    /// Episodes with the controller that have no partner without it.
    pub unpaired: u64,
    /// Of the pairs in which the policy alone succeeds, those that fail with the controller;
    /// `None` if it never succeeds alone.
    pub harmed: Option<Share>,
    /// Exact one-sided 95 % upper bound of that share.
    pub harmed_upper: Option<f64>,
    /// Of the same pairs, those in which the controller intervened though it was not needed.
    pub unneeded: Option<Share>,
    /// Of the pairs in which the policy alone fails, those that succeed with the controller.
    pub saved: Option<Share>,
    /// McNemar's exact two-sided p-value of saved against harmed.
    pub p_value: f64,
    /// The keys of the harmed episodes.
    pub harmed_keys: Vec<String>,
}

/// Pairs episodes; `None` if there is no pair.
#[must_use]
pub fn pair(alone: &[&EpisodeRecord], with: &[&EpisodeRecord]) -> Option<Pairs> {
    let succeeds: HashMap<String, bool> = alone.iter().map(|r| (r.pair_key(), r.success)).collect();
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    let mut unpaired = 0;
    for record in with {
        match succeeds.get(&record.pair_key()) {
            Some(true) => good.push(record),
            Some(false) => bad.push(record),
            None => unpaired += 1,
        }
    }
    let pairs = (good.len() + bad.len()) as u64;
    if pairs == 0 {
        return None;
    }
    let harmed = Share::of(&good, |r| !r.success);
    let saved = Share::of(&bad, |r| r.success);
    let hits = |share: Option<Share>| share.map_or(0, |s| s.hits);
    let mut harmed_keys: Vec<String> = good
        .iter()
        .filter(|r| !r.success)
        .map(|r| r.key())
        .collect();
    harmed_keys.sort();
    Some(Pairs {
        pairs,
        unpaired,
        harmed,
        harmed_upper: harmed.map(|s| s.exact_upper()),
        unneeded: Share::of(&good, |r| r.intervened),
        saved,
        p_value: mcnemar_exact(hits(harmed), hits(saved)),
        harmed_keys,
    })
}
