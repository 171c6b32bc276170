//! Timing side by side: in every round each contestant does the same batch, one after the other
//! on one core, so that whatever else the machine does falls on all of them alike.

use std::time::Instant;

use anyhow::Context;
use rustix::thread::{CpuSet, sched_getcpu, sched_setaffinity};

/// Times of one contestant, per call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// The best round, in nanoseconds a call.
    pub best_ns: f64,
    /// The median round, in nanoseconds a call.
    pub median_ns: f64,
    /// The median over the rounds of the time in that of the first contestant in the same round:
    /// what holds on a busy machine, where rounds differ more than contestants do.
    pub paired: f64,
}

/// Keeps this thread on the core that it is on.
///
/// # Errors
/// Where the system forbids it.
pub fn stay_on_one_core() -> anyhow::Result<usize> {
    let core = sched_getcpu();
    let mut cores = CpuSet::new();
    cores.set(core);
    sched_setaffinity(None, &cores).context("the benchmark cannot be bound to one core")?;
    Ok(core)
}

/// Runs every contestant's batch of `calls` calls once a round.
pub fn race(rounds: usize, calls: usize, contestants: &mut [&mut dyn FnMut()]) -> Vec<Times> {
    race_prepared(rounds, calls, &mut || {}, contestants)
}

/// The same, with something done before each round that is not timed, such as bringing what all
/// contestants read into the cache: the first one would pay for it alone.
pub fn race_prepared(
    rounds: usize,
    calls: usize,
    prepare: &mut dyn FnMut(),
    contestants: &mut [&mut dyn FnMut()],
) -> Vec<Times> {
    let mut batches: Vec<Batch<'_>> = Vec::new();
    for run in contestants {
        batches.push(Batch { calls, run });
    }
    race_batches(rounds, prepare, &mut batches)
}

/// Some calls of one contestant.
pub struct Batch<'a> {
    /// How many.
    pub calls: usize,
    /// Makes them.
    pub run: &'a mut dyn FnMut(),
}

/// Runs every contestant's batch, whatever its length, once a round.
pub fn race_batches(
    rounds: usize,
    prepare: &mut dyn FnMut(),
    batches: &mut [Batch<'_>],
) -> Vec<Times> {
    let mut times = vec![Vec::with_capacity(rounds); batches.len()];
    // A few rounds before the first that counts: caches and branch predictors.
    for round in 0..rounds + 5 {
        prepare();
        for (batch, times) in batches.iter_mut().zip(&mut times) {
            let start = Instant::now();
            (batch.run)();
            let taken = start.elapsed().as_nanos() as f64 / batch.calls as f64;
            if round >= 5 {
                times.push(taken);
            }
        }
    }
    let first = times.first().cloned().unwrap_or_default();
    let summary = |mut times: Vec<f64>| {
        let mut ratios: Vec<f64> = times.iter().zip(&first).map(|(t, f)| t / f).collect();
        ratios.sort_by(f64::total_cmp);
        times.sort_by(f64::total_cmp);
        Times {
            best_ns: times.first().copied().unwrap_or(f64::NAN),
            median_ns: middle(&times),
            paired: middle(&ratios),
        }
    };
    times.into_iter().map(summary).collect()
}

fn middle(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
