//! Runs ticks of the core for a tool that watches them.
//!
//! - `ticks count [SEEDS TICKS]`: says of each tick, in order, what kind it was, while callgrind
//!   counts its instructions; or of so many ticks of the swarm's first seeds.
//! - `ticks replay SEEDS`: hashes of what the core was told and of what it answered.
//! - `ticks stack SEEDS`: the deepest stack of a tick.
//! - `ticks realtime SEEDS | control`: ticks that must not block, for the real-time sanitizer.
#![cfg_attr(rtsan, feature(sanitize))]

mod count;
mod realtime;
mod stack;

use std::process::ExitCode;

use fitmac_core_tests::replay;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if run(&words).is_some() {
        return ExitCode::SUCCESS;
    }
    eprintln!(
        "ticks: there are: count [SEEDS TICKS], replay SEEDS, stack SEEDS, realtime SEEDS | control"
    );
    ExitCode::FAILURE
}

/// Does what the words say; `None` if they say nothing sensible or it did not go well.
fn run(words: &[&str]) -> Option<()> {
    match *words {
        ["count"] => count::known(),
        ["count", seeds, ticks] => count::search(seeds.parse().ok()?, ticks.parse().ok()?),
        ["replay", seeds] => {
            println!("{}", replay::fingerprint(0..seeds.parse().ok()?).ok()?);
        }
        ["stack", seeds] => return stack::run(seeds.parse().ok()?).then_some(()),
        ["realtime", "control"] => realtime::control(),
        ["realtime", seeds] => realtime::run(seeds.parse().ok()?),
        _ => return None,
    }
    Some(())
}
