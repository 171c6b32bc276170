//! The agents: they know the target, and say what they are told to say.

use std::{collections::VecDeque, thread::sleep};

use fitmac_core::message::{GroundingRecord, Plan};
use fitmac_rt::{clock, endpoint::AgentsEndpoint, port::Session, transport::Ipc};

use super::{PAUSE, thread::Shared};
use fitmac_core_tests::world::{Agent, Answer, Scene};

/// Agents.
pub struct AgentsState {
    /// What they answer.
    pub agent: Agent,
    /// Is sent besides, under the next number.
    pub besides: VecDeque<GroundingRecord>,
    /// The newest record.
    pub newest: Option<GroundingRecord>,
    scene: Scene,
}

impl Default for AgentsState {
    fn default() -> Self {
        let scene = Scene::can_to_plate();
        let mut agent = Agent::knowing(&scene);
        agent.delay_ns = 0;
        Self {
            agent,
            besides: VecDeque::new(),
            newest: None,
            scene,
        }
    }
}

impl AgentsState {
    /// Agents that find nothing.
    #[must_use]
    pub fn clueless() -> Self {
        let mut state = Self::default();
        let none = Answer::Target {
            id: 0,
            kappa: 0.0,
            provenance: fitmac_core::wire::Provenance::Rules,
        };
        state.agent.answers = VecDeque::from([none]);
        state
    }
}

/// Runs the agents.
///
/// # Panics
/// If they cannot connect.
pub fn agents(transport: &Ipc, shared: &Shared<AgentsState>) {
    let mut ends = AgentsEndpoint::connect(transport, Session::start()).expect("connects");
    let plan = Plan {
        id: 1,
        subtask_count: 1,
        confidence_permille: 1000,
    };
    ends.send_plan(clock::now_ns(), &plan).expect("sends");
    while shared.goes_on() {
        let request = ends.poll_rebind();
        let now_ns = clock::now_ns();
        let records = shared.with(|state| {
            if let Some(request) = &request {
                state.agent.ask(now_ns, request, &state.scene);
            }
            let answer = state.agent.poll(now_ns);
            state.newest = answer.or(state.newest);
            let mut records: Vec<GroundingRecord> = state.besides.drain(..).collect();
            records.extend(answer);
            records
        });
        for mut record in records {
            let sent = ends.send_grounding(clock::now_ns(), &mut record);
            sent.expect("sends");
        }
        sleep(PAUSE);
    }
}
