//! What a tick of the core costs: instructions by Valgrind, and its time beside one hop of a
//! message over iceoryx2 in the same run.
//!
//! `cargo xtask bench core [--json | --check | --renew | --search SEEDS]`. The exit status is 1 if
//! a count is worse than the baseline's; what misses a target is said, and `docs/measures.md` says
//! what takes the instructions.

#[path = "core/hop.rs"]
mod hop;
#[path = "core/session.rs"]
mod session;

use std::process::ExitCode;

use anyhow::{Context, bail, ensure};
use fitmac_benches::{
    baseline::{self, Table},
    rounds::{self, Batch, Times},
    ticks::{self, Ticks},
};
use serde_json::json;

/// Targets for the instructions of the decision: of the ordinary tick while the policy is watched,
/// and of any.
const MONITORED_AT_MOST: u64 = 2_500;
const ANY_AT_MOST: u64 = 6_000;
const SEARCH_TICKS: usize = 1000;
const ROUNDS: usize = 400;

enum Task {
    Measure { json: bool },
    Check,
    Renew,
    Search { seeds: u64 },
}

fn task(mut arguments: impl Iterator<Item = String>) -> anyhow::Result<Task> {
    let mut task = Task::Measure { json: false };
    while let Some(argument) = arguments.next() {
        task = match argument.as_str() {
            "--bench" => continue, // cargo adds it
            "--json" => Task::Measure { json: true },
            "--check" => Task::Check,
            "--renew" => Task::Renew,
            "--search" => {
                let seeds = arguments
                    .next()
                    .context("--search needs a number of seeds")?;
                let seeds = seeds.parse().context("--search needs a number of seeds")?;
                Task::Search { seeds }
            }
            other => bail!(
                "{other:?} is not an option; there are: --json, --check, --renew, --search SEEDS"
            ),
        };
    }
    Ok(task)
}

const NO_VALGRIND: &str = "Valgrind is not installed, so no instructions are counted: install it \
                           (Debian, Ubuntu: `apt-get install valgrind`)";

fn counts() -> anyhow::Result<Option<Table>> {
    Ok(ticks::count(Ticks::Known)?.map(|costs| baseline::table(&costs)))
}

fn check() -> anyhow::Result<()> {
    let Some(now) = counts()? else {
        println!("{NO_VALGRIND}");
        return Ok(());
    };
    compare(&now)?;
    println!("no tick costs more than in the baseline");
    Ok(())
}

fn compare(now: &Table) -> anyhow::Result<()> {
    let worse = baseline::worse(&baseline::read()?, now);
    ensure!(
        worse.is_empty(),
        "more instructions than the baseline (`--renew` if that is meant): {}",
        worse.join("; ")
    );
    Ok(())
}

fn search(seeds: u64) -> anyhow::Result<()> {
    let found = ticks::count(Ticks::Search {
        seeds,
        ticks: SEARCH_TICKS,
    })?;
    let found = found.context(NO_VALGRIND)?;
    let mut all: Vec<_> = found
        .iter()
        .flat_map(|(kind, costs)| costs.iter().map(move |cost| (cost, kind)))
        .collect();
    all.sort_by_key(|(cost, _)| std::cmp::Reverse(cost.decision));
    println!("the dearest of {} ticks:", all.len());
    for (cost, kind) in all.iter().take(10) {
        println!(
            "{:>6} and {:>6} for the motion: {kind}",
            cost.decision, cost.motion
        );
    }
    Ok(())
}

/// The dearest tick of all kinds, without the motion generator.
fn dearest(table: &Table) -> u64 {
    table.values().map(|c| c.decision_most).max().unwrap_or(0)
}

