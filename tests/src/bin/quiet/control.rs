//! The control thread, and the gate at which it is watched.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicI32, AtomicU8, AtomicU64, Ordering::SeqCst},
    },
    thread,
    time::Duration,
};

use fitmac_core::{Controller, Params};
use fitmac_rt::{
    control_loop::{self, LoopOptions, Trigger},
    counters::Cadence,
    cycle::Cycle,
    endpoint::ControllerEndpoint,
    frame::{Parts, Tick},
    instance::Instance,
    port::Session,
    realtime::{Core, RealTime},
    ring::{RING_BYTES, Record, RingRecord, ring},
    signals::Signals,
    telemetry::{Consume, Telemetry},
    transport::Ipc,
};

use fitmac_tests::meter::{self, Meter};

use crate::{Plant, report::Flow};

#[global_allocator]
static METER: Meter = Meter;

/// Ticks before the first that counts: everyone connects.
const WARM_UP: u64 = 1000;

/// Where the control thread is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(crate) enum Stage {
    /// Runs, and is not watched yet.
    WarmingUp,
    /// Spins until it is watched, without a system call.
    Ready,
    /// Runs and is watched.
    Counting,
    /// Spins until it is no longer watched.
    Done,
    /// Runs on to its end.
    Leaving,
}

/// Between the control thread and who watches it.
pub(crate) struct Gate {
    stage: AtomicU8,
    thread: AtomicI32,
    ticks: u64,
    plant: Option<Plant>,
    /// Ticks while it was watched.
    pub(crate) counted: AtomicU64,
}

impl Gate {
    pub(crate) fn new(ticks: u64, plant: Option<Plant>) -> Self {
        Self {
            stage: AtomicU8::new(Stage::WarmingUp as u8),
            thread: AtomicI32::new(0),
            ticks,
            plant,
            counted: AtomicU64::new(0),
        }
    }

    /// Where the control thread is.
    pub(crate) fn stage(&self) -> Stage {
        match self.stage.load(SeqCst) {
            0 => Stage::WarmingUp,
            1 => Stage::Ready,
            2 => Stage::Counting,
            3 => Stage::Done,
            _ => Stage::Leaving,
        }
    }

    /// The system's number of the control thread.
    pub(crate) fn thread_id(&self) -> i32 {
        self.thread.load(SeqCst)
    }

    /// Lets the control thread into this stage.
    pub(crate) fn pass(&self, stage: Stage) {
        self.stage.store(stage as u8, SeqCst);
    }

    /// Waits until the control thread is there.
    pub(crate) fn wait(&self, stage: Stage) {
        while self.stage() < stage {
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits without a system call.
    fn spin(&self, stage: Stage) {
        while self.stage() < stage {
            core::hint::spin_loop();
        }
    }
}

/// The ring, and around some ticks of it the count.
struct Watched<'a> {
    ring: RingRecord,
    gate: &'a Gate,
    ticks: u64,
    before: u64,
    allocations: u64,
}

impl Record for Watched<'_> {
    fn record(&mut self, parts: &Parts<'_>) {
        self.ring.record(parts);
        self.ticks += 1;
        if self.ticks == WARM_UP {
            self.gate.pass(Stage::Ready);
            self.gate.spin(Stage::Counting);
            self.before = meter::calls();
        }
        if self.ticks == WARM_UP + self.gate.ticks / 2 {
            plant(self.gate.plant);
        }
        if self.ticks > WARM_UP {
            self.gate.counted.store(self.ticks - WARM_UP, SeqCst);
        }
        if self.ticks == WARM_UP + self.gate.ticks {
            self.allocations = meter::calls() - self.before;
            self.gate.pass(Stage::Done);
            self.gate.spin(Stage::Leaving);
        }
    }
}

fn plant(what: Option<Plant>) {
    match what {
        Some(Plant::Allocation) => drop(core::hint::black_box(Box::new([0_u8; 64]))),
        Some(Plant::Call) => {
            core::hint::black_box(rustix::process::getppid());
        }
        Some(Plant::Peer) | None => {}
    }
}

/// Sees what flows, on the telemetry thread.
struct Watcher(Arc<Flow>);

impl Consume for Watcher {
    fn tick(&mut self, tick: &Tick) -> io::Result<()> {
        self.0.see(tick, tick.head.tick > WARM_UP);
        Ok(())
    }

    fn finish(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn name(&self) -> String {
        "counter".into()
    }
}

/// The control thread; gives its allocations and overruns.
pub(crate) fn run(instance: &Instance, rate: u32, flow: &Arc<Flow>, gate: &Gate) -> (u64, u64) {
    let session = Session::start();
    let transport = Ipc::join(instance).expect("joins");
    let endpoint = ControllerEndpoint::connect(&transport, session).expect("connects");
    let cadence = Arc::new(Cadence::default());
    let (ring, reader) = ring(RING_BYTES, Arc::clone(&cadence));
    let signals = Signals::none();
    let consumers: Vec<Box<dyn Consume>> = vec![Box::new(Watcher(Arc::clone(flow)))];
    let telemetry = Telemetry::start(
        instance,
        session,
        reader,
        Arc::clone(&cadence),
        consumers,
        signals.clone(),
        None,
    )
    .expect("the telemetry starts");
    let watched = Watched {
        ring,
        gate,
        ticks: 0,
        before: 0,
        allocations: 0,
    };
    let mut cycle = Cycle::new(endpoint, core(), watched);
    let in_front = RealTime {
        core: Core::Any,
        allow_non_rt: true,
        ..RealTime::default()
    };
    let prepared = in_front.prepare();
    let thread = rustix::thread::gettid().as_raw_nonzero().get();
    gate.thread.store(thread, SeqCst);
    let options = LoopOptions {
        period_ns: 1_000_000_000 / u64::from(rate),
        ticks_max: Some(WARM_UP + gate.ticks),
        // A stop for overruns would end what is watched.
        overruns_in_a_row_max: u32::MAX,
        // Long enough for the rehearsal, which shall be quiet, too.
        trigger: Trigger::Deadline { spin_ns: 150_000 },
        ..LoopOptions::default()
    };
    control_loop::run(&mut cycle, &options, &cadence, &signals).expect("a rate in range");
    let allocations = cycle.into_record().allocations;
    drop(prepared);
    let recorded = telemetry.finish();
    assert!(recorded.iter().all(|r| r.outcome.is_ok()), "{recorded:?}");
    let count = |name| cadence.value(name).expect("a counter");
    let kept = flow.ticks.load(SeqCst) + count("unrecorded_ticks");
    assert_eq!(kept, count("ticks"), "each tick is recorded or counted");
    (allocations, count("overruns"))
}

fn core() -> Controller {
    let mut params = Params::guarded();
    params.clock.settle_steps = 0;
    // Under a tracer on a busy machine the loop is slow; that is no suspension.
    params.clock.gap_stop_ms = 5000;
    params.state.stop_age_ms = 10_000;
    Controller::new(params.validate().expect("valid"))
}
