//! A failure that is diagnosed, recorded, and not acted on.
//!
//! The policy freezes, but the plan's parse is too uncertain to act on: every
//! query diagnoses a pick failure, the gate stays closed and says why, and the
//! base policy keeps control.
//!
//! `cargo run -p fitmac-core --example 04_closed_gate`

use fitmac_core::{Params, message::Plan, wire::Route};
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session, table};

fn main() {
    let scene = Scene::can_to_plate();
    let agent = Agent::knowing(&scene);
    let policy = Policy::new(Behaviour::Frozen);
    let mut session = Session::new(Params::guarded(), scene, policy, agent);
    session.plan = Some(Plan {
        id: 1,
        subtask_count: 1,
        confidence_permille: 300,
    });

    let done = session.run(60);

    table::print(&session.queries);
    let corrections = session
        .queries
        .iter()
        .filter(|r| r.route == Route::Execution.code());
    assert_eq!((done, corrections.count()), (false, 0));
}
