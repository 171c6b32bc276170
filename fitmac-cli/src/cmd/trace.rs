//! `fitmac trace`: looks into a recorded trace.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use fitmac_core::{intake::Refusal, message::TraceRecord, reason, wire::EventKind, wire::Mode};
use fitmac_rt::{
    counters,
    message::{ModelCall, ModelRole},
    trace::{FOXGLOVE_LAYOUT, Record, TraceReader, write_csv},
};

use crate::exit::{BadInput, Exit};

/// Arguments of `trace`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac trace info run.mcap                what is in it, how long, what was counted
  fitmac trace events run.mcap              refusals, changes of mode, model calls, one a line
  fitmac trace csv run.mcap -o run.csv      one row a tick, for PlotJuggler
  fitmac trace layout -o fitmac.json        a layout for Foxglove: import it there

Foxglove, Rerun (`rerun run.mcap`) and PlotJuggler open the MCAP file itself.")]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Action {
    /// What is in a trace.
    Info {
        /// The trace.
        file: PathBuf,
    },
    /// Refusals, changes of mode, model calls.
    Events {
        /// The trace.
        file: PathBuf,
    },
    /// A table with one row a tick.
    Csv {
        /// The trace.
        file: PathBuf,
        /// Where it goes [default: standard output].
        #[arg(short, long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// The layout for Foxglove.
    Layout {
        /// Where it goes [default: standard output].
        #[arg(short, long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
}

/// Does what was asked.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    perform(&args.action).or_else(|error| {
        // A reader like `head` that has seen enough is no trouble.
        let closed = error
            .downcast_ref::<std::io::Error>()
            .is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe);
        if closed { Ok(Exit::Done) } else { Err(error) }
    })
}

fn perform(action: &Action) -> anyhow::Result<Exit> {
    match action {
        Action::Info { file } => info(file),
        Action::Events { file } => events(file),
        Action::Csv { file, out } => {
            let mut reader = open(file)?;
            let mut out = output(out.as_deref())?;
            let rows = write_csv(&mut reader, &mut out)?;
            out.flush()?;
            eprintln!("{rows} rows");
            warn(&reader);
            Ok(Exit::Done)
        }
        Action::Layout { out } => {
            let mut out = output(out.as_deref())?;
            out.write_all(FOXGLOVE_LAYOUT.as_bytes())?;
            out.flush()?;
            Ok(Exit::Done)
        }
    }
}

type Reader = TraceReader<std::io::BufReader<File>>;

fn open(path: &Path) -> anyhow::Result<Reader> {
    TraceReader::open(path).map_err(|e| BadInput(e.to_string()).into())
}

fn output(path: Option<&Path>) -> anyhow::Result<Box<dyn Write>> {
    Ok(match path {
        None => Box::new(BufWriter::new(std::io::stdout())),
        Some(path) => {
            Box::new(BufWriter::new(File::create(path).with_context(|| {
                format!("{} cannot be written", path.display())
            })?))
        }
    })
}

fn warn(reader: &Reader) {
    if let Some(damage) = reader.damage() {
        eprintln!("fitmac: {damage}");
    }
}

