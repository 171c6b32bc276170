//! What the tests share: sessions and swarms that are watched tick by tick.

use fitmac_core::{Controller, Params, message::Action};
pub(crate) use fitmac_core_tests::swarm::{Glimpse, Seen};
use fitmac_core_tests::{
    swarm::Swarm,
    world::{Agent, Behaviour, OTHER, Policy, Scene, Session},
};

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
