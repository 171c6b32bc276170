//! Every recovery, closed loop, in the toy world: each must end in success.

use fitmac_core::{Params, wire::Provenance};
use fitmac_tests::world::{
    Agent, Answer, BOX, Behaviour, CAN, OTHER, Policy, Scene, Session, table,
};

fn show(session: &Session) {
    println!("{}", table::HEADING);
    for record in table::changes(&session.queries) {
        println!("{}", table::row(record));
    }
    println!("held {} ee {:?}", session.world.held(), session.world.ee_m());
    for b in &session.world.bodies {
        println!("  {} {:?}", b.id, b.position_m);
    }
}

fn run(name: &str, mut session: Session, steps: u64) {
    let done = session.run(steps);
    println!("=== {name}: {done} at {} s", session.world.now_ns() as f64 * 1e-9);
    show(&session);
    for e in &session.events { println!("event {} mode {} detail {} reasons {:?}", e.kind, e.mode, e.detail, fitmac_core::reason::names(e.reasons).collect::<Vec<_>>()); }
}

#[test]
fn explore() {
    for (profile, params) in [("guarded", Params::guarded()), ("paper", Params::paper())] {
        for scene in [Scene::can_to_plate(), Scene::bowl_to_plate(), Scene::box_to_plate(), Scene::can_to_basket()] {
            for behaviour in [
                Behaviour::Competent,
                Behaviour::WrongObject(OTHER),
                Behaviour::StallsAbove(0.05),
                Behaviour::MissesPlace([0.12, 0.0]),
                Behaviour::Dithers,
                Behaviour::Replays([0.0, 0.1]),
                Behaviour::Frozen,
            ] {
                let name = format!("{profile} target {} on {} {behaviour:?}", scene.target, scene.destination);
                let agent = Agent::knowing(&scene);
                run(&name, Session::new(params, scene.clone(), Policy::new(behaviour), agent), 400);
            }
        }
    }
    let _ = (BOX, CAN, Answer::Silence, Provenance::Rules);
}
