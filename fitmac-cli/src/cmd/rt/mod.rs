//! `fitmac rt`: the controller in real time, and what an operator asks of it.

mod operator;

use std::{collections::BTreeMap, path::PathBuf};

use anyhow::Context;
use fitmac_core::ValidParams;
use fitmac_rt::{
    control_loop::{Ended, LoopOptions, LoopOptionsError, PERIOD_RANGE_NS, Trigger},
    counters::Cadence as Measured,
    instance::Instance,
    realtime::{Core, Measure, Outcome, RealTime},
    roles::{ControllerError, ControllerReport, ControllerRole, controller},
    signals::Signals,
    telemetry::Consume,
    trace::{BlackBox, Metadata, TraceFile},
};

use crate::{
    config,
    crew::{Cadence, Report},
    exit::{BadInput, Exit},
};

/// Arguments of `rt`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:
  fitmac rt --instance cell                       needs the real-time set-up: see `fitmac doctor`
  fitmac rt --instance cell --allow-non-rt        runs without it, with a worse cadence
  fitmac rt --trace run.mcap --set gate.failure_streak=2
  fitmac rt --rate 500 --core 3 --spin-us 150     another pace, its own core, a final spin
  fitmac rt status --instance cell                what a running controller says of itself
  fitmac rt stop --instance cell                  a controlled stop, latched until `rt reset`

Ctrl-C or SIGTERM ends in order: the robot is stopped, a last command is sent and
the trace is finished. A second one ends at once. SIGUSR1 prints the cadence.

Exit status: 0 after an orderly end, 2 for wrong usage, 3 if the controller cannot
start (another one runs, no permission for real time, no shared memory)."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Option<operator::Action>,
    /// The running system to join.
    #[arg(long, default_value = "default")]
    instance: String,
    #[command(flatten)]
    config: config::Args,
    #[command(flatten)]
    pace: PaceArgs,
    /// Record everything to this MCAP file.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Where the last half minute is written when a fault stops the robot.
    #[arg(long, value_name = "DIR", default_value = "fitmac-black-box")]
    black_box: PathBuf,
}

/// How the loop keeps time.
#[derive(Clone, Debug, clap::Args)]
struct PaceArgs {
    /// Ticks a second, 250 to 2000.
    #[arg(long, value_name = "HZ", default_value_t = 1000)]
    rate: u32,
    /// Spin for the last part before each tick, us: less lateness, more load.
    #[arg(long, value_name = "US", default_value_t = 0)]
    spin_us: u32,
    /// Tick when the robot's sample arrives, instead of by the clock.
    #[arg(long, conflicts_with = "spin_us")]
    follow_state: bool,
    /// The core to stay on [default: the last one].
    #[arg(long, value_name = "N")]
    core: Option<usize>,
    /// Priority under SCHED_FIFO, 1 to 99.
    #[arg(long, default_value_t = 80, value_parser = clap::value_parser!(u8).range(1..=99))]
    priority: u8,
    /// Run even without real-time scheduling, locked memory or the core.
    #[arg(long)]
    allow_non_rt: bool,
    /// End after this many ticks.
    #[arg(long, value_name = "N")]
    ticks: Option<u64>,
}

/// How long the loop polls for the robot's sample before and after it is due.
const STATE_LEAD_NS: u64 = 150_000;
const STATE_PATIENCE_NS: u64 = 150_000;

/// Runs the controller until it is asked to end, or carries a request to one.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    if let Some(action) = &args.action {
        return operator::run(action);
    }
    let signals = Signals::listen().context("signals cannot be listened to")?;
    let params = args.config.load()?;
    let timing = args.pace.timing()?;
    let instance = Instance::named(&args.instance).map_err(|e| BadInput(e.to_string()))?;
    let role = ControllerRole {
        instance,
        params,
        timing,
        real_time: args.pace.real_time(),
        consumers: args.consumers(&params, &timing)?,
    };
    let report = controller(role, &signals, |measures| {
        measures.iter().for_each(|m| eprintln!("{m}"));
        Report::Ready.send();
    })
    .map_err(|error| match error {
        ControllerError::Timing(e) => BadInput(e.to_string()).into(),
        other => anyhow::Error::from(other),
    })?;
    tell(&report, args.pace.rate);
    Ok(Exit::Done)
}

