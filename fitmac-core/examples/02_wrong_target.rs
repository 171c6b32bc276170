//! A policy that goes for another object than the one it is told.
//!
//! The first binding came from rules only, so the approach to another object
//! is held against the binding first: the agents look again. They confirm it,
//! and from then on the same approach speaks against the execution: the pick
//! recovery takes the arm to the right object.
//!
//! `cargo run -p fitmac-core --example 02_wrong_target`

use fitmac_core::{Params, wire::Provenance};
use fitmac_core_tests::world::{
    Agent, Answer, Behaviour, CAN, OTHER, Policy, Scene, Session, table,
};

fn main() {
    let agent = Agent::new([
        Answer::Target {
            id: CAN,
            kappa: 0.6,
            provenance: Provenance::Rules,
        },
        Answer::Target {
            id: CAN,
            kappa: 0.9,
            provenance: Provenance::Recheck,
        },
    ]);
    let policy = Policy::new(Behaviour::WrongObject(OTHER));
    let mut session = Session::new(Params::guarded(), Scene::can_to_plate(), policy, agent);

    let done = session.run(300);

    table::print(&session.queries);
    assert!(done, "the right can stands on the plate");
}