/// What has a target, the target, and what was reached.
fn targets(table: &Table) -> [(&'static str, u64, u64); 2] {
    let monitored = table.get("monitored").map_or(0, |c| c.decision_median);
    [
        ("a monitored tick (median)", MONITORED_AT_MOST, monitored),
        ("the dearest tick of all", ANY_AT_MOST, dearest(table)),
    ]
}

/// Ticks of a session and hops of a message, alternating.
struct Timed {
    monitored: Times,
    recovery: Times,
    hop: Times,
}

impl Timed {
    fn measure() -> anyhow::Result<Self> {
        let mut monitored = session::Recorded::competent();
        let mut recovery = session::Recorded::frozen();
        let hops = hop::Hop::start()?;
        let (monitored_ticks, recovery_ticks) = (monitored.len(), recovery.len());
        let times = rounds::race_batches(
            ROUNDS,
            &mut || {},
            &mut [
                batch(monitored_ticks, &mut || monitored.play()),
                batch(recovery_ticks, &mut || recovery.play()),
                batch(hop::BATCH, &mut || hops.batch()),
            ],
        );
        hops.end()?;
        match times.as_slice() {
            &[monitored, recovery, hop] => Ok(Self {
                monitored,
                recovery,
                hop,
            }),
            _ => bail!("a batch has no time"),
        }
    }
}

fn batch(calls: usize, run: &mut dyn FnMut()) -> Batch<'_> {
    Batch { calls, run }
}

fn print(table: Option<&Table>, timed: &Timed) {
    match table {
        None => println!("{NO_VALGRIND}"),
        Some(table) => {
            println!("Instructions of a tick (decision; motion generator):");
            println!(
                "{:<18} {:>6} {:>9} {:>9} {:>9} {:>9}",
                "", "ticks", "median", "dearest", "median", "dearest"
            );
            for (kind, c) in table {
                println!(
                    "{kind:<18} {:>6} {:>9} {:>9} {:>9} {:>9}",
                    c.ticks, c.decision_median, c.decision_most, c.motion_median, c.motion_most
                );
            }
            for (what, target, reached) in targets(table) {
                let verdict = if reached <= target { "met" } else { "MISSED" };
                println!("{what}: {reached} of at most {target}: {verdict}");
            }
        }
    }
    println!("\nTime, medians; ratio to one hop of 512 bytes between two cores by iceoryx2:");
    for (what, times) in [
        ("a tick of a session that goes well", &timed.monitored),
        ("a tick of a session with recoveries", &timed.recovery),
        ("a hop", &timed.hop),
    ] {
        println!(
            "{what:<38} {:>8.0} ns {:>7.2}   (best {:.0} ns, {:.2})",
            times.median_ns,
            times.median_ns / timed.hop.median_ns,
            times.best_ns,
            times.best_ns / timed.hop.best_ns
        );
    }
}

fn measure(as_json: bool) -> anyhow::Result<()> {
    let table = counts()?;
    let timed = Timed::measure()?;
    if as_json {
        let times = |times: &Times| {
            json!({
                "median_ns": times.median_ns,
                "best_ns": times.best_ns,
                "ratio_median": times.median_ns / timed.hop.median_ns,
                "ratio_best": times.best_ns / timed.hop.best_ns,
            })
        };
        let timed = json!({
            "monitored": times(&timed.monitored),
            "recovery": times(&timed.recovery),
            "hop": times(&timed.hop),
        });
        let targets = table.as_ref().map(|table| {
            targets(table).map(|(what, target, reached)| {
                json!({ "what": what, "target": target, "reached": reached })
            })
        });
        let found = json!({ "instructions": table, "targets": targets, "times": timed });
        println!("{found:#}");
    } else {
        print(table.as_ref(), &timed);
    }
    table.as_ref().map_or(Ok(()), compare)
}

fn main() -> ExitCode {
    let result = task(std::env::args().skip(1)).and_then(|task| match task {
        Task::Measure { json } => measure(json),
        Task::Check => check(),
        Task::Renew => match counts()? {
            Some(table) => baseline::write(&table),
            None => bail!(NO_VALGRIND),
        },
        Task::Search { seeds } => search(seeds),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench core: {error:#}");
            ExitCode::FAILURE
        }
    }
}
