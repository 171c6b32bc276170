//! What the controller is told in a session, kept, to be told again as fast as it can listen.

use std::hint::black_box;

use fitmac_core::{
    Controller, Params,
    message::{ActionChunk, GroundingRecord, Input, StateSample, VerifierReport},
};
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session, Verifier};

/// A control tick of 1 kHz, and as many as the session has.
const TICK_NS: u64 = 1_000_000;
const TICKS: usize = 4_000;

struct Told {
    now_ns: u64,
    state: Option<StateSample>,
    chunk: Option<ActionChunk>,
    grounding: Option<GroundingRecord>,
    verifier: Option<VerifierReport>,
}

/// A session from its first tick on.
pub(crate) struct Recorded {
    start: Controller,
    told: Vec<Told>,
}

impl Recorded {
    /// The policy does what it should.
    pub(crate) fn competent() -> Self {
        Self::of(Behaviour::Competent)
    }

    /// The policy does nothing: recoveries do it all.
    pub(crate) fn frozen() -> Self {
        Self::of(Behaviour::Frozen)
    }

    fn of(behaviour: Behaviour) -> Self {
        let scene = Scene::can_to_plate();
        let agent = Agent::knowing(&scene);
        let mut session = Session::new(Params::guarded(), scene, Policy::new(behaviour), agent);
        session.verifier = Verifier::Successes;
        session.tick_ns = TICK_NS;
        let start = session.controller.clone();
        let mut told = Vec::with_capacity(TICKS);
        for _ in 0..TICKS {
            let mut heard = None;
            session.tick_with(|input| {
                heard = Some(Told {
                    now_ns: 0,
                    state: input.state.copied(),
                    chunk: input.chunk.copied(),
                    grounding: input.grounding.copied(),
                    verifier: input.verifier.copied(),
                });
            });
            let now_ns = session.world.now_ns();
            told.extend(heard.map(|heard| Told { now_ns, ..heard }));
        }
        Self { start, told }
    }

    /// Ticks.
    pub(crate) fn len(&self) -> usize {
        self.told.len()
    }

    /// Every tick, from the start.
    pub(crate) fn play(&mut self) {
        let mut controller = self.start.clone();
        for told in &self.told {
            let input = Input {
                state: told.state.as_ref(),
                chunk: told.chunk.as_ref(),
                grounding: told.grounding.as_ref(),
                verifier: told.verifier.as_ref(),
                ..Input::default()
            };
            black_box(&controller.tick(told.now_ns, black_box(&input)));
        }
    }
}
