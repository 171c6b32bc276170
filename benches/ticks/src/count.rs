//! One tick after the other, each of a known kind.

use fitmac_core::{
    Params,
    message::{Input, Output},
    wire::EventKind,
};
use fitmac_core_tests::{
    swarm::Swarm,
    world::{Agent, Behaviour, OTHER, Policy, Scene, Session, Verifier},
};

/// Policy steps of each session.
const STEPS: u64 = 100;
/// Seeds of the swarm, and as many of their ticks as lead to the dearest that a search has found.
const DEAREST: [(u64, usize); 2] = [(1, 200), (21, 40)];

/// Prints the kind of every tick, a line each.
pub(crate) fn known() {
    session(Behaviour::Competent);
    session(Behaviour::Frozen);
    session(Behaviour::WrongObject(OTHER));
    session(Behaviour::MissesPlace([0.12, 0.0]));
    for (seed, ticks) in DEAREST {
        swarm(seed, ticks);
    }
}

/// The same for the swarm's first seeds: a search for dearer ticks.
pub(crate) fn search(seeds: u64, ticks: usize) {
    for seed in 0..seeds {
        swarm(seed, ticks);
    }
}

/// Without faults: in every other tick nothing arrives.
fn session(behaviour: Behaviour) {
    let scene = Scene::can_to_plate();
    let agent = Agent::knowing(&scene);
    let mut session = Session::new(Params::guarded(), scene, Policy::new(behaviour), agent);
    session.verifier = Verifier::Both;
    session.tick_ns = 5_000_000;
    let ticks = STEPS * 50_000_000 / session.tick_ns;
    let mut step = 0;
    for n in 0..ticks {
        let mut heard = false;
        let output = session.tick_with(|input| {
            let kept = input.chunk.is_some() || input.grounding.is_some() || n % 2 == 0;
            if kept {
                heard = true;
            } else {
                *input = Input::default();
            }
        });
        println!("{}", kind(&output, step, heard));
        step = output.command.policy_step;
    }
}

/// With faults.
fn swarm(seed: u64, ticks: usize) {
    let mut swarm = Swarm::new(seed);
    let mut controller = fitmac_core::Controller::new(swarm.params);
    for n in 1..=ticks {
        let told = swarm.tick();
        let output = controller.tick(told.now_ns, &told.input());
        println!("faults seed {seed} tick {n}");
        swarm.hear(&output);
    }
}

/// What happened in a tick without faults.
fn kind(output: &Output, step_before: u64, heard: bool) -> &'static str {
    let command = &output.command;
    let decided = output
        .trace
        .as_ref()
        .is_some_and(|trace| trace.kind == EventKind::Query.code());
    let started = command.policy_step != step_before;
    match (command.sub_phase != 0, decided, started, heard) {
        (true, true, ..) => "recovery-query",
        (true, ..) => "recovery",
        (false, true, ..) => "monitored-query",
        (false, false, true, _) => "monitored-step",
        (false, false, false, true) => "monitored",
        (false, false, false, false) => "idle",
    }
}
