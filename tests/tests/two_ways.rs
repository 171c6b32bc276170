//! Real time and lockstep are two ways to run the same core: for the same
//! inputs at the same times they give the same answers, bit for bit.

use std::time::Duration;

use fitmac_core::{Controller, Params, ValidParams, message::Output};
use fitmac_rt::{
    control_loop::LoopOptions,
    cycle::{Cycle, Demand, TickTime},
    diff::first_difference,
    endpoint::ControllerEndpoint,
    frame::{Tick, contents},
    instance::Instance,
    layout::Payload,
    message::OperatorRequest,
    port::{Sender, Session},
    realtime::RealTime,
    roles::{ControllerRole, controller},
    service,
    signals::Signals,
    transport::Lockstep,
};
use fitmac_tests::cell::{
    AgentsState, Memory, Peer, PolicyState, RobotState, agents, policy, robot,
};

fn params() -> ValidParams {
    let mut params = Params::guarded();
    params.clock.settle_steps = 0;
    params.validate().expect("valid")
}

/// An episode in wall-clock time on shared memory: the policy idles, until a
/// recovery has grasped; then it ends in order.
fn in_real_time() -> Vec<Tick> {
    let instance = Instance::temporary().expect("a temporary instance");
    let robot = Peer::start("robot", &instance, RobotState::default(), robot);
    let policy = Peer::start("policy", &instance, PolicyState::idle(), policy);
    let agents = Peer::start("agents", &instance, AgentsState::default(), agents);
    let memory = Memory::default();
    let role = ControllerRole {
        instance: instance.clone(),
        params: params(),
        timing: LoopOptions::default(),
        real_time: RealTime {
            priority: Some(80),
            ..RealTime::off()
        },
        consumers: vec![Box::new(memory.clone())],
    };
    let signals = Signals::none();
    let theirs = signals.clone();
    let process = std::thread::spawn(move || controller(role, &theirs, |_| {}));
    for _ in 0..3000 {
        std::thread::sleep(Duration::from_millis(20));
        if robot.with(|r| r.world.held() != 0) {
            break;
        }
    }
    signals.stop();
    let report = process.join().expect("no panic").expect("it started");
    assert_eq!(report.cadence.value("unrecorded_ticks"), Some(0));
    drop((robot, policy, agents));
    let ticks = memory.ticks();
    assert_eq!(
        ticks.len() as u64,
        report.cadence.value("ticks").expect("a counter")
    );
    ticks
}

/// The senders of a lockstep bus, one a service that the controller hears.
struct Senders {
    state: Sender<fitmac_core::message::StateSample, Lockstep>,
    chunk: Sender<fitmac_core::message::ActionChunk, Lockstep>,
    grounding: Sender<fitmac_core::message::GroundingRecord, Lockstep>,
    plan: Sender<fitmac_core::message::Plan, Lockstep>,
    verifier: Sender<fitmac_core::message::VerifierReport, Lockstep>,
    critic: Sender<fitmac_core::message::CriticReport, Lockstep>,
    request: Sender<OperatorRequest, Lockstep>,
}

impl Senders {
    fn connect(bus: &Lockstep) -> Self {
        let session = Session(1);
        Self {
            state: Sender::connect(bus, &service::STATE, session).expect("connects"),
            chunk: Sender::connect(bus, &service::CHUNK, session).expect("connects"),
            grounding: Sender::connect(bus, &service::GROUNDING, session).expect("connects"),
            plan: Sender::connect(bus, &service::PLAN, session).expect("connects"),
            verifier: Sender::connect(bus, &service::VERIFIER, session).expect("connects"),
            critic: Sender::connect(bus, &service::CRITIC, session).expect("connects"),
            request: Sender::connect(bus, &service::REQUEST, session).expect("connects"),
        }
    }

    /// Sends what a recorded tick was told.
    fn send(&mut self, tick: &Tick) {
        let now_ns = tick.head.now_ns;
        send(&mut self.state, now_ns, tick.state.as_deref());
        send(&mut self.chunk, now_ns, tick.chunk.as_deref());
        send(&mut self.grounding, now_ns, tick.grounding.as_deref());
        send(&mut self.plan, now_ns, tick.plan.as_ref());
        send(&mut self.verifier, now_ns, tick.verifier.as_ref());
        send(&mut self.critic, now_ns, tick.critic.as_ref());
        let request = OperatorRequest {
            request: tick.head.request as u8,
            reserved: [0; 7],
        };
        send(
            &mut self.request,
            now_ns,
            (request.request != 0).then_some(&request),
        );
    }
}

fn send<T: Payload>(sender: &mut Sender<T, Lockstep>, now_ns: u64, message: Option<&T>) {
    if let Some(message) = message {
        sender
            .send(now_ns, message)
            .expect("a bus takes everything");
    }
}

fn assert_same(tick: u64, recorded: &Output, now: &Output) {
    let differs = first_difference(&recorded.command, &now.command);
    assert_eq!(differs, None, "tick {tick}");
    same(tick, recorded.query.as_ref(), now.query.as_ref());
    same(tick, recorded.rebind.as_ref(), now.rebind.as_ref());
    same(tick, recorded.trace.as_ref(), now.trace.as_ref());
    same(tick, recorded.event.as_ref(), now.event.as_ref());
}

fn same<T: Payload>(tick: u64, recorded: Option<&T>, now: Option<&T>) {
    match (recorded, now) {
        (None, None) => {}
        (Some(a), Some(b)) => assert_eq!(first_difference(a, b), None, "tick {tick}"),
        _ => panic!("tick {tick}: one of the two says nothing"),
    }
}

#[test]
fn real_time_and_lockstep_decide_alike() {
    let recorded = in_real_time();
    let bus = Lockstep::new();
    let endpoint = ControllerEndpoint::connect(&bus, Session(2)).expect("connects");
    let mut senders = Senders::connect(&bus);
    let mut cycle = Cycle::new(endpoint, Controller::new(params()), Vec::new());
    let (mut queries, mut corrections) = (0, 0);
    for tick in &recorded {
        senders.send(tick);
        let time = TickTime {
            now_ns: tick.head.now_ns,
            ..TickTime::default()
        };
        let demand = match tick.head.contents & contents::LAST {
            0 => Demand::None,
            _ => Demand::Last,
        };
        let ticked = cycle.tick(time, demand);
        assert_same(tick.head.tick, &tick.output, &ticked.output);
        queries += u32::from(ticked.output.trace.is_some());
        corrections += u32::from(ticked.output.command.sub_phase != 0);
    }
    assert_eq!(cycle.record().len(), recorded.len());
    assert!(queries > 10 && corrections > 100, "{queries} {corrections}");
}
