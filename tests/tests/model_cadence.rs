//! A model that never answers doesn't touch the control loop. Nothing here
//! depends on how fast the machine is: ticks are counted while a call is known
//! to be under way.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::SeqCst},
    },
    thread,
    time::Duration,
};

use fitmac_agents::{
    model::{
        Calls, ChatModel, ModelConfig,
        stand_in::{Manner, StandIn},
    },
    scene::{Detection, Scene},
    service::{AgentService, Event, ServiceParams},
};
use fitmac_core::{Params, message::StateSample};
use fitmac_rt::{
    clock,
    control_loop::LoopOptions,
    endpoint::{AgentsEndpoint, HarnessEndpoint},
    frame::contents,
    instance::Instance,
    port::Session,
    realtime::RealTime,
    roles::{ControllerReport, ControllerRole, controller},
    signals::Signals,
    transport::Ipc,
};
use fitmac_tests::cell::Memory;

/// Ticks that the controller makes while the call hangs.
const TICKS: u64 = 500;

fn bowl(y_m: f64) -> Detection {
    Detection {
        id: 1 + u16::from(y_m > 0.1),
        label: "black bowl".to_owned(),
        confidence: 0.9,
        position_m: [0.5, y_m, 0.025],
        size_m: [0.1, 0.1, 0.05],
        orientation: None,
        box_px: None,
        colour: None,
        parts: Vec::new(),
    }
}

/// Agents that ask `server` which of two bowls is meant, and go on publishing
/// groundings while it doesn't answer. Gives what became of the call.
fn agents(instance: &Instance, server: &StandIn, stop: &AtomicBool) -> Vec<Event> {
    let config = ModelConfig {
        attempt_ms: 600_000,
        attempts: 1,
        ..ModelConfig::new(server.url(), "m")
    };
    let calls = Calls::new(ChatModel::new(config).expect("no key"));
    let mut service = AgentService::new(ServiceParams::default(), Some(calls));
    let transport = Ipc::join(instance).expect("joins");
    let mut endpoint = AgentsEndpoint::connect(&transport, Session::start()).expect("connects");
    service
        .on_instruction(clock::now_ns(), "pick up the black bowl")
        .expect("a sentence");
    let mut calls = Vec::new();
    while !stop.load(SeqCst) {
        let now = clock::now_ns();
        let scene = Scene {
            stamp_ns: now,
            objects: vec![bowl(0.0), bowl(0.3)],
            ..Scene::default()
        };
        service.on_scene(now, &scene, None).expect("sound");
        for event in service.poll(now) {
            match event {
                Event::Plan(plan) => endpoint.send_plan(now, &plan).expect("sends"),
                Event::Grounding(mut record) => {
                    endpoint.send_grounding(now, &mut record).expect("sends");
                }
                Event::Call(_) => calls.push(event),
                _ => {}
            }
        }
        thread::sleep(Duration::from_millis(1));
    }
    calls
}

fn control(instance: &Instance, memory: &Memory) -> ControllerReport {
    let role = ControllerRole {
        instance: instance.clone(),
        params: Params::default()
            .validate()
            .expect("the defaults are valid"),
        timing: LoopOptions {
            ticks_max: Some(TICKS),
            shutdown_max_ns: 20_000_000,
            ..LoopOptions::default()
        },
        real_time: RealTime::off(),
        consumers: vec![Box::new(memory.clone())],
    };
    let process = thread::spawn(move || controller(role, &Signals::none(), |_| {}));
    let mut harness =
        HarnessEndpoint::connect(&Ipc::join(instance).expect("joins"), Session::start())
            .expect("connects");
    while !process.is_finished() {
        let now = clock::now_ns();
        let mut sample = StateSample {
            stamp_ns: now,
            ..StateSample::default()
        };
        harness.publish_state(now, &mut sample).expect("sends");
        thread::sleep(Duration::from_millis(1));
    }
    process
        .join()
        .expect("no panic")
        .expect("the controller started")
}

#[test]
fn ticks_go_on_while_a_model_hangs() {
    let server = StandIn::start(Manner::Hang).expect("a port");
    let instance = Instance::temporary().expect("a temporary instance");
    let (memory, stop) = (Memory::default(), Arc::new(AtomicBool::new(false)));
    let beside = {
        let (instance, server, stop) = (instance.clone(), server.clone(), stop.clone());
        thread::spawn(move || agents(&instance, &server, &stop))
    };
    while server.asked().is_empty() {
        assert!(!beside.is_finished(), "the agents ended");
        thread::sleep(Duration::from_millis(1));
    }
    // From here on the call is under way, and nobody answers it.
    let report = control(&instance, &memory);
    stop.store(true, SeqCst);
    let calls = beside.join().expect("no panic");
    assert_eq!(calls, Vec::new(), "the call was under way all the time");
    assert_eq!(server.asked().len(), 1);
    server.release();

    let ticks = memory.ticks();
    assert!(ticks.len() as u64 >= TICKS);
    assert_eq!(report.cadence.value("ticks"), Some(ticks.len() as u64));
    for (before, after) in ticks.iter().zip(&ticks[1..]) {
        assert_eq!(after.head.tick, before.head.tick + 1);
        assert_eq!(
            after.output.command.sequence,
            before.output.command.sequence + 1
        );
    }
    // The agents' records came through meanwhile: they don't wait either.
    let grounded = ticks
        .iter()
        .filter(|tick| tick.head.contents & contents::GROUNDING != 0)
        .count();
    assert!(
        grounded > 10,
        "{grounded} groundings in {} ticks",
        ticks.len()
    );
}

/// The controller can't call what it isn't linked to.
#[test]
fn nothing_on_the_control_side_depends_on_the_agents() {
    for (name, manifest) in [
        ("fitmac-core", include_str!("../../fitmac-core/Cargo.toml")),
        ("fitmac-rt", include_str!("../../fitmac-rt/Cargo.toml")),
        ("kinematics", include_str!("../../kinematics/Cargo.toml")),
    ] {
        assert!(manifest.contains(&format!("name = \"{name}\"")));
        for stranger in ["fitmac-agents", "ureq", "ort", "reqwest", "sim-harness"] {
            assert!(!manifest.contains(stranger), "{name} depends on {stranger}");
        }
    }
}
