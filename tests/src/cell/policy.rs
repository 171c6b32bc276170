//! The policy: scripted, without a look at the world.

use std::{collections::VecDeque, thread::sleep};

use fitmac_core::message::ActionChunk;
use fitmac_rt::{clock, endpoint::PolicyEndpoint, port::Session, transport::Ipc};

use super::{PAUSE, robot::Spoil, thread::Shared};
use fitmac_core_tests::world::{Behaviour, Policy, Scene};

/// A policy.
pub struct PolicyState {
    script: Policy,
    scene: Scene,
    /// Answers nothing.
    pub mute: bool,
    /// Changes every answer before it is sent.
    pub spoil: Option<Spoil<ActionChunk>>,
    /// Is sent besides, as it stands.
    pub besides: VecDeque<ActionChunk>,
    /// The newest answer.
    pub newest: Option<ActionChunk>,
    /// Numbers begin above this.
    pub sequence_base: u64,
}

impl PolicyState {
    /// A policy that behaves like this.
    #[must_use]
    pub fn new(behaviour: Behaviour) -> Self {
        let mut script = Policy::new(behaviour);
        script.delay_ns = 0;
        Self {
            script,
            scene: Scene::can_to_plate(),
            mute: false,
            spoil: None,
            besides: VecDeque::new(),
            newest: None,
            sequence_base: 0,
        }
    }

    /// One that moves the arm to and fro.
    #[must_use]
    pub fn moving() -> Self {
        Self::new(Behaviour::Dithers)
    }

    /// One that does nothing, so that a recovery will.
    #[must_use]
    pub fn idle() -> Self {
        Self::new(Behaviour::Frozen)
    }

    /// Changes every answer from now on.
    pub fn spoil_with(&mut self, spoil: impl FnMut(&mut ActionChunk) + Send + 'static) {
        self.spoil = Some(Box::new(spoil));
    }
}

/// Runs the policy.
///
/// # Panics
/// If it cannot connect.
pub fn policy(transport: &Ipc, shared: &Shared<PolicyState>) {
    let session = Session::start();
    let mut ends = PolicyEndpoint::connect(transport, session).expect("connects");
    while shared.goes_on() {
        let query = ends.poll_query();
        let chunks = shared.with(|policy| {
            let mut chunks: Vec<ActionChunk> = policy.besides.drain(..).collect();
            if let (Some(query), false) = (query, policy.mute) {
                let (scene, base) = (policy.scene.clone(), policy.sequence_base);
                policy.script.ask(&query, &scene.world, &scene);
                let now_ns = clock::now_ns();
                let mut chunk = policy.script.poll(u64::MAX).expect("it answers at once");
                chunk.sequence = chunk.sequence.wrapping_add(base);
                chunk.session = session.0;
                (chunk.observation_ns, chunk.stamp_ns) = (query.stamp_ns, now_ns);
                policy.newest = Some(chunk);
                if let Some(spoil) = &mut policy.spoil {
                    spoil(&mut chunk);
                }
                chunks.push(chunk);
            }
            chunks
        });
        for chunk in chunks {
            let sent = ends.chunk_sender().send(clock::now_ns(), &chunk);
            sent.expect("sends");
            // The service keeps one message: let the controller take it.
            sleep(4 * PAUSE);
        }
        sleep(PAUSE);
    }
}
