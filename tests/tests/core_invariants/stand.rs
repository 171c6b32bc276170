//! What the tests share: sessions and swarms that are watched tick by tick.

use fitmac_core::{
    Controller, Params, State,
    message::{Action, ObjectId, Output},
    wire::{Phase, Route, SubPhase},
};
use fitmac_tests::{
    swarm::{Swarm, Told},
    world::{Agent, Behaviour, OTHER, Policy, Scene, Session},
};

/// What was so before the tick.
pub(crate) struct Glimpse {
    pub(crate) action: Action,
    pub(crate) phase: Phase,
    pub(crate) subtask: u32,
    pub(crate) target: ObjectId,
    pub(crate) epoch: u64,
    pub(crate) pending: bool,
    pub(crate) budget: u32,
    pub(crate) activations: u32,
    pub(crate) since_hand_back: Option<u32>,
    pub(crate) route: u8,
    pub(crate) query: u64,
}

impl Glimpse {
    pub(crate) fn of(state: &State) -> Self {
        let subtask = state.subtask();
        Self {
            action: *state.action(),
            phase: subtask.estimator().phase(),
            subtask: subtask.index(),
            target: subtask.lock().target(),
            epoch: subtask.lock().epoch(),
            pending: subtask.recovery().is_pending(),
            budget: subtask.recovery().budget(),
            activations: subtask.recovery().activations(),
            since_hand_back: subtask.recovery().since_hand_back(),
            route: state.decision().route.code(),
            query: state.episode().queries(),
        }
    }
}

/// One tick, from both sides.
pub(crate) struct Seen<'a> {
    pub(crate) seed: u64,
    pub(crate) params: &'a Params,
    pub(crate) before: &'a Glimpse,
    pub(crate) told: &'a Told,
    pub(crate) output: &'a Output,
    pub(crate) after: &'a State,
}

impl Seen<'_> {
    pub(crate) fn sub_phase(&self) -> SubPhase {
        self.output.command.sub_phase().expect("a known step")
    }

    /// A recovery's action started in this tick.
    pub(crate) fn starts_recovery_action(&self) -> bool {
        self.output.trace.is_some_and(|r| {
            r.sub_phase != SubPhase::Idle.code()
                && (r.route == Route::Execution.code() || r.route == Route::Pending.code())
        })
    }
}

/// Seeds of the short form.
pub(crate) const SEEDS: core::ops::Range<u64> = 0..80;
const TICKS: u32 = 1200;

/// Runs the swarms and shows every tick.
pub(crate) fn swarms(mut look: impl FnMut(&Seen<'_>)) {
    for seed in SEEDS {
        swarm(seed, TICKS, &mut look);
    }
}

/// Runs one swarm and shows every tick.
pub(crate) fn swarm(seed: u64, ticks: u32, look: &mut impl FnMut(&Seen<'_>)) {
    let mut swarm = Swarm::new(seed);
    let mut controller = Controller::new(swarm.params);
    let params = *swarm.params.get();
    for _ in 0..ticks {
        let told = swarm.tick();
        let before = Glimpse::of(controller.state());
        let output = controller.tick(told.now_ns, &told.input());
        swarm.hear(&output);
        look(&Seen {
            seed,
            params: &params,
            before: &before,
            told: &told,
            output: &output,
            after: controller.state(),
        });
    }
}

/// A session in which the agents know the target.
pub(crate) fn session(params: Params, scene: &Scene, behaviour: Behaviour) -> Session {
    let agent = Agent::knowing(scene);
    Session::new(params, scene.clone(), Policy::new(behaviour), agent)
}

/// Every way to fail that the toy policy knows.
pub(crate) fn failures() -> [Behaviour; 6] {
    [
        Behaviour::WrongObject(OTHER),
        Behaviour::StallsAbove(0.05),
        Behaviour::MissesPlace([0.12, 0.0]),
        Behaviour::Dithers,
        Behaviour::Replays([0.0, 0.1]),
        Behaviour::Frozen,
    ]
}

/// The bits of an action.
pub(crate) fn bits(action: &Action) -> [u64; 7] {
    action.map(f64::to_bits)
}

/// Runs until a correction is pending; true if one came.
pub(crate) fn run_to_correction(session: &mut Session) -> bool {
    session.run_until(400, |s| {
        s.controller.state().subtask().recovery().is_pending()
    })
}