fn tell(report: &ControllerReport, rate_hz: u32) {
    eprintln!("{}", report.cadence);
    if report.ended == Ended::StopTimedOut {
        eprintln!("fitmac: the controlled stop took too long; the last command was sent anyway");
    }
    for recorded in &report.recorded {
        match &recorded.outcome {
            Ok(()) => {}
            Err(e) => eprintln!(
                "fitmac: {} is incomplete: {e}; it took {} of {} ticks",
                recorded.name,
                recorded.ticks,
                report.cadence.value("ticks").unwrap_or(0)
            ),
        }
    }
    Report::Cadence(cadence(&report.cadence, &report.measures, rate_hz)).send();
}

fn cadence(measured: &Measured, measures: &[Measure], rate_hz: u32) -> Cadence {
    let us = |ns: u64| ns as f64 / 1e3;
    let lateness = measured.lateness.summary();
    let count = |name| measured.value(name).unwrap_or(0);
    Cadence {
        rate_hz,
        ticks: count("ticks"),
        overruns: count("overruns"),
        p50_us: us(lateness.p50),
        p99_us: us(lateness.p99),
        p999_us: us(lateness.p999),
        max_us: us(lateness.max),
        real_time: !measures
            .iter()
            .any(|m| matches!(m.outcome, Outcome::Refused { .. })),
    }
}

impl Args {
    fn consumers(
        &self,
        params: &ValidParams,
        timing: &LoopOptions,
    ) -> anyhow::Result<Vec<Box<dyn Consume>>> {
        let metadata: Metadata = BTreeMap::from([
            ("version".into(), env!("CARGO_PKG_VERSION").into()),
            ("instance".into(), self.instance.clone()),
            ("params".into(), fitmac_rt::config::to_text(params)),
            ("period_ns".into(), timing.period_ns.to_string()),
        ]);
        let black_box = BlackBox::new(self.black_box.clone(), metadata.clone());
        let mut consumers: Vec<Box<dyn Consume>> = vec![Box::new(black_box)];
        if let Some(path) = &self.trace {
            let file = TraceFile::create(path, &metadata).with_context(|| {
                format!(
                    "the trace {} cannot be written: choose another --trace",
                    path.display()
                )
            })?;
            consumers.push(Box::new(file));
        }
        Ok(consumers)
    }
}

impl PaceArgs {
    fn timing(&self) -> anyhow::Result<LoopOptions> {
        let period_ns = 1_000_000_000 / u64::from(self.rate.max(1));
        if !PERIOD_RANGE_NS.contains(&period_ns) {
            return Err(BadInput(format!(
                "--rate {} is out of range: choose 250 to 2000",
                self.rate
            ))
            .into());
        }
        let trigger = if self.follow_state {
            Trigger::State {
                lead_ns: STATE_LEAD_NS.min(period_ns / 4),
                patience_ns: STATE_PATIENCE_NS.min(period_ns / 4),
            }
        } else {
            Trigger::Deadline {
                spin_ns: u64::from(self.spin_us) * 1000,
            }
        };
        let timing = LoopOptions {
            period_ns,
            trigger,
            ticks_max: self.ticks,
            ..LoopOptions::default()
        };
        timing
            .validate()
            .map_err(|e: LoopOptionsError| BadInput(e.to_string()))?;
        Ok(timing)
    }

    fn real_time(&self) -> RealTime {
        RealTime {
            priority: Some(self.priority),
            core: self.core.map_or(Core::Last, Core::Number),
            allow_non_rt: self.allow_non_rt,
            ..RealTime::default()
        }
    }
}
