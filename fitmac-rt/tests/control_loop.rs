//! The loop around the core, on real shared memory and a real clock. Nothing
//! here depends on how fast the machine is.

use std::{
    sync::{Arc, Mutex},
    thread,
};

use fitmac_core::{
    Params, ValidParams,
    message::{Command, StateSample},
};
use fitmac_rt::{
    clock,
    control_loop::{LoopOptions, LoopOptionsError, Trigger},
    endpoint::HarnessEndpoint,
    frame::{Tick, contents},
    instance::{Instance, InstanceError},
    port::Session,
    realtime::{Core, RealTime},
    roles::{ControllerError, ControllerReport, ControllerRole, controller},
    signals::Signals,
    telemetry::Consume,
    transport::Ipc,
};

fn params() -> ValidParams {
    Params::default()
        .validate()
        .expect("the defaults are valid")
}

#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<Tick>>>);

impl Consume for Memory {
    fn tick(&mut self, tick: &Tick) -> std::io::Result<()> {
        self.0.lock().expect("no panic").push(tick.clone());
        Ok(())
    }

    fn finish(&mut self) -> std::io::Result<()> {
        Ok(())
    }

    fn name(&self) -> String {
        "memory".into()
    }
}

fn role(instance: &Instance, timing: LoopOptions, memory: &Memory) -> ControllerRole {
    ControllerRole {
        instance: instance.clone(),
        params: params(),
        timing,
        real_time: RealTime::off(),
        consumers: vec![Box::new(memory.clone())],
    }
}

/// Runs a controller beside a harness that sends samples until the last command.
fn run(timing: LoopOptions, signals: &Signals) -> (ControllerReport, Vec<Tick>, Vec<Command>) {
    let instance = Instance::temporary().expect("a temporary instance");
    let memory = Memory::default();
    let mut harness =
        HarnessEndpoint::connect(&Ipc::join(&instance).expect("joins"), Session::start())
            .expect("connects");
    let task = role(&instance, timing, &memory);
    let controller_signals = signals.clone();
    let process = thread::spawn(move || controller(task, &controller_signals, |_| {}));
    let mut seen: Vec<Command> = Vec::new();
    while seen.last().is_none_or(|c| c.flags & Command::LAST == 0) && !process.is_finished() {
        let now = clock::now_ns();
        let mut sample = StateSample {
            stamp_ns: now,
            ..StateSample::default()
        };
        harness.publish_state(now, &mut sample).expect("sends");
        seen.extend(harness.poll_command().map(|e| e.payload));
        thread::yield_now();
    }
    let report = process
        .join()
        .expect("no panic")
        .expect("the controller started");
    seen.extend(harness.poll_command().map(|e| e.payload));
    drop(harness);
    let ticks = memory.0.lock().expect("no panic").clone();
    assert_eq!(instance.files(), Vec::<std::path::PathBuf>::new());
    (report, ticks, seen)
}

fn check(report: &ControllerReport, ticks: &[Tick], seen: &[Command]) {
    let count = report.cadence.value("ticks").expect("a counter");
    assert_eq!(ticks.len() as u64, count, "every tick is recorded");
    assert_eq!(report.recorded[0].ticks, count);
    for (before, after) in ticks.iter().zip(&ticks[1..]) {
        assert_eq!(after.head.tick, before.head.tick + 1);
        assert_eq!(
            after.output.command.sequence,
            before.output.command.sequence + 1
        );
        assert!(after.head.now_ns > before.head.now_ns);
    }
    let (last, others) = ticks.split_last().expect("ticks");
    assert_ne!(last.head.contents & contents::LAST, 0);
    assert!(others.iter().all(|t| t.head.contents & contents::LAST == 0));
    let farewell = seen.last().expect("commands arrived");
    assert_ne!(farewell.flags & Command::LAST, 0);
    assert_eq!(farewell.sequence, last.output.command.sequence);
    assert!(seen.windows(2).all(|w| w[0].sequence < w[1].sequence));
    let with_state = ticks.iter().filter(|t| t.state.is_some()).count() as u64;
    assert_eq!(report.cadence.value("state.received"), Some(with_state));
    assert!(with_state > 0);
}

