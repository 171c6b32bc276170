//! `fitmac rt stop|reset|status|clean`.

use std::time::{Duration, Instant};

use anyhow::Context;
use fitmac_core::{
    reason,
    wire::{Mode, Phase, Request, Route, SubPhase},
};
use fitmac_rt::{
    clock, counters, endpoint::OperatorEndpoint, instance::Instance, message::Status,
    port::Session, transport::Ipc,
};
use serde_json::json;

use crate::exit::{BadInput, Exit};

/// How long an answer of the controller is awaited.
const ANSWER_MAX: Duration = Duration::from_secs(3);
const LOOK: Duration = Duration::from_millis(10);

/// What is asked of a running controller.
#[derive(Clone, Debug, clap::Subcommand)]
pub(super) enum Action {
    /// Ask for a controlled stop; it stays until a reset.
    Stop(Target),
    /// Forget the stop and the episode, and start afresh.
    Reset(Target),
    /// Say how the controller is.
    Status {
        #[command(flatten)]
        target: Target,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Remove what processes that died have left in shared memory.
    Clean(Target),
}

/// Which system.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Target {
    /// The running system.
    #[arg(long, default_value = "default")]
    instance: String,
}

impl Target {
    fn instance(&self) -> anyhow::Result<Instance> {
        Instance::named(&self.instance).map_err(|e| BadInput(e.to_string()).into())
    }
}

/// Carries the request.
pub(super) fn run(action: &Action) -> anyhow::Result<Exit> {
    match action {
        Action::Stop(target) => {
            let stopped = |s: &Status| Mode::try_from(s.mode) == Ok(Mode::Stop);
            request(&target.instance()?, Request::Stop, stopped)
        }
        Action::Reset(target) => {
            let going = |s: &Status| Mode::try_from(s.mode) != Ok(Mode::Stop);
            request(&target.instance()?, Request::Reset, going)
        }
        Action::Status { target, json } => {
            let mut operator = connect(&target.instance()?)?;
            let Some(status) = wait(&mut operator, |_| true) else {
                return silent();
            };
            if *json {
                println!("{}", serde_json::to_string_pretty(&as_json(&status))?);
            } else {
                print(&status);
            }
            Ok(Exit::Done)
        }
        Action::Clean(target) => {
            let instance = target.instance()?;
            let gone = instance.clean_up().context("cleaning up")?;
            if gone {
                println!("nothing is left in {}", instance.root().display());
                return Ok(Exit::Done);
            }
            println!("processes still run in {}", instance.root().display());
            Ok(Exit::Negative)
        }
    }
}

fn connect(instance: &Instance) -> anyhow::Result<OperatorEndpoint<Ipc>> {
    let transport = Ipc::join(instance)?;
    Ok(OperatorEndpoint::connect(&transport, Session::start())?)
}

/// Sends a request until the controller's status shows that it was heard.
fn request(
    instance: &Instance,
    request: Request,
    heard: impl Fn(&Status) -> bool,
) -> anyhow::Result<Exit> {
    let mut operator = connect(instance)?;
    // A status that is older than the request proves nothing.
    if wait(&mut operator, |_| true).is_none() {
        return silent();
    }
    let asked_ns = clock::now_ns();
    operator.send(asked_ns, request)?;
    match wait(&mut operator, |s| s.stamp_ns > asked_ns && heard(s)) {
        Some(status) => {
            print(&status);
            Ok(Exit::Done)
        }
        None => {
            println!(
                "the controller did not obey within {} s",
                ANSWER_MAX.as_secs()
            );
            Ok(Exit::Negative)
        }
    }
}

fn silent() -> anyhow::Result<Exit> {
    println!("no controller answers in this instance: start `fitmac rt`, or name its --instance");
    Ok(Exit::Negative)
}

fn wait(operator: &mut OperatorEndpoint<Ipc>, is_it: impl Fn(&Status) -> bool) -> Option<Status> {
    let until = Instant::now() + ANSWER_MAX;
    while Instant::now() < until {
        if let Some(status) = operator.poll_status()
            && is_it(&status)
        {
            return Some(status);
        }
        std::thread::sleep(LOOK);
    }
    None
}

fn name<T: TryFrom<u8> + ToString>(code: u8) -> String {
    T::try_from(code).map_or_else(|_| format!("unknown {code}"), |m| m.to_string())
}

fn counted(status: &Status) -> impl Iterator<Item = (String, u64)> + '_ {
    let count = (status.counter_count as usize).min(status.counters.len());
    counters::names()
        .into_iter()
        .zip(status.counters[..count].iter().copied())
}

fn print(status: &Status) {
    let reasons: Vec<&str> = reason::names(status.reasons).collect();
    println!(
        "mode {}, route {}, phase {}, {}; reasons: {}",
        name::<Mode>(status.mode),
        name::<Route>(status.route),
        name::<Phase>(status.phase),
        name::<SubPhase>(status.sub_phase),
        if reasons.is_empty() {
            "none".to_owned()
        } else {
            reasons.join(", ")
        }
    );
    for (name, value) in counted(status).filter(|(_, value)| *value > 0) {
        println!("  {name:<26} {value}");
    }
}

fn as_json(status: &Status) -> serde_json::Value {
    let counters: serde_json::Map<String, serde_json::Value> = counted(status)
        .map(|(name, value)| (name, value.into()))
        .collect();
    json!({
        "mode": name::<Mode>(status.mode),
        "route": name::<Route>(status.route),
        "phase": name::<Phase>(status.phase),
        "sub_phase": name::<SubPhase>(status.sub_phase),
        "reasons": reason::names(status.reasons).collect::<Vec<_>>(),
        "counters": counters,
    })
}
