//! Runs a grid on all cores.

use std::collections::{HashMap, HashSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::episode::play;
use super::grid::{EpisodeSpec, Grid, Shard};
use super::record::EpisodeRecord;
use super::store::{Destination, Store};
use crate::error::SimError;

/// What has happened so far, for a progress display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress<'a> {
    /// Episodes of the share.
    pub total: usize,
    /// Episodes done, those of earlier runs included.
    pub done: usize,
    /// The episode that was just finished; none at the start.
    pub last: Option<&'a EpisodeRecord>,
}

/// What a run did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Episodes of the share.
    pub total: usize,
    /// Episodes that were already there.
    pub found: usize,
    /// Episodes that were run now.
    pub run: usize,
    /// Successes among those.
    pub successes: usize,
    /// Simulated time of those, s.
    pub simulated_s: f64,
    /// Whether it was asked to stop before the end.
    pub stopped: bool,
}

/// Runs what is missing of a shard of some grids, in their order, on `jobs` threads (0 for all
/// cores). What grids have in common is played once.
///
/// `stop` is looked at before each episode; what runs is finished and kept.
///
/// # Errors
/// The first error of an episode or of the file; whatever was finished is kept.
pub fn run(
    grids: &[Grid],
    destination: &Destination<'_>,
    jobs: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn(Progress<'_>) + Sync),
) -> Result<Summary, SimError> {
    let Shard { index, count } = destination.shard;
    let mut builds = HashMap::new();
    let mut all = Vec::new();
    let mut known = HashSet::new();
    for grid in grids {
        builds.extend(grid.builds()?);
        let specs = grid.episodes()?.into_iter();
        all.extend(specs.filter(|spec| known.insert(spec.key())));
    }
    let share: Vec<EpisodeSpec> = all
        .into_iter()
        .enumerate()
        .filter(|(i, _)| *i % count as usize == index as usize)
        .map(|(_, spec)| spec)
        .collect();
    let store = Store::open(destination)?;
    let mut missing = Vec::new();
    for spec in &share {
        let build = builds.get(&spec.suite).map_or("", String::as_str);
        if !store.has(spec, build)? {
            missing.push(spec);
        }
    }
    let total = share.len();
    let found = total - missing.len();
    progress(Progress {
        total,
        done: found,
        last: None,
    });
    let shared = Mutex::new((
        store,
        Summary {
            total,
            found,
            ..Summary::default()
        },
    ));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(jobs)
        .build()
        .map_err(|e| {
            SimError::invalid(
                format!("{jobs} jobs"),
                format!("the threads can't be started: {e}"),
            )
        })?;
    let ran = pool.install(|| {
        // In order: what matters most stands first, and a run may be ended early.
        missing.iter().par_bridge().try_for_each(|spec| {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let record = play(spec).map_err(|cause| SimError::Within {
                place: format!("episode {}", spec.key()),
                cause: Box::new(cause),
            })?;
            // A thread that panicked left nothing half done: a line is written in one go.
            let mut shared = shared
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            let (store, summary) = &mut *shared;
            store.append(&record)?;
            summary.run += 1;
            summary.successes += usize::from(record.success);
            summary.simulated_s += record.sim_seconds;
            let done = summary.found + summary.run;
            progress(Progress {
                total,
                done,
                last: Some(&record),
            });
            Ok(())
        })
    });
    let (store, mut summary) = shared
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    ran?;
    summary.stopped = summary.found + summary.run < total;
    if !summary.stopped {
        store.sort(&share)?;
    }
    Ok(summary)
}
