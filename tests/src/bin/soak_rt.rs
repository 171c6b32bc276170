//! A long run of one controller with demo after demo around it:
//! `cargo xtask soak-rt`.

use std::{
    process::ExitCode,
    time::{Duration, Instant},
};

use clap::Parser;
use fitmac_tests::soak_rt::{Cell, Sample, count, grown, kept};

/// Demos after which everyone has come and gone often enough, and at least so
/// many that are compared.
const DEMOS_BEFORE: usize = 3;
const DEMOS: usize = 4;

/// One controller at 1 kHz, demo after demo around it.
#[derive(Parser)]
#[command(bin_name = "cargo xtask soak-rt")]
struct Args {
    /// How long.
    #[arg(long, default_value_t = 1800)]
    seconds: u64,
    /// How long each demo lasts.
    #[arg(long, default_value_t = 30)]
    demo_seconds: u64,
    /// The first demo's seed; the next ones follow.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    let wrong = soak(&Args::parse());
    for what in &wrong {
        println!("FAILED: {what}");
    }
    if wrong.is_empty() {
        println!("nothing grew, and every tick is recorded or counted");
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs and prints; what is wrong.
fn soak(args: &Args) -> Vec<String> {
    let mut cell = Cell::start();
    let (begun, lasts) = (Instant::now(), Duration::from_secs(args.demo_seconds));
    let mut samples: Vec<Sample> = Vec::new();
    let (mut demos, mut done) = (0, 0);
    while begun.elapsed().as_secs() < args.seconds || settled(&samples).len() < DEMOS {
        done += u64::from(cell.demo(args.seed + demos, lasts));
        demos += 1;
        let sample = match cell.sample() {
            Ok(sample) => sample,
            Err(error) => return vec![format!("the controller is gone: {error}")],
        };
        println!("after demo {demos} ({done} done) {sample}");
        samples.push(sample);
    }
    let (instance, trace) = (cell.instance().clone(), cell.trace());
    let (ended, _folder) = cell.finish();
    println!("{}", ended.stderr.trim_end());
    let mut wrong = grown(settled(&samples));
    if !ended.status.success() {
        wrong.push(format!("the controller ended with {}", ended.status));
    }
    let left = instance.files();
    if !left.is_empty() {
        wrong.push(format!("left behind: {left:?}"));
    }
    let number = |name| count(&ended.stderr, name).unwrap_or(u64::MAX);
    let (ticks, unrecorded) = (number("ticks"), number("unrecorded_ticks"));
    match kept(&trace) {
        Err(error) => wrong.push(error.to_string()),
        Ok(kept) => {
            println!(
                "{ticks} ticks, {} of them in the trace, {unrecorded} counted as not recorded",
                kept.ticks
            );
            wrong.extend(kept.damage);
            if kept.ticks + unrecorded != ticks || kept.missing > unrecorded {
                wrong.push(format!("{} ticks are missing in the trace", kept.missing));
            }
        }
    }
    if number("recorders_failed") != 0 {
        wrong.push("a recorder failed".to_owned());
    }
    wrong
}

/// The samples from when nothing more is on its way to its size: the black box
/// reaches half a minute back, and connections to those who have left are given
/// up when their successors come.
fn settled(samples: &[Sample]) -> &[Sample] {
    const FULL: Duration = Duration::from_secs(60);
    let fills = samples.iter().position(|s| s.at > FULL);
    let first = fills.unwrap_or(0).max(DEMOS_BEFORE);
    samples.get(first..).unwrap_or_default()
}
