//! Forward kinematics and the motion generator against their peers, in one run on one core.
//!
//! `cargo xtask bench kinematics [--json] [--no-counts]`. The tip's frame and its Jacobian for
//! the Panda: our general chain, our Panda constant, Pinocchio (C++) and the crate `k`.
//! Trajectories to a target state for 3 and 7 axes: ours and Ruckig's (C++). Every side is
//! compiled for the same baseline processor. Before anything is timed the results are compared.
//! The exit status is 1 if a bound on a ratio is missed.

#[path = "kinematics/motion.rs"]
mod motion;
#[path = "kinematics/report.rs"]
mod report;
#[path = "kinematics/tip.rs"]
mod tip;

use std::process::ExitCode;

use anyhow::{Context, bail, ensure};
use fitmac_benches::{callgrind, peers, rounds};
use report::{Group, Row};

/// What a run is asked for.
enum Task {
    Measure {
        json: bool,
        counts: bool,
    },
    /// Under Valgrind: one contestant's batch, some times.
    Repeat {
        contestant: String,
        batches: usize,
    },
}

fn task(mut arguments: impl Iterator<Item = String>) -> anyhow::Result<Task> {
    let (mut json, mut counts) = (false, true);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--json" => json = true,
            "--no-counts" => counts = false,
            "--bench" => {} // cargo adds it
            callgrind::OPTION => {
                let contestant = arguments.next().context("a contestant is missing")?;
                let batches = arguments.next().context("the number is missing")?;
                let batches = batches.parse().context("the number of batches")?;
                return Ok(Task::Repeat {
                    contestant,
                    batches,
                });
            }
            other => bail!("{other:?} is not an option; there are: --json, --no-counts"),
        }
    }
    Ok(Task::Measure { json, counts })
}

/// One group of contestants that solve the same problems, ours before the peers.
struct Contest {
    title: &'static str,
    calls: usize,
    rounds: usize,
    contestants: Vec<Contestant>,
}

/// A contestant: its name for the option, what it is, the bound of its time in that of the
/// first peer, and its batch.
struct Contestant {
    key: &'static str,
    what: &'static str,
    at_most: Option<f64>,
    batch: Box<dyn FnMut()>,
}

fn contests() -> anyhow::Result<Vec<Contest>> {
    let pinocchio = peers::pinocchio()?;
    let ruckig = peers::ruckig()?;
    Ok(vec![
        tip::contest(&pinocchio)?,
        motion::contest::<3>(&ruckig)?,
        motion::contest::<7>(&ruckig)?,
    ])
}

fn measure(json: bool, counts: bool) -> anyhow::Result<()> {
    let mut contests = contests()?;
    let counts = counts && {
        let installed = callgrind::installed();
        if !installed {
            eprintln!("Valgrind is not installed: no instruction counts (Debian: valgrind).");
        }
        installed
    };
    let core = rounds::stay_on_one_core()?;
    let mut groups = Vec::new();
    for contest in &mut contests {
        eprintln!("==> Timing: {}", contest.title);
        let mut batches: Vec<&mut dyn FnMut()> = Vec::new();
        for contestant in &mut contest.contestants {
            batches.push(&mut contestant.batch);
        }
        let times = rounds::race(contest.rounds, contest.calls, &mut batches);
        let mut rows = Vec::new();
        for (contestant, times) in contest.contestants.iter().zip(times) {
            let instructions = if counts {
                Some(callgrind::count(contestant.key, contest.calls)?)
            } else {
                None
            };
            rows.push(Row {
                key: contestant.key,
                what: contestant.what,
                at_most: contestant.at_most,
                times,
                instructions,
            });
        }
        groups.push(Group {
            title: contest.title,
            calls: contest.calls,
            rounds: contest.rounds,
            rows,
        });
    }
    if json {
        println!("{:#}", report::json(core, &groups));
    } else {
        report::print(core, &groups);
    }
    let missed = report::missed(&groups);
    ensure!(missed.is_empty(), "too slow: {}", missed.join("; "));
    Ok(())
}

fn repeat(contestant: &str, batches: usize) -> anyhow::Result<()> {
    let mut all = contests()?.into_iter().flat_map(|c| c.contestants);
    let mut one = all
        .find(|one| one.key == contestant)
        .with_context(|| format!("there is no contestant {contestant:?}"))?;
    (0..batches).for_each(|_| (one.batch)());
    Ok(())
}

fn main() -> ExitCode {
    let result = task(std::env::args().skip(1)).and_then(|task| match task {
        Task::Measure { json, counts } => measure(json, counts),
        Task::Repeat {
            contestant,
            batches,
        } => repeat(&contestant, batches),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench kinematics: {error:#}");
            ExitCode::FAILURE
        }
    }
}
