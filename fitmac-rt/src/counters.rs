//! What is counted, by name.

use core::sync::atomic::{AtomicU64, Ordering::Relaxed};

use fitmac_core::intake::{Refusal, RefusalCounts};

use crate::{histogram::Histogram, message::COUNTER_CAPACITY, port::ReceiverCounts};

/// What the loop counts.
#[derive(Debug, Default)]
pub struct LoopCounters {
    /// Control ticks.
    pub ticks: AtomicU64,
    /// Ticks that ended after the next one's deadline, or began that late.
    pub overruns: AtomicU64,
    /// Periods without a tick, because of overruns.
    pub skipped: AtomicU64,
    /// Messages that the transport did not take.
    pub publish_faults: AtomicU64,
    /// Ticks that the recorder did not get, because its ring was full.
    pub unrecorded: AtomicU64,
    /// Recorders that gave up, because the disk did.
    pub recorders_failed: AtomicU64,
}

/// How long things took, and what was counted; the control thread writes, any
/// thread reads.
#[derive(Debug, Default)]
pub struct Cadence {
    /// Counters of the loop.
    pub counters: LoopCounters,
    /// From the time asked for to the return of the sleep, ns: what
    /// `cyclictest` calls latency.
    pub wake: Histogram,
    /// From the deadline to the beginning of the tick, ns.
    pub lateness: Histogram,
    /// From the beginning of the tick to its command sent, ns.
    pub busy: Histogram,
    /// From the state's send stamp to the command sent, ns; ticks with a new
    /// sample only.
    pub response: Histogram,
    receivers: Receivers,
    refusals: Refusals,
}

/// Services that the controller receives, and what is counted of each.
const RECEIVERS: [&str; 7] = [
    "state",
    "chunk",
    "grounding",
    "plan",
    "verifier",
    "critic",
    "request",
];
const OF_RECEIVER: [&str; 5] = [
    "received",
    "overwritten",
    "malformed",
    "transport_faults",
    "sessions",
];
const OF_LOOP: [&str; 6] = [
    "ticks",
    "overruns",
    "skipped_periods",
    "publish_faults",
    "unrecorded_ticks",
    "recorders_failed",
];
/// Counters in all.
pub const COUNT: usize = OF_LOOP.len() + RECEIVERS.len() * OF_RECEIVER.len() + Refusal::ALL.len();
const _: () = assert!(COUNT <= COUNTER_CAPACITY);

#[derive(Debug)]
struct Receivers([AtomicU64; RECEIVERS.len() * OF_RECEIVER.len()]);

impl Default for Receivers {
    fn default() -> Self {
        Self(core::array::from_fn(|_| AtomicU64::new(0)))
    }
}

#[derive(Debug)]
struct Refusals([AtomicU64; Refusal::ALL.len()]);

impl Default for Refusals {
    fn default() -> Self {
        Self(core::array::from_fn(|_| AtomicU64::new(0)))
    }
}

/// The names of all counters, in the order of [`Cadence::values`].
#[must_use]
pub fn names() -> Vec<String> {
    let of_receivers = RECEIVERS.iter().flat_map(|service| {
        OF_RECEIVER
            .iter()
            .map(move |what| format!("{service}.{what}"))
    });
    let refused = Refusal::ALL.iter().map(|r| format!("refused.{}", r.name()));
    OF_LOOP
        .iter()
        .map(|&name| name.to_owned())
        .chain(of_receivers)
        .chain(refused)
        .collect()
}

impl Cadence {
    /// Copies the receivers' counts to where other threads see them.
    pub(crate) fn publish_receivers(&self, counts: &[(&'static str, ReceiverCounts); 7]) {
        for (i, (name, c)) in counts.iter().enumerate() {
            debug_assert_eq!(*name, RECEIVERS[i]);
            let values = [
                c.received,
                c.overwritten,
                c.malformed,
                c.transport,
                c.sessions,
            ];
            for (j, value) in values.into_iter().enumerate() {
                self.receivers.0[i * values.len() + j].store(value, Relaxed);
            }
        }
    }

    /// Copies the core's counts of refused messages to where other threads see them.
    pub(crate) fn publish_refusals(&self, counts: &RefusalCounts) {
        for (place, (_, count)) in self.refusals.0.iter().zip(counts.iter()) {
            place.store(u64::from(count), Relaxed);
        }
    }

    /// All counters, in the order of [`names`].
    #[must_use]
    pub fn values(&self) -> [u64; COUNT] {
        let c = &self.counters;
        let of_loop = [
            &c.ticks,
            &c.overruns,
            &c.skipped,
            &c.publish_faults,
            &c.unrecorded,
            &c.recorders_failed,
        ];
        let mut values = [0; COUNT];
        let all = of_loop
            .into_iter()
            .chain(&self.receivers.0)
            .chain(&self.refusals.0);
        for (value, counter) in values.iter_mut().zip(all) {
            *value = counter.load(Relaxed);
        }
        values
    }

    /// The counter of this name.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<u64> {
        let at = names().iter().position(|n| n == name)?;
        self.values().get(at).copied()
    }
}

/// Adds to a counter that one thread writes.
pub(crate) fn add(counter: &AtomicU64, n: u64) {
    counter.store(counter.load(Relaxed).wrapping_add(n), Relaxed);
}

impl core::fmt::Display for Cadence {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (what, histogram) in [
            ("wake-up", &self.wake),
            ("lateness", &self.lateness),
            ("tick", &self.busy),
            ("state to command", &self.response),
        ] {
            writeln!(f, "{what:<17} {}", histogram.summary())?;
        }
        let counted: Vec<String> = names()
            .iter()
            .zip(self.values())
            .filter(|(name, value)| *value > 0 || OF_LOOP.contains(&name.as_str()))
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        write!(f, "{:<17} {}", "counted", counted.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_counter_has_a_name_and_its_own_place() {
        let cadence = Cadence::default();
        let mut counts = RECEIVERS.map(|name| (name, ReceiverCounts::default()));
        counts[1].1.malformed = 4;
        counts[6].1.sessions = 5;
        cadence.publish_receivers(&counts);
        add(&cadence.counters.skipped, 3);
        assert_eq!(names().len(), COUNT);
        assert_eq!(cadence.value("chunk.malformed"), Some(4));
        assert_eq!(cadence.value("request.sessions"), Some(5));
        assert_eq!(cadence.value("skipped_periods"), Some(3));
        assert_eq!(cadence.values().iter().filter(|v| **v > 0).count(), 3);
        assert_eq!(cadence.value("nonsense"), None);
    }
}
