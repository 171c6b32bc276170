//! Counts what the control thread asks of the system while the loop runs:
//! `cargo xtask quiet`.
//!
//! The real loop on real shared memory, with chunks, rebinds, recoveries and
//! telemetry flowing. A counting allocator watches the control thread, and
//! `strace` counts its system calls. Both begin when the loop has run for a
//! while and every peer is connected: who connects later costs the control
//! thread what opening shared memory costs, once.

mod control;
mod report;
mod tracer;

use std::{
    process::ExitCode,
    sync::{Arc, atomic::Ordering::SeqCst},
    thread,
    time::{Duration, Instant},
};

use clap::{Parser, ValueEnum};
use fitmac_core::wire::Request;
use fitmac_core_tests::world::Scene;
use fitmac_rt::{
    clock, endpoint::OperatorEndpoint, instance::Instance, port::Session, transport::Ipc,
};
use fitmac_tests::cell::{AgentsState, Peer, PolicyState, RobotState, agents, policy, robot};

use crate::{
    control::{Gate, Stage},
    report::{Counted, Flow},
    tracer::Tracer,
};

/// Episodes begin anew after this time, so that recoveries go on.
const EPISODE: Duration = Duration::from_secs(4);
/// Time between two lines of progress.
const PROGRESS_EVERY: Duration = Duration::from_secs(20);

/// Counts what the control thread asks of the system.
#[derive(Parser)]
#[command(bin_name = "cargo xtask quiet")]
struct Args {
    /// Control ticks.
    #[arg(long, default_value_t = 20_000)]
    ticks: u64,
    /// Ticks a second, 250 to 2000.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(250..=2000))]
    rate: u32,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Break the promise once in mid-run, to see that it is noticed.
    #[arg(long, hide = true)]
    plant: Option<Plant>,
}

/// What can be planted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Plant {
    /// An allocation, and its release.
    Allocation,
    /// A system call.
    Call,
    /// An operator that connects while the loop runs.
    Peer,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let flow = Arc::new(Flow::default());
    let counted = measure(&args, &flow);
    let quiet = report::print(args.json, &flow, &counted);
    if quiet {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn measure(args: &Args, flow: &Arc<Flow>) -> Counted {
    let instance = Instance::temporary().expect("a temporary instance");
    let robot = Peer::start("robot", &instance, RobotState::default(), robot);
    let policy = Peer::start("policy", &instance, PolicyState::idle(), policy);
    let agents = Peer::start("agents", &instance, AgentsState::default(), agents);
    let mut operator = operator(&instance);
    let gate = Arc::new(Gate::new(args.ticks, args.plant));
    let control = {
        let (instance, flow, gate) = (instance.clone(), Arc::clone(flow), Arc::clone(&gate));
        let rate = args.rate;
        thread::spawn(move || control::run(&instance, rate, &flow, &gate))
    };
    gate.wait(Stage::Ready);
    let tracer = Tracer::attach(gate.thread_id());
    gate.pass(Stage::Counting);
    let begun = Instant::now();
    episodes(args, &instance, &robot, &gate, &mut operator);
    let seconds = begun.elapsed().as_secs_f64();
    let calls = tracer.map(Tracer::finish);
    gate.pass(Stage::Leaving);
    let (allocations, overruns) = control.join().expect("no panic");
    drop((robot, policy, agents, operator));
    Counted {
        ticks: args.ticks,
        seconds,
        allocations,
        overruns,
        calls,
    }
}

fn operator(instance: &Instance) -> OperatorEndpoint<Ipc> {
    let transport = Ipc::join(instance).expect("joins");
    OperatorEndpoint::connect(&transport, Session::start()).expect("connects")
}

/// Begins episode after episode until everything is counted.
fn episodes(
    args: &Args,
    instance: &Instance,
    robot: &Peer<RobotState>,
    gate: &Gate,
    operator: &mut OperatorEndpoint<Ipc>,
) {
    let (begun, mut episode) = (Instant::now(), Instant::now());
    let mut said = begun;
    let mut late = None;
    while gate.stage() < Stage::Done {
        thread::sleep(Duration::from_millis(5));
        robot.with(|r| r.log.clear());
        if args.plant == Some(Plant::Peer) && late.is_none() {
            late = Some(self::operator(instance));
        }
        if episode.elapsed() > EPISODE {
            episode = Instant::now();
            robot.with(|r| {
                let mut world = Scene::can_to_plate().world;
                world.go_on_from(&r.world);
                r.world = world;
            });
            operator
                .send(clock::now_ns(), Request::Reset)
                .expect("sends");
        }
        if said.elapsed() > PROGRESS_EVERY {
            said = Instant::now();
            let counted = gate.counted.load(SeqCst);
            let rate = counted as f64 / begun.elapsed().as_secs_f64();
            let left_min = args.ticks.saturating_sub(counted) as f64 / rate / 60.0;
            eprintln!("{counted} of {} ticks, {left_min:.1} min left", args.ticks);
        }
    }
}
