//! State-to-command latency beside its floor, and the loop's wake-up beside
//! `cyclictest`: `cargo xtask bench latency`.
//!
//! Two cores. On the first one a robot, in front of everything else; on the
//! last one a bare iceoryx2 echo of the same payloads, and FIT-MAC's control
//! loop with its recorder. The robot addresses the two in turn, half a period
//! after each other, so that whatever else the machine does hits both alike.
//! Both sleep until shortly before a sample is due, and poll from there. Policy
//! and agents are a process of their own.
//!
//! Blocks of this alternate with blocks in which the loop ticks by the clock
//! while `cyclictest` runs on its core. All of it once idle, and once with a
//! load on the first core and a policy that computes. The exit status is 1 if a
//! bound is missed.

#[path = "latency/distribution.rs"]
mod distribution;
#[path = "latency/echo.rs"]
mod echo;
#[path = "latency/peers.rs"]
mod peers;
#[path = "latency/plot.rs"]
mod plot;
#[path = "latency/report.rs"]
mod report;
#[path = "latency/robot.rs"]
mod robot;
#[path = "latency/wake.rs"]
mod wake;

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{Arc, mpsc},
    thread,
};

use anyhow::{Context, anyhow};
use fitmac_core::Params;
use fitmac_rt::{
    control_loop::{LoopOptions, Trigger},
    counters::Cadence,
    instance::Instance,
    realtime::{Core, RealTime, allowed_cores},
    roles::{ControllerRole, controller},
    signals::Signals,
    telemetry::Consume,
    trace::{Metadata, TraceFile},
};

use self::{
    distribution::Distribution,
    peers::Peers,
    report::{Condition, Report},
    robot::Robot,
    wake::Beside,
};

/// Time between two samples to the same side, and between two ticks, ns.
pub(crate) const PERIOD_NS: u64 = 1_000_000;
/// How long before a sample is due the polling begins, and how long after that
/// it ends, ns: what `fitmac rt --follow-state` does.
pub(crate) const LEAD_NS: u64 = 150_000;
/// Samples of a block.
const ROUNDS: u64 = 3000;

const USAGE: &str = "usage: cargo xtask bench latency [--blocks N] [--json] [--plot FILE.svg]";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let result = match arguments.split_first() {
        Some((role, rest)) if role == peers::ROLE => peers::run(rest).map(|()| true),
        _ => Arguments::parse(&arguments).and_then(|arguments| run(&arguments)),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("bench latency: {error:#}");
            ExitCode::FAILURE
        }
    }
}

struct Arguments {
    blocks: usize,
    json: bool,
    plot: PathBuf,
}

impl Arguments {
    fn parse(given: &[String]) -> anyhow::Result<Self> {
        let mut parsed = Self {
            blocks: 10,
            json: false,
            plot: "out/latency.svg".into(),
        };
        let mut given = given.iter();
        while let Some(argument) = given.next() {
            let mut value = || {
                given
                    .next()
                    .with_context(|| format!("{argument} needs a value"))
            };
            match argument.as_str() {
                "--json" => parsed.json = true,
                "--blocks" => {
                    parsed.blocks = value()?.parse().context("--blocks needs a number")?
                }
                "--plot" => parsed.plot = value()?.into(),
                other => anyhow::bail!("{other:?} is not an option; {USAGE}"),
            }
        }
        anyhow::ensure!(parsed.blocks > 0, "--blocks needs at least 1");
        // Cargo runs a benchmark in its package's folder, not where it was called.
        parsed.plot = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(parsed.plot);
        Ok(parsed)
    }
}

/// Measures and prints; whether every bound is kept.
fn run(arguments: &Arguments) -> anyhow::Result<bool> {
    let cores = allowed_cores();
    let (Some(&first), Some(&last)) = (cores.first(), cores.last()) else {
        anyhow::bail!("the process may use no core");
    };
    anyhow::ensure!(
        first != last,
        "two cores are needed, this process may use one"
    );
    let mut report = Report::new(Beside::found());
    for (name, loaded) in [("idle", false), ("loaded", true)] {
        let condition = measure(name, loaded, arguments.blocks, [first, last], report.beside)?;
        report.conditions.push(condition);
    }
    plot::write(&report, &arguments.plot)?;
    if arguments.json {
        println!("{:#}", report.json());
    } else {
        print!("{report}");
        println!("Drawn: {}", arguments.plot.display());
    }
    let missed = report.missed();
    missed.iter().for_each(|what| eprintln!("missed: {what}"));
    Ok(missed.is_empty())
}

