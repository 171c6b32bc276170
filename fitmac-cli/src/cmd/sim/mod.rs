//! `fitmac sim`: the simulated robot and its world on shared memory, in
//! wall-clock time.

mod film;
mod plant;

use std::{path::PathBuf, time::Duration};

use anyhow::Context;
use fitmac_rt::{
    clock, endpoint::HarnessEndpoint, instance::Instance, port::Session, signals::Signals,
    transport::Ipc,
};
use sim_harness::action::PHYSICS_STEP_S;

use super::leave_control_core;
use crate::{card::Card, crew::Report, episode, exit::Exit};
use film::Film;
use plant::Plant;

/// Duration of a physics step, ns.
const STEP_NS: u64 = (PHYSICS_STEP_S * 1e9) as u64;
/// Further behind the wall clock than this we let simulated time stand still
/// instead of catching up in a burst, ns.
const LAG_MAX_NS: u64 = 20_000_000;

/// How long the world goes on after the verdict, in looks of the judge: the
/// controller hears of it.
const LOOKS_AFTER: u32 = 10;

/// Arguments of `sim`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example, a terminal each:
  fitmac sim --instance cell --card scene.json --seed 3
  fitmac vla --instance cell --card scene.json --seed 3
  fitmac agents --instance cell --card scene.json
  fitmac rt --instance cell --allow-non-rt

The scene is a table; `--perturbation pos` lets the named object and a distractor
change places. The robot stands until commands come and stops when they cease.
Says when the task is done or its steps are used up; ends at Ctrl-C, and draws
the pictures then.")]
pub(crate) struct Args {
    /// The running system to join.
    #[arg(long, default_value = "default")]
    instance: String,
    /// Where the scene card is written: what things look like, what is asked.
    #[arg(long, value_name = "FILE")]
    card: PathBuf,
    /// Where pictures of the episode are written; none without it.
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    #[command(flatten)]
    episode: episode::Args,
}

/// Runs one episode.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let signals = Signals::listen()?;
    leave_control_core();
    let episode = args.episode.draw()?;
    Card::of(&episode.scene, &episode.task.instruction).write(&args.card)?;
    let mut plant = Plant::new(&episode)?;
    let mut film = Film::new(args.pictures.clone());
    {
        let instance = Instance::named(&args.instance)?;
        let transport = Ipc::join(&instance)?;
        let mut endpoint = HarnessEndpoint::connect(&transport, Session::start())?;
        Report::Ready.send();
        live(&mut plant, &mut film, &mut endpoint, &signals)?;
    }
    if plant.verdict().is_none() {
        return Ok(Exit::Interrupted);
    }
    let pictures = film
        .develop(&mut plant)
        .context("pictures of the episode")?;
    Report::Outcome(plant.outcome(pictures)).send();
    Ok(Exit::Done)
}

/// Steps the plant beside the wall clock until we are asked to end.
fn live(
    plant: &mut Plant,
    film: &mut Film,
    endpoint: &mut HarnessEndpoint<Ipc>,
    signals: &Signals,
) -> anyhow::Result<()> {
    let mut due_ns = clock::now_ns();
    let mut looks_after = 0;
    while !signals.stop_requested() {
        let now_ns = wait_until(due_ns);
        if now_ns.saturating_sub(due_ns) > STEP_NS {
            plant.count_late_step();
        }
        plant.take_command(now_ns, endpoint.poll_command())?;
        plant.step();
        let sample = plant.sample(clock::now_ns());
        endpoint.publish_state(sample.stamp_ns, sample)?;
        if plant.is_end_of_look() {
            let report = plant.look(now_ns);
            endpoint.publish_verifier(now_ns, report)?;
            film.watch(plant);
            Report::Progress(plant.progress()).send();
            looks_after += u32::from(plant.verdict().is_some());
            if looks_after == LOOKS_AFTER {
                Report::Over.send();
            }
        }
        due_ns = due_ns
            .saturating_add(STEP_NS)
            .max(now_ns.saturating_sub(LAG_MAX_NS));
    }
    Ok(())
}

/// Sleeps until the time has come, and says what time it is then.
fn wait_until(due_ns: u64) -> u64 {
    let now_ns = clock::now_ns();
    match due_ns.checked_sub(now_ns) {
        None | Some(0) => now_ns,
        Some(early_ns) => {
            std::thread::sleep(Duration::from_nanos(early_ns));
            clock::now_ns()
        }
    }
}
