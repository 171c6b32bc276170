//! `fitmac replay`: recorded inputs through the core again.

use std::path::{Path, PathBuf};

use fitmac_core::{
    ValidParams,
    message::TraceRecord,
    wire::{Diagnosis, Phase, Route, SubPhase},
};
use fitmac_rt::{
    config,
    replay::{Decisions, Parting, ReplayReport, replay},
    trace::{Damage, TraceReader},
};
use serde_json::json;

use crate::exit::{BadInput, Exit};

/// Arguments of `replay`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac replay run.mcap                                  the same answers, bit for bit?
  fitmac replay run.mcap --what-if gate.failure_streak=2  where would decisions have parted?
  fitmac replay run.mcap --json                           the same for a machine

A replay feeds the recorded inputs to the core and compares every answer with the
recorded one. A damaged file is replayed up to the damage.

With --what-if, what is recorded after the first parting is no consequence of the
other decisions any more: look at the parting, not at what follows.

Exit status: 0 if all answers agree (with --what-if: if the replay ran), 1 if they
differ or the file cannot be replayed from its start.")]
pub(crate) struct Args {
    /// The trace.
    #[arg(value_name = "FILE")]
    trace: PathBuf,
    /// Replay with another parameter; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    what_if: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Replays a trace and says where it differs.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let mut reader = TraceReader::open(&args.trace).map_err(|e| BadInput(e.to_string()))?;
    let recorded = recorded_params(&reader, &args.trace)?;
    let params = config::assign(&recorded, &args.what_if).map_err(|e| BadInput(e.to_string()))?;
    let report = replay(&mut reader, params);
    let damage = reader.damage();
    if args.json {
        let text = as_json(&report, damage, &args.what_if);
        println!("{}", serde_json::to_string_pretty(&text)?);
    } else {
        print(&report, damage, &args.what_if);
    }
    let agree = report.first.is_none() || !args.what_if.is_empty();
    let ran = report.stopped.is_none() && report.ticks > 0;
    Ok(if agree && ran {
        Exit::Done
    } else {
        Exit::Negative
    })
}

/// The parameters that the trace was recorded with.
fn recorded_params<R: std::io::Read>(
    reader: &TraceReader<R>,
    path: &Path,
) -> anyhow::Result<ValidParams> {
    let text = reader.metadata().get("params").ok_or_else(|| {
        BadInput(format!(
            "{} does not say its parameters: it cannot be replayed",
            path.display()
        ))
    })?;
    config::parse(&format!("the parameters in {}", path.display()), text)
        .map_err(|e| BadInput(e.to_string()).into())
}

fn print(report: &ReplayReport, damage: Option<&Damage>, what_if: &[String]) {
    let ReplayReport {
        ticks,
        different_ticks,
        first,
        first_decision,
        stopped,
    } = report;
    match first {
        None => println!("{ticks} ticks replayed, all answers equal bit for bit"),
        Some(parting) => {
            println!("{ticks} ticks replayed, {different_ticks} answers differ");
            println!("first: {parting}");
        }
    }
    if let Some((parting, decisions)) = first_decision {
        println!("first decision: {}", describe(parting, decisions));
    } else if first.is_some() && !what_if.is_empty() {
        println!("no decision of a query differs");
    }
    if let Some(stopped) = stopped {
        println!("the replay ends there: {stopped}");
    }
    if let Some(damage) = damage {
        println!("{damage}");
    }
}

fn describe(parting: &Parting, decisions: &Decisions) -> String {
    let tell = |decision: &Option<TraceRecord>| {
        decision.map_or_else(
            || "no query".to_owned(),
            |t| {
                format!(
                    "query {}: {} in {}, {}, diagnosis {}",
                    t.query,
                    word::<Route>(t.route),
                    word::<Phase>(t.phase),
                    word::<SubPhase>(t.sub_phase),
                    word::<Diagnosis>(t.diagnosis)
                )
            },
        )
    };
    format!(
        "{parting}\n  recorded {}\n  replayed {}",
        tell(&decisions.recorded),
        tell(&decisions.replayed)
    )
}

fn word<T: TryFrom<u8> + ToString>(code: u8) -> String {
    T::try_from(code).map_or_else(|_| format!("unknown {code}"), |m| m.to_string())
}

fn as_json(
    report: &ReplayReport,
    damage: Option<&Damage>,
    what_if: &[String],
) -> serde_json::Value {
    let parting = |p: &Parting| {
        json!({
            "tick": p.tick,
            "time_ns": p.now_ns,
            "message": p.what,
            "field": p.difference.as_ref().map(|d| &d.field),
            "recorded": p.difference.as_ref().map(|d| &d.left),
            "replayed": p.difference.as_ref().map(|d| &d.right),
        })
    };
    json!({
        "ticks": report.ticks,
        "equal": report.first.is_none(),
        "different_ticks": report.different_ticks,
        "what_if": what_if,
        "first": report.first.as_ref().map(parting),
        "first_decision": report.first_decision.as_ref().map(|(p, _)| parting(p)),
        "stopped": report.stopped.map(|s| s.to_string()),
        "damage": damage.map(ToString::to_string),
    })
}