/// Blocks of both kinds, in turn.
fn measure(
    name: &'static str,
    loaded: bool,
    blocks: usize,
    [first, last]: [usize; 2],
    beside: Beside,
) -> anyhow::Result<Condition> {
    let instance = Instance::temporary()?;
    let _peers = Peers::start(&instance, last, loaded)?;
    let mut condition = Condition::new(name);
    for block in 1..=blocks {
        eprintln!("{name}: block {block} of {blocks} (about 8 s each)");
        let (floor, ours, cadence) = round_trips(&instance, first, last)?;
        condition.add_round_trips(floor, ours, &cadence);
        let (bare, cadence) = wake_ups(&instance, first, last, beside)?;
        condition.add_wake_ups(&bare, &cadence);
    }
    Ok(condition)
}

/// A block of round trips: of the echo, of FIT-MAC, and what the loop counted.
fn round_trips(
    instance: &Instance,
    first: usize,
    last: usize,
) -> anyhow::Result<(Distribution, Distribution, Arc<Cadence>)> {
    let floor = Instance::temporary()?;
    let signals = Signals::none();
    let echo = echo::start(&floor, last, &signals);
    let trigger = Trigger::State {
        lead_ns: LEAD_NS,
        patience_ns: LEAD_NS,
    };
    let control = Control::start(instance, last, trigger, &signals)?;
    let robot = thread::scope(|scope| {
        let robot = scope.spawn(|| Robot::join(&floor, instance, first)?.round_trips(ROUNDS));
        robot.join().map_err(|_| anyhow!("the robot panicked"))
    });
    signals.stop();
    let cadence = control.end()?;
    echo.join().map_err(|_| anyhow!("the echo panicked"))??;
    let [floor, ours] = robot??;
    Ok((floor, ours, cadence))
}

/// A block of wake-ups: of `cyclictest`, and what the loop measured meanwhile.
fn wake_ups(
    instance: &Instance,
    first: usize,
    last: usize,
    beside: Beside,
) -> anyhow::Result<(Distribution, Arc<Cadence>)> {
    let floor = Instance::temporary()?;
    let signals = Signals::none();
    let trigger = Trigger::Deadline { spin_ns: 0 };
    let control = Control::start(instance, last, trigger, &signals)?;
    let bare = thread::scope(|scope| {
        let robot = scope
            .spawn(|| Robot::join(&floor, instance, first)?.samples(|| signals.stop_requested()));
        let bare = beside.measure(last, ROUNDS);
        signals.stop();
        robot.join().map_err(|_| anyhow!("the robot panicked"))??;
        bare
    });
    Ok((bare?, control.end()?))
}

/// The controller on a thread of its own, with its recorder.
struct Control {
    thread: thread::JoinHandle<anyhow::Result<Arc<Cadence>>>,
    _folder: tempfile::TempDir,
}

impl Control {
    fn start(
        instance: &Instance,
        core: usize,
        trigger: Trigger,
        signals: &Signals,
    ) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir()?;
        let trace = TraceFile::create(&folder.path().join("run.mcap"), &Metadata::default())?;
        let params = Params::guarded().validate();
        let consumers: Vec<Box<dyn Consume>> = vec![Box::new(trace)];
        let role = ControllerRole {
            instance: instance.clone(),
            params: params.map_err(|errors| anyhow!("{errors:?}"))?,
            timing: LoopOptions {
                period_ns: PERIOD_NS,
                trigger,
                shutdown_max_ns: 50_000_000,
                ..LoopOptions::default()
            },
            real_time: in_front(core),
            consumers,
        };
        let signals = signals.clone();
        let (ready, started) = mpsc::channel();
        let thread = thread::spawn(move || {
            let report = controller(role, &signals, |_| {
                let _ = ready.send(());
            })?;
            Ok(report.cadence)
        });
        // If it doesn't start, `end` says why.
        let _ = started.recv();
        Ok(Self {
            thread,
            _folder: folder,
        })
    }

    fn end(self) -> anyhow::Result<Arc<Cadence>> {
        let ended = self.thread.join();
        ended.map_err(|_| anyhow!("the controller panicked"))?
    }
}

/// Above everything of the user's, on this core; what is refused is done without.
pub(crate) fn in_front(core: usize) -> RealTime {
    RealTime {
        core: Core::Number(core),
        allow_non_rt: true,
        ..RealTime::default()
    }
}
