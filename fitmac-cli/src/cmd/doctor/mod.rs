//! `fitmac doctor`: what of the real-time set-up is missing.

mod checks;
mod machine;
#[cfg(test)]
mod tests;

use machine::Machine;
use serde::Serialize;

use crate::exit::Exit;

/// Arguments of `doctor`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  fitmac doctor           a line for each finding, with the remedy
  fitmac doctor --json    the same for a machine

Exit status: 0 if `fitmac rt` can run in real time, 1 if something is missing.
Advice lowers latency or its spread and does not count as missing.")]
pub(crate) struct Args {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Looks at the machine and says what it found.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let findings = checks::all(&Machine::this());
    let ready = findings
        .iter()
        .all(|finding| finding.level != Level::Missing);
    if args.json {
        let report = Report { ready, findings };
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        findings.iter().for_each(Finding::print);
        println!(
            "\nThe real-time loop {}.",
            if ready {
                "can run here"
            } else {
                "needs what is missing above, or --allow-non-rt"
            }
        );
    }
    Ok(if ready { Exit::Done } else { Exit::Negative })
}

#[derive(Serialize)]
struct Report {
    /// Nothing is missing.
    ready: bool,
    findings: Vec<Finding>,
}

/// How a finding is to be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Level {
    /// As it should be.
    Ok,
    /// The loop runs, with more latency or spread than need be.
    Advice,
    /// The loop refuses to start without `--allow-non-rt`.
    Missing,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Finding {
    name: &'static str,
    level: Level,
    /// What was found.
    found: String,
    /// What to do about it; none if it is as it should be.
    remedy: Option<&'static str>,
}

impl Finding {
    fn print(&self) {
        let level = match self.level {
            Level::Ok => "ok",
            Level::Advice => "advice",
            Level::Missing => "MISSING",
        };
        println!("{level:<8} {:<24} {}", self.name, self.found);
        if let Some(remedy) = self.remedy {
            println!("{:<33} -> {remedy}", "");
        }
    }
}
