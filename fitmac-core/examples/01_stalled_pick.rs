//! A policy that comes to rest above its target and does nothing.
//!
//! The monitor sees no progress for the phase's patience, the stall persists
//! through three queries, the gate opens, and the pick recovery takes over:
//! hover, descend, close, lift test, and on to the plate.
//!
//! `cargo run -p fitmac-core --example 01_stalled_pick`

use fitmac_core::Params;
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session, table};

fn main() {
    let scene = Scene::can_to_plate();
    let agent = Agent::knowing(&scene);
    let policy = Policy::new(Behaviour::StallsAbove(0.05));
    let mut session = Session::new(Params::guarded(), scene, policy, agent);

    let done = session.run(300);

    table::print(&session.queries);
    assert!(done, "the can stands on the plate");
}
