//! A tick through C and through Python beside the same tick in Rust, in one run on one core.
//!
//! `cargo xtask bench ffi [--json] [--no-counts] [--no-python]`. All three run the same recorded
//! inputs (an episode with a wrong target, corrected) through the `guarded` profile,
//! alternating. C is a loop compiled by `cc` that calls the library through a pointer; Python is
//! the installed package, message objects in and out. The exit status is 1 if C takes more than
//! 1.05 of Rust's time.

#![allow(unsafe_code)]

#[path = "ffi/c.rs"]
mod c;
#[path = "ffi/inputs.rs"]
mod inputs;
#[path = "ffi/python.rs"]
mod python;

use std::{hint::black_box, ops::Range, process::ExitCode};

use anyhow::{Context, bail, ensure};
use fitmac_benches::{
    callgrind,
    rounds::{self, Times},
};
use fitmac_core::{Controller, Params, ValidParams};
use inputs::Batches;
use serde_json::{Value, json};

/// The bound of a tick through C, in that of Rust.
const C_AT_MOST: f64 = 1.05;
const C_ROUNDS: usize = 10_000;
const PYTHON_ROUNDS: usize = 30;

enum Task {
    Measure {
        json: bool,
        counts: bool,
        python: bool,
    },
    /// Under Valgrind: one contestant's episode, some times.
    Repeat { contestant: String, batches: usize },
}

fn task(mut arguments: impl Iterator<Item = String>) -> anyhow::Result<Task> {
    let (mut json, mut counts, mut python) = (false, true, true);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--json" => json = true,
            "--no-counts" => counts = false,
            "--no-python" => python = false,
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
            other => {
                bail!("{other:?} is not an option; there are: --json, --no-counts, --no-python")
            }
        }
    }
    Ok(Task::Measure {
        json,
        counts,
        python,
    })
}

/// The loop in Rust: what a host that links the core as a crate does.
struct RustHost<'a> {
    steps: &'a [inputs::Step],
    params: ValidParams,
    core: Box<Controller>,
}

impl<'a> RustHost<'a> {
    fn new(steps: &'a [inputs::Step]) -> anyhow::Result<Self> {
        let params = Params::guarded().validate();
        let params = params.map_err(|violations| anyhow::anyhow!("{violations}"))?;
        Ok(Self {
            steps,
            params,
            core: Box::new(Controller::new(params)),
        })
    }

    fn run(&mut self, steps: Range<usize>) {
        if steps.start == 0 {
            *self.core = Controller::new(self.params);
        }
        for step in &self.steps[steps] {
            black_box(self.core.tick(step.now_ns, &step.input()));
        }
    }
}

/// What was measured of one contestant.
struct Row {
    name: &'static str,
    times: Times,
    /// Median time beside Rust's in the same rounds, us.
    overhead_us: f64,
    /// Per tick; none without Valgrind, and of Python.
    instructions: Option<f64>,
}

/// Races a contestant against Rust: both rows.
fn race(
    name: &'static str,
    rounds: usize,
    ticks: usize,
    prepare: &mut dyn FnMut(),
    batches: [&mut dyn FnMut(); 2],
) -> [Row; 2] {
    let [rust, other] = batches;
    eprintln!("==> Timing {name}: {rounds} rounds of {ticks} ticks each");
    let times = rounds::race_prepared(rounds, ticks, prepare, &mut [rust, other]);
    let row = |name, times: Times| Row {
        name,
        times,
        overhead_us: 1e-3 * times.median_ns * (1.0 - 1.0 / times.paired),
        instructions: None,
    };
    [row("rust", times[0]), row(name, times[1])]
}

fn measure(as_json: bool, counts: bool, python: bool) -> anyhow::Result<()> {
    let episode = inputs::episode();
    let steps = inputs::parse(&episode)?;
    let core = rounds::stay_on_one_core()?;
    let mut rust = RustHost::new(&steps)?;
    let mut host = c::Host::new(&steps)?;
    let mut warmer = RustHost::new(&steps)?;
    let [mut of_warmer, mut of_rust, mut of_c] = [(); 3].map(|()| Batches::of(steps.len()));
    // The messages of a batch lie in the cache for both, as they do for a host that has just
    // received them.
    let mut warm = || warmer.run(of_warmer.next());
    let batches: [&mut dyn FnMut(); 2] = [&mut || rust.run(of_rust.next()), &mut || {
        host.run(of_c.next())
    }];
    let [mut in_rust, mut in_c] = race("c", C_ROUNDS, Batches::ticks(), &mut warm, batches);
    if counts && callgrind::installed() {
        let ticks = Batches::of(steps.len()).count() * Batches::ticks();
        in_rust.instructions = Some(callgrind::count("rust", ticks)?);
        in_c.instructions = Some(callgrind::count("c", ticks)?);
    }
    let ratio = in_c.times.paired;
    let mut rows = vec![in_rust, in_c];
    if python {
        let mut host = python::Host::start(&episode)?;
        let batches: [&mut dyn FnMut(); 2] = [&mut || rust.run(0..steps.len()), &mut || host.run()];
        let [_, in_python] = race("python", PYTHON_ROUNDS, steps.len(), &mut || {}, batches);
        rows.push(in_python);
    }
    match as_json {
        true => println!("{:#}", to_json(core, steps.len(), &rows)),
        false => print(core, &rows),
    }
    ensure!(
        ratio <= C_AT_MOST,
        "a tick through C takes {ratio:.3} of one in Rust instead of at most {C_AT_MOST}"
    );
    Ok(())
}

fn to_json(core: usize, ticks: usize, rows: &[Row]) -> Value {
    let row = |row: &Row| {
        json!({
            "contestant": row.name,
            "best_ns": row.times.best_ns,
            "median_ns": row.times.median_ns,
            "ratio": row.times.paired,
            "overhead_us": row.overhead_us,
            "instructions": row.instructions,
        })
    };
    let rows: Vec<_> = rows.iter().map(row).collect();
    json!({"core": core, "ticks": ticks, "c_at_most": C_AT_MOST, "contestants": rows})
}

fn print(core: usize, rows: &[Row]) {
    println!("On core {core}, each beside Rust, alternating; per tick. The ratio is the median of");
    println!("the rounds' own; C may take {C_AT_MOST} of Rust.");
    println!(
        "{:<8} {:>10} {:>10} {:>8} {:>12} {:>13}",
        "", "best ns", "median ns", "ratio", "overhead us", "instructions"
    );
    for row in rows {
        println!(
            "{:<8} {:>10.1} {:>10.1} {:>8.3} {:>12.3} {:>13}",
            row.name,
            row.times.best_ns,
            row.times.median_ns,
            row.times.paired,
            row.overhead_us,
            number(row.instructions, 0),
        );
    }
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

fn repeat(contestant: &str, episodes: usize) -> anyhow::Result<()> {
    let episode = inputs::episode();
    let steps = inputs::parse(&episode)?;
    let (mut rust, mut host) = (RustHost::new(&steps)?, c::Host::new(&steps)?);
    let mut batches = Batches::of(steps.len());
    for _ in 0..episodes * batches.count() {
        match contestant {
            "rust" => rust.run(batches.next()),
            "c" => host.run(batches.next()),
            other => bail!("there is no contestant {other:?}"),
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    let result = task(std::env::args().skip(1)).and_then(|task| match task {
        Task::Measure {
            json,
            counts,
            python,
        } => measure(json, counts, python),
        Task::Repeat {
            contestant,
            batches,
        } => repeat(&contestant, batches),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench ffi: {error:#}");
            ExitCode::FAILURE
        }
    }
}
