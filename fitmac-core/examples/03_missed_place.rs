//! A policy that picks well, but lets go twelve centimetres beside the plate.
//!
//! In the `paper` profile the released can first comes to rest: then geometry
//! says that it lies outside its region, which is strong evidence. The can is
//! picked up again and placed. (The `guarded` profile sees it coming while the
//! can is being lowered.)
//!
//! `cargo run -p fitmac-core --example 03_missed_place`

use fitmac_core::Params;
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session, table};

fn main() {
    let scene = Scene::can_to_plate();
    let agent = Agent::knowing(&scene);
    let policy = Policy::new(Behaviour::MissesPlace([0.12, 0.0]));
    let mut session = Session::new(Params::paper(), scene, policy, agent);

    let done = session.run(300);

    table::print(&session.queries);
    assert!(done, "the can stands on the plate");
}
