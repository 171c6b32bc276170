//! Runs core and model side by side: `cargo xtask soak`.

use std::{
    process::ExitCode,
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::{Duration, Instant},
};

use fitmac_core_tests::soak::{self, Disagreement, Seen};

/// Time between two lines of progress.
const PROGRESS_EVERY: Duration = Duration::from_secs(10);

fn main() -> ExitCode {
    let numbers: Option<Vec<u64>> = std::env::args().skip(1).map(|a| a.parse().ok()).collect();
    let Some(&[ticks, seed, threads]) = numbers.as_deref() else {
        eprintln!("usage: soak TICKS FIRST_SEED THREADS (`cargo xtask soak` fills them in)");
        return ExitCode::from(2);
    };
    let runs = ticks.div_ceil(soak::TICKS);
    match side_by_side(seed, runs, threads.max(1)) {
        Ok(sum) => {
            println!(
                "seeds {seed} to {}: core and model agree on {} ticks ({} values compared, \
                 {} queries, {} of them corrections, {} rebind requests); \
                 {} of {runs} runs were cut short by a tie",
                seed + runs - 1,
                sum.ticks,
                sum.values,
                sum.queries,
                sum.corrections,
                sum.rebinds,
                sum.ties
            );
            let missing = sum.reached.missing();
            if !missing.is_empty() {
                println!("never occurred: {}", missing.join(", "));
            }
            ExitCode::SUCCESS
        }
        Err(disagreement) => {
            eprint!("{disagreement}");
            eprintln!(
                "again: cargo xtask soak --ticks 1 --seed {}",
                disagreement.seed
            );
            ExitCode::FAILURE
        }
    }
}

/// The runs, shared out among threads; the first disagreement by seed.
fn side_by_side(first: u64, runs: u64, threads: u64) -> Result<Seen, Box<Disagreement>> {
    let next = AtomicU64::new(0);
    let begun = Instant::now();
    let work = || {
        let mut sum = Seen::default();
        let mut shown = Instant::now();
        loop {
            let n = next.fetch_add(1, Ordering::Relaxed);
            if n >= runs {
                return Ok(sum);
            }
            match soak::run(first + n, soak::TICKS) {
                Ok(seen) => sum.add(&seen),
                Err(disagreement) => {
                    next.store(runs, Ordering::Relaxed);
                    return Err(Box::new(disagreement));
                }
            }
            if shown.elapsed() >= PROGRESS_EVERY {
                shown = Instant::now();
                let seconds = begun.elapsed().as_secs();
                eprintln!(
                    "{n} of {runs} runs of {} ticks after {seconds} s",
                    soak::TICKS
                );
            }
        }
    };
    let results = thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = threads.into_iter().map(|t| t.join().expect("no panic"));
        joined.collect::<Vec<_>>()
    });
    let mut sum = Seen::default();
    let mut worst: Option<Box<Disagreement>> = None;
    for result in results {
        match result {
            Ok(seen) => sum.add(&seen),
            Err(d) if worst.as_ref().is_none_or(|w| d.seed < w.seed) => worst = Some(d),
            Err(_) => {}
        }
    }
    worst.map_or(Ok(sum), Err)
}