fn info(path: &Path) -> anyhow::Result<Exit> {
    let mut reader = open(path)?;
    let mut seen = Seen::default();
    let mut status = None;
    for record in &mut reader {
        match record {
            Record::Tick(tick) => {
                let time = tick.head.now_ns;
                seen.first_ns.get_or_insert(time);
                seen.last_ns = time;
                seen.first_tick.get_or_insert(tick.head.tick);
                seen.last_tick = tick.head.tick;
                seen.ticks += 1;
                seen.states += u64::from(tick.state.is_some());
                seen.chunks += u64::from(tick.chunk.is_some());
                seen.groundings += u64::from(tick.grounding.is_some());
                seen.queries += u64::from(tick.output.trace.is_some());
                seen.events += u64::from(tick.output.event.is_some());
            }
            Record::Prompt(_, prompt) => {
                seen.prompts
                    .push(prompt.text().unwrap_or("?").escape_default().to_string());
            }
            Record::ModelCall(..) => seen.model_calls += 1,
            Record::Status(newest) => status = Some(newest),
        }
    }
    for (key, value) in reader.metadata().iter().filter(|(key, _)| *key != "params") {
        println!("{key:<12} {value}");
    }
    let seconds = seen.last_ns.saturating_sub(seen.first_ns.unwrap_or(0)) as f64 / 1e9;
    println!(
        "ticks        {} ({} to {}), {seconds:.3} s",
        seen.ticks,
        seen.first_tick.unwrap_or(0),
        seen.last_tick
    );
    println!(
        "inputs       {} states, {} chunks, {} grounding records",
        seen.states, seen.chunks, seen.groundings
    );
    println!(
        "decisions    {} queries, {} events",
        seen.queries, seen.events
    );
    println!("model calls  {}", seen.model_calls);
    seen.prompts
        .iter()
        .for_each(|text| println!("prompt       {text}"));
    if let Some(status) = status {
        let count = (status.counter_count as usize).min(status.counters.len());
        for (name, value) in counters::names().iter().zip(&status.counters[..count]) {
            if *value > 0 {
                println!("counted      {name} {value}");
            }
        }
    }
    match reader.damage() {
        None => println!("the file is whole"),
        Some(damage) => println!("DAMAGED      {damage}"),
    }
    Ok(Exit::Done)
}

#[derive(Default)]
struct Seen {
    first_ns: Option<u64>,
    last_ns: u64,
    first_tick: Option<u64>,
    last_tick: u64,
    ticks: u64,
    states: u64,
    chunks: u64,
    groundings: u64,
    queries: u64,
    events: u64,
    model_calls: u64,
    prompts: Vec<String>,
}

fn events(path: &Path) -> anyhow::Result<Exit> {
    let mut reader = open(path)?;
    let mut start_ns = None;
    let mut earlier = Vec::new();
    for record in &mut reader {
        match record {
            Record::Tick(tick) => {
                let start_ns = *start_ns.get_or_insert_with(|| {
                    earlier
                        .iter()
                        .for_each(|call| print_call(call, tick.head.now_ns));
                    tick.head.now_ns
                });
                if let Some(event) = &tick.output.event {
                    let reasons = tick.output.command.reasons;
                    let time_s = seconds_after(event.stamp_ns, start_ns);
                    println!("{time_s:>10.4} s  {}", describe(event, reasons));
                }
            }
            Record::ModelCall(_, call) => match start_ns {
                Some(start_ns) => print_call(&call, start_ns),
                // The agents may be up before the controller.
                None => earlier.push(*call),
            },
            Record::Prompt(..) | Record::Status(_) => {}
        }
    }
    warn(&reader);
    Ok(Exit::Done)
}

fn describe(event: &TraceRecord, reasons: u64) -> String {
    let mode = Mode::try_from(event.mode).map_or("unknown", Mode::name);
    match EventKind::try_from(event.kind) {
        Ok(EventKind::ModeChanged) => {
            let reasons: Vec<&str> = reason::names(reasons).collect();
            format!("mode {mode}: {}", reasons.join(", "))
        }
        Ok(kind) => {
            let why = Refusal::ALL.get(event.detail as usize);
            format!("{kind}: {}", why.map_or("unknown", |r| r.name()))
        }
        Err(unknown) => unknown.to_string(),
    }
}

/// A model call; its time is when it was asked.
fn print_call(call: &ModelCall, start_ns: u64) {
    let role = ModelRole::ALL.iter().find(|role| **role as u8 == call.role);
    println!(
        "{:>10.4} s  model call of the {}: {} after {:.3} s, {} request(s)",
        seconds_after(call.asked_ns, start_ns),
        role.map_or("unknown", |role| role.name()),
        call.outcome().unwrap_or("?").escape_default(),
        call.latency_ns as f64 / 1e9,
        call.attempts
    );
}

/// Time from one stamp to another, s; negative if it was before.
fn seconds_after(stamp_ns: u64, start_ns: u64) -> f64 {
    stamp_ns.wrapping_sub(start_ns).cast_signed() as f64 / 1e9
}
