//! What was measured, as text and as JSON, and which bounds were missed.

use fitmac_rt::{counters::Cadence, histogram::Histogram};
use serde_json::{Value, json};

use crate::{PERIOD_NS, distribution::Distribution, wake::Beside};

/// Largest ratios of state to command to the floor.
const P50_AT_MOST: f64 = 1.5;
const P99_AT_MOST: f64 = 2.0;

/// A whole run.
pub(crate) struct Report {
    /// What woke beside the loop.
    pub(crate) beside: Beside,
    /// Idle and loaded.
    pub(crate) conditions: Vec<Condition>,
}

/// What was measured in one condition.
#[derive(Default)]
pub(crate) struct Condition {
    /// Its name.
    pub(crate) name: &'static str,
    /// Round trips of the echo, all blocks.
    pub(crate) floor: Distribution,
    /// Round trips of FIT-MAC, all blocks.
    pub(crate) ours: Distribution,
    /// Of each block the medians, then the 99th percentiles: the floor's, ours.
    blocks: Vec<[[u64; 2]; 2]>,
    /// From the beginning of a tick to its command sent.
    tick: Distribution,
    /// How late the loop woke.
    pub(crate) wake: Distribution,
    /// How late the bare one woke.
    pub(crate) bare: Distribution,
    /// Its ticks take this long too, ns: an overrun needs a wake-up that is
    /// later than the rest of the period.
    clocked_tick: Distribution,
    ticks: u64,
    overruns: u64,
    skipped: u64,
}

impl Condition {
    pub(crate) fn new(name: &'static str) -> Self {
        Self {
            name,
            ..Self::default()
        }
    }

    pub(crate) fn add_round_trips(
        &mut self,
        floor: Distribution,
        ours: Distribution,
        cadence: &Cadence,
    ) {
        let both = [500, 990].map(|permille| [floor.quantile(permille), ours.quantile(permille)]);
        self.blocks.push(both);
        self.floor.merge(&floor);
        self.ours.merge(&ours);
        add(&mut self.tick, &cadence.busy);
    }

    pub(crate) fn add_wake_ups(&mut self, bare: &Distribution, cadence: &Cadence) {
        let count = |name| cadence.value(name).unwrap_or(0);
        self.bare.merge(bare);
        add(&mut self.wake, &cadence.wake);
        add(&mut self.clocked_tick, &cadence.busy);
        self.ticks += count("ticks");
        self.overruns += count("overruns");
        self.skipped += count("skipped_periods");
    }

    /// Ours to the floor's: the median block's of each. A burst of other work
    /// spoils a few blocks, and each side's in turn.
    fn ratio(&self, of: usize) -> f64 {
        let median = |side: usize| {
            let mut sorted: Vec<u64> = self.blocks.iter().map(|b| b[of][side]).collect();
            sorted.sort_unstable();
            sorted
                .get(sorted.len() / 2)
                .map_or(f64::NAN, |&ns| ns as f64)
        };
        median(1) / median(0)
    }

    /// Overruns that wake-ups as late as those of the bare loop explain: its
    /// latencies above what a tick leaves of the period, in as many ticks.
    fn explained(&self) -> f64 {
        let room_ns = PERIOD_NS.saturating_sub(self.clocked_tick.quantile(990));
        let share = self.bare.at_least(room_ns) as f64 / self.bare.count().max(1) as f64;
        share * self.ticks as f64
    }

    /// Whether the overruns are more than that by three standard deviations of
    /// the difference of two counts.
    fn overruns_too_often(&self) -> bool {
        let (ours, theirs) = (self.overruns as f64, self.explained());
        ours - theirs > 3.0 * (ours + theirs).sqrt()
    }

    fn missed(&self) -> Vec<String> {
        let mut missed = Vec::new();
        for (of, most, what) in [(0, P50_AT_MOST, "p50"), (1, P99_AT_MOST, "p99")] {
            let ratio = self.ratio(of);
            if ratio.is_nan() || ratio > most {
                let name = self.name;
                missed.push(format!(
                    "{name}: {what} is {ratio:.2} of the floor's, not {most}"
                ));
            }
        }
        if self.overruns_too_often() {
            missed.push(format!(
                "{}: {} overruns, of which late wake-ups explain {:.1}",
                self.name,
                self.overruns,
                self.explained()
            ));
        }
        missed
    }

    fn json(&self) -> Value {
        let blocks: Vec<Value> = self
            .blocks
            .iter()
            .map(|[p50, p99]| {
                json!({
                    "floor_p50_ns": p50[0],
                    "state_to_command_p50_ns": p50[1],
                    "floor_p99_ns": p99[0],
                    "state_to_command_p99_ns": p99[1],
                })
            })
            .collect();
        json!({
            "condition": self.name,
            "ratio_p50": self.ratio(0),
            "ratio_p99": self.ratio(1),
            "blocks": blocks,
            "floor": self.floor.json(),
            "state_to_command": self.ours.json(),
            "tick": self.tick.json(),
            "wake": self.wake.json(),
            "bare_wake": self.bare.json(),
            "ticks": self.ticks,
            "overruns": self.overruns,
            "skipped_periods": self.skipped,
            "overruns_explained": self.explained(),
        })
    }
}

fn add(all: &mut Distribution, histogram: &Histogram) {
    for (time_ns, times) in histogram.filled() {
        all.add(time_ns, times);
    }
}

impl Report {
    pub(crate) fn new(beside: Beside) -> Self {
        Self {
            beside,
            conditions: Vec::new(),
        }
    }

    /// The bounds that are missed.
    pub(crate) fn missed(&self) -> Vec<String> {
        self.conditions.iter().flat_map(Condition::missed).collect()
    }

    /// Everything; the ratios at the top are those of the worse condition.
    pub(crate) fn json(&self) -> Value {
        let worst = |of| {
            let ratios = self.conditions.iter().map(|c| c.ratio(of));
            ratios.fold(f64::NEG_INFINITY, f64::max)
        };
        let conditions: Vec<Value> = self.conditions.iter().map(Condition::json).collect();
        json!({
            "ratio_p50": worst(0),
            "ratio_p99": worst(1),
            "bare_wake_by": self.beside.name(),
            "conditions": conditions,
            "missed": self.missed(),
        })
    }
}

impl core::fmt::Display for Report {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for c in &self.conditions {
            writeln!(
                f,
                "{:<34} {:>9} {:>9} {:>9} {:>9}   {:>8}",
                format!("{} (us)", c.name),
                "p50",
                "p99",
                "p99.9",
                "max",
                "n"
            )?;
            for (what, times) in [
                ("bare echo (floor)", &c.floor),
                ("state to command", &c.ours),
                ("  of it the tick", &c.tick),
                ("the loop's wake-up", &c.wake),
                ("beside it", &c.bare),
            ] {
                writeln!(f, "{what:<34} {times}")?;
            }
            writeln!(
                f,
                "ratio to the floor, medians of {} blocks: p50 {:.2}, p99 {:.2}",
                c.blocks.len(),
                c.ratio(0),
                c.ratio(1)
            )?;
            writeln!(
                f,
                "overruns: {} in {} ticks ({} periods skipped); wake-ups as late as beside it \
                 explain {:.1}\n",
                c.overruns,
                c.ticks,
                c.skipped,
                c.explained()
            )?;
        }
        writeln!(f, "Beside the loop, on its core: {}", self.beside.name())
    }
}