#[test]
fn the_loop_ticks_records_and_says_goodbye() {
    for trigger in [
        Trigger::Deadline { spin_ns: 0 },
        Trigger::Deadline { spin_ns: 100_000 },
        Trigger::State {
            lead_ns: 200_000,
            patience_ns: 200_000,
        },
    ] {
        let timing = LoopOptions {
            trigger,
            ticks_max: Some(300),
            shutdown_max_ns: 20_000_000,
            ..LoopOptions::default()
        };
        let (report, ticks, seen) = run(timing, &Signals::none());
        assert!(ticks.len() > 300);
        check(&report, &ticks, &seen);
    }
}

#[test]
fn a_request_to_end_is_told_to_the_core_until_the_last_command() {
    let signals = Signals::none();
    signals.stop();
    let timing = LoopOptions {
        shutdown_max_ns: 20_000_000,
        ..LoopOptions::default()
    };
    let (report, ticks, seen) = run(timing, &signals);
    check(&report, &ticks, &seen);
    let stop = u64::from(fitmac_core::wire::Request::Stop.code());
    assert!(ticks[1..].iter().all(|t| t.head.request == stop));
}

#[test]
fn skipped_periods_are_counted_and_never_caught_up() {
    let timing = LoopOptions {
        ticks_max: Some(400),
        shutdown_max_ns: 20_000_000,
        ..LoopOptions::default()
    };
    let (report, ticks, _) = run(timing, &Signals::none());
    let skipped: u64 = ticks.iter().map(|t| t.head.skipped).sum();
    let counted = report.cadence.value("skipped_periods").expect("a counter");
    // What the last tick caused has no tick to stand in.
    assert!(skipped <= counted);
    // Each tick begins on the grid of the first: whole periods apart, less its lateness.
    let start = ticks[0].head.now_ns - ticks[0].head.lateness_ns;
    for t in &ticks {
        let deadline = t.head.now_ns - t.head.lateness_ns;
        assert_eq!((deadline - start) % timing.period_ns, 0);
    }
    let periods = (ticks
        .last()
        .map_or(0, |t| t.head.now_ns - t.head.lateness_ns)
        - start)
        / timing.period_ns;
    assert_eq!(periods, ticks.len() as u64 - 1 + skipped);
}

#[test]
fn a_second_controller_and_bad_timing_are_refused() {
    let instance = Instance::temporary().expect("a temporary instance");
    let memory = Memory::default();
    let lock = instance.lock_controller().expect("free");
    let refused = controller(
        role(&instance, LoopOptions::default(), &memory),
        &Signals::none(),
        |_| {},
    );
    assert!(matches!(
        refused,
        Err(ControllerError::Instance(
            InstanceError::ControllerRuns { .. }
        ))
    ));
    drop(lock);
    for (timing, expected) in [
        (
            LoopOptions {
                period_ns: 100_000,
                ..LoopOptions::default()
            },
            LoopOptionsError::Period(100_000),
        ),
        (
            LoopOptions {
                trigger: Trigger::Deadline { spin_ns: 600_000 },
                ..LoopOptions::default()
            },
            LoopOptionsError::Spin {
                spin_ns: 600_000,
                period_ns: 1_000_000,
            },
        ),
    ] {
        match controller(role(&instance, timing, &memory), &Signals::none(), |_| {}) {
            Err(ControllerError::Timing(e)) => assert_eq!(e, expected),
            other => panic!("{other:?}"),
        }
    }
    let mut unfit = role(&instance, LoopOptions::default(), &memory);
    unfit.real_time = RealTime {
        core: Core::Number(100_000),
        allow_non_rt: false,
        ..RealTime::off()
    };
    assert!(matches!(
        controller(unfit, &Signals::none(), |_| {}),
        Err(ControllerError::NotRealTime(_))
    ));
    assert!(memory.0.lock().expect("no panic").is_empty());
}
