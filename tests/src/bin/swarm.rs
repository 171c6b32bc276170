//! Runs the swarm from a seed on: `cargo xtask swarm`.

use std::{
    process::ExitCode,
    time::{Duration, Instant},
};

use clap::Parser;
use fitmac_core_tests::swarm::{Failure, Summary, sweep};

/// Time between two lines of progress.
const PROGRESS_EVERY: Duration = Duration::from_secs(10);

/// Faults around the core, drawn from seeds.
#[derive(Parser)]
#[command(bin_name = "cargo xtask swarm")]
struct Args {
    /// Control ticks to run, at least; whole runs only.
    #[arg(long, default_value_t = 1_000_000)]
    ticks: u64,
    /// The first seed.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

fn main() -> ExitCode {
    let Args { ticks, seed } = Args::parse();
    match run(seed, ticks) {
        Ok(sum) => {
            println!("{}", report(seed, &sum));
            ExitCode::SUCCESS
        }
        Err(failure) => {
            println!("{failure}");
            ExitCode::FAILURE
        }
    }
}

fn run(first: u64, ticks: u64) -> Result<Summary, Failure> {
    let begin = Instant::now();
    let mut said = begin;
    sweep(first, ticks, |seed, sum| {
        if said.elapsed() < PROGRESS_EVERY {
            return;
        }
        said = Instant::now();
        let rate = sum.ticks as f64 / begin.elapsed().as_secs_f64();
        let left_min = ticks.saturating_sub(sum.ticks) as f64 / rate / 60.0;
        eprintln!(
            "seed {seed}: {} of {ticks} ticks, {:.2} million a second, {left_min:.1} min left",
            sum.ticks,
            rate / 1e6
        );
    })
}

fn report(first: u64, sum: &Summary) -> String {
    let Summary {
        runs,
        ticks,
        faulty,
        queries,
        corrections,
        rebinds,
        alive_after_ns,
        fingerprint,
    } = sum;
    let alive_s = *alive_after_ns as f64 * 1e-9;
    format!(
        "{ticks} ticks in {runs} runs from seed {first}: no invariant was broken\n\
         {faulty} ticks in a hold or a stop, {queries} queries, {corrections} with a recovery, {rebinds} rebinds\n\
         every run played actions again within {alive_s:.1} s of simulated time after its faults\n\
         fingerprint of all commands {fingerprint:016x}"
    )
}
