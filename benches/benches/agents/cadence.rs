//! The controller's cadence with and without a model that hangs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use fitmac_agents::model::stand_in::{Manner, StandIn};
use fitmac_agents::model::{Calls, ChatModel, ModelConfig};
use fitmac_agents::scene::{Detection, Scene};
use fitmac_agents::service::{AgentService, Event, ServiceParams};
use fitmac_core::{Params, message::StateSample};
use fitmac_rt::clock;
use fitmac_rt::control_loop::LoopOptions;
use fitmac_rt::endpoint::{AgentsEndpoint, HarnessEndpoint};
use fitmac_rt::instance::Instance;
use fitmac_rt::port::Session;
use fitmac_rt::realtime::RealTime;
use fitmac_rt::roles::{ControllerReport, ControllerRole, controller};
use fitmac_rt::signals::Signals;
use fitmac_rt::transport::Ipc;

/// Ticks of a run, at 1 kHz.
const TICKS: u64 = 4000;
/// Runs of each kind.
const PAIRS: usize = 4;

/// Runs both kinds in turn and prints each and the sums.
pub(crate) fn compare() -> anyhow::Result<()> {
    println!(
        "\nthe controller at 1 kHz, {TICKS} ticks a run, agents beside it; times in us\n\
         {:<22} {:>7} {:>9} {:>8}   late: p50 {:>6} p99 {:>6}   busy: p50 {:>6} p99",
        "model", "ticks", "overruns", "skipped", "", "", ""
    );
    for _ in 0..PAIRS {
        for hangs in [false, true] {
            let (report, asked) = run(hangs)?;
            let cadence = &report.cadence;
            let count = |name| cadence.value(name).unwrap_or_default();
            let (late, busy) = (cadence.lateness.summary(), cadence.busy.summary());
            let us = |ns: u64| ns as f64 / 1e3;
            println!(
                "{:<22} {:>7} {:>9} {:>8}   {:>16.1} {:>10.1}   {:>16.1} {:>7.1}",
                if hangs {
                    format!("hangs, {asked} call asked")
                } else {
                    "none".to_owned()
                },
                count("ticks"),
                count("overruns"),
                count("skipped_periods"),
                us(late.p50),
                us(late.p99),
                us(busy.p50),
                us(busy.p99)
            );
        }
    }
    Ok(())
}

fn run(hangs: bool) -> anyhow::Result<(ControllerReport, usize)> {
    let server = StandIn::start(Manner::Hang)?;
    let instance = Instance::temporary()?;
    let stop = Arc::new(AtomicBool::new(false));
    let beside = {
        let (instance, server, stop) = (instance.clone(), server.clone(), stop.clone());
        std::thread::spawn(move || agents(&instance, hangs.then_some(&server), &stop))
    };
    while hangs && server.asked().is_empty() && !beside.is_finished() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let report = control(&instance);
    stop.store(true, Ordering::SeqCst);
    let answered = beside
        .join()
        .map_err(|_| anyhow!("the agents panicked"))??;
    anyhow::ensure!(answered == 0, "a hanging server has answered");
    let asked = server.asked().len();
    server.release();
    Ok((report?, asked))
}

fn control(instance: &Instance) -> anyhow::Result<ControllerReport> {
    let role = ControllerRole {
        instance: instance.clone(),
        params: Params::default()
            .validate()
            .map_err(|errors| anyhow!("{errors:?}"))?,
        timing: LoopOptions {
            ticks_max: Some(TICKS),
            ..LoopOptions::default()
        },
        real_time: RealTime::off(),
        consumers: Vec::new(),
    };
    let process = std::thread::spawn(move || controller(role, &Signals::none(), |_| {}));
    let mut harness = HarnessEndpoint::connect(&Ipc::join(instance)?, Session::start())?;
    while !process.is_finished() {
        let now = clock::now_ns();
        let mut sample = StateSample {
            stamp_ns: now,
            ..StateSample::default()
        };
        harness.publish_state(now, &mut sample)?;
        std::thread::sleep(Duration::from_millis(2));
    }
    let ended = process
        .join()
        .map_err(|_| anyhow!("the controller panicked"))?;
    ended.context("the controller")
}

/// Agents at work beside the controller; gives the calls that came to an end.
fn agents(
    instance: &Instance,
    server: Option<&StandIn>,
    stop: &AtomicBool,
) -> anyhow::Result<usize> {
    let model = |server: &StandIn| {
        ChatModel::new(ModelConfig {
            attempt_ms: 600_000,
            attempts: 1,
            ..ModelConfig::new(server.url(), "m")
        })
    };
    let calls = server.map(model).transpose()?.map(Calls::new);
    let mut service = AgentService::new(ServiceParams::default(), calls);
    let mut endpoint = AgentsEndpoint::connect(&Ipc::join(instance)?, Session::start())?;
    service.on_instruction(clock::now_ns(), "pick up the black bowl")?;
    let mut ended = 0;
    while !stop.load(Ordering::SeqCst) {
        let now = clock::now_ns();
        service.on_scene(now, &scene(now), None)?;
        for event in service.poll(now) {
            match event {
                Event::Plan(plan) => endpoint.send_plan(now, &plan)?,
                Event::Grounding(mut record) => {
                    endpoint.send_grounding(now, &mut record)?;
                }
                Event::Call(_) => ended += 1,
                _ => {}
            }
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(ended)
}

/// Two bowls: which one is meant is left open.
fn scene(stamp_ns: u64) -> Scene {
    let bowl = |id: u16, y_m: f64| Detection {
        id,
        label: "black bowl".to_owned(),
        confidence: 0.9,
        position_m: [0.5, y_m, 0.025],
        size_m: [0.1, 0.1, 0.05],
        orientation: None,
        box_px: None,
        colour: None,
        parts: Vec::new(),
    };
    Scene {
        stamp_ns,
        objects: vec![bowl(1, 0.0), bowl(2, 0.3)],
        ..Scene::default()
    }
}
