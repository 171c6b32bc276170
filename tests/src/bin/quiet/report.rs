//! What flowed and what was counted.

use std::{
    collections::BTreeMap,
    sync::atomic::{AtomicU64, Ordering::SeqCst},
};

use fitmac_rt::frame::Tick;

/// What flowed through the loop while it was watched, seen from the recorder's side.
#[derive(Default)]
pub(crate) struct Flow {
    /// Ticks that reached the recorder.
    pub(crate) ticks: AtomicU64,
    chunks: AtomicU64,
    groundings: AtomicU64,
    rebinds: AtomicU64,
    corrections: AtomicU64,
}

impl Flow {
    /// Counts a tick, and what was in it if it is `watched`.
    pub(crate) fn see(&self, tick: &Tick, watched: bool) {
        self.ticks.fetch_add(1, SeqCst);
        let add = |to: &AtomicU64, yes: bool| to.fetch_add(u64::from(yes && watched), SeqCst);
        add(&self.chunks, tick.chunk.is_some());
        add(&self.groundings, tick.grounding.is_some());
        add(&self.rebinds, tick.output.rebind.is_some());
        let corrects = tick.output.trace.is_some_and(|t| t.sub_phase != 0);
        add(&self.corrections, corrects);
    }
}

/// What was counted.
pub(crate) struct Counted {
    /// In so many ticks.
    pub(crate) ticks: u64,
    /// That took so long.
    pub(crate) seconds: f64,
    /// Calls of the allocator.
    pub(crate) allocations: u64,
    /// Overruns of the loop.
    pub(crate) overruns: u64,
    /// System calls by name; `None` without `strace`.
    pub(crate) calls: Option<BTreeMap<String, u64>>,
}

impl Counted {
    /// System calls that are not the sleep.
    fn other_calls(&self) -> Option<u64> {
        let calls = self.calls.as_ref()?;
        let others = calls.iter().filter(|(name, _)| *name != "clock_nanosleep");
        Some(others.map(|(_, n)| n).sum())
    }
}

/// Prints what was counted; whether it is quiet.
pub(crate) fn print(as_json: bool, flow: &Flow, counted: &Counted) -> bool {
    let n = |of: &AtomicU64| of.load(SeqCst);
    let others = counted.other_calls();
    if as_json {
        let json = serde_json::json!({
            "ticks": counted.ticks,
            "seconds": counted.seconds,
            "allocations": counted.allocations,
            "system_calls": counted.calls,
            "system_calls_but_the_sleep": others,
            "overruns": counted.overruns,
            "chunks": n(&flow.chunks),
            "groundings": n(&flow.groundings),
            "rebinds": n(&flow.rebinds),
            "corrected_queries": n(&flow.corrections),
        });
        println!("{json}");
    } else {
        println!(
            "{} ticks in {:.0} s with {} chunks, {} groundings, {} rebinds, {} corrected queries",
            counted.ticks,
            counted.seconds,
            n(&flow.chunks),
            n(&flow.groundings),
            n(&flow.rebinds),
            n(&flow.corrections)
        );
        println!(
            "calls of the allocator on the control thread: {}",
            counted.allocations
        );
        match &counted.calls {
            Some(calls) => println!("system calls on the control thread: {calls:?}"),
            None => println!(
                "system calls: not counted; strace is missing (apt-get install strace) or may not trace"
            ),
        }
    }
    counted.allocations == 0 && others.unwrap_or(0) == 0
}
