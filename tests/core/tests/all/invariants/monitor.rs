//! D. The monitor, in the loop. Its equations are checked in the core's own
//! tests, beside the code.

use core::fmt::Debug;

use fitmac_core::{
    Controller, Params,
    evidence::{PROGRESS, STALL},
    message::TraceRecord,
    params::Switches,
};
use fitmac_core_tests::{
    swarm::Swarm,
    world::{Behaviour, Scene, Session},
};

use super::stand::{failures, session};

/// What was decided, without places and times.
fn decided(run: &Session) -> Vec<(u64, u64, u8, u8, u8, u8)> {
    let key = |r: &TraceRecord| {
        (
            r.query,
            r.policy_step,
            r.phase,
            r.diagnosis,
            r.route,
            r.sub_phase,
        )
    };
    run.queries.iter().map(key).collect()
}

/// As text, so that a NaN equals itself.
fn text(value: &impl Debug) -> String {
    format!("{value:?}")
}

#[test]
fn inv_40_a_repeated_input_changes_nothing() {
    for seed in 0..60 {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        let mut twice = controller.clone();
        for _ in 0..800 {
            let told = swarm.tick();
            let active = twice.state().subtask().index();
            let output = controller.tick(told.now_ns, &told.input());
            let first = twice.tick(told.now_ns, &told.input());
            assert_eq!(text(&first.trace), text(&output.trace), "seed {seed}");
            // The same messages once more, except for what is an order, and for a report on
            // another subtask than the active one: it was not heard, and may be now.
            let mut again = told.clone();
            again.request = 0;
            again.verifier = again.verifier.filter(|report| report.subtask == active);
            again.critic = again.critic.filter(|report| report.subtask == active);
            let repeated = twice.tick(told.now_ns, &again.input());
            assert_eq!(repeated.query, None, "seed {seed}");
            assert_eq!(repeated.rebind, None, "seed {seed}");
            assert_eq!(repeated.trace, None, "seed {seed}");
            let (a, b) = (controller.state(), twice.state());
            assert_eq!(a.action(), b.action(), "seed {seed}");
            assert_eq!(a.decision(), b.decision(), "seed {seed}");
            assert_eq!(a.subtask(), b.subtask(), "seed {seed}");
            assert_eq!(a.episode(), b.episode(), "seed {seed}");
            assert_eq!(a.queue(), b.queue(), "seed {seed}");
            swarm.hear(&output);
        }
    }
}

#[test]
fn inv_40_a_sample_heard_again_later_is_as_good_as_none() {
    let mut repeats = 0;
    for seed in 0..150 {
        let mut swarm = Swarm::new(seed);
        let mut silent = Controller::new(swarm.params);
        let mut echoed = silent.clone();
        let mut newest = None;
        for _ in 0..800 {
            let told = swarm.tick();
            let mut again = told.clone();
            if told.request != 0 || told.plan.is_some() {
                // A new episode: numbers may begin anew, and an old sample would be a new one.
                newest = None;
            } else if told.state.is_none() {
                again.state = newest;
                repeats += u32::from(newest.is_some());
            }
            let refused = silent.state().refusals().clone();
            let output = silent.tick(told.now_ns, &told.input());
            let echo = echoed.tick(told.now_ns, &again.input());
            assert_eq!(text(&echo), text(&output), "seed {seed}");
            if told.state.is_some() {
                let taken = *silent.state().refusals() == refused;
                newest = told.state.filter(|_| taken);
            }
            swarm.hear(&output);
        }
        assert_eq!(echoed.state(), silent.state(), "seed {seed}");
    }
    assert!(repeats > 2000, "{repeats}");
}

#[test]
fn inv_40_more_control_ticks_a_step_change_no_decision() {
    for behaviour in failures() {
        let mut all = Vec::new();
        for tick_ns in [1_000_000, 2_000_000, 5_000_000, 10_000_000] {
            let mut run = session(Params::guarded(), &Scene::can_to_plate(), behaviour.clone());
            run.tick_ns = tick_ns;
            run.policy.delay_ns = 0;
            run.agent.delay_ns = 200_000_000;
            run.run(400);
            let counts: Vec<_> = decided(&run)
                .iter()
                .map(|&(query, _, phase, diagnosis, route, step)| {
                    (query, phase, diagnosis, route, step)
                })
                .take(20)
                .collect();
            all.push(counts);
        }
        assert!(all.windows(2).all(|p| p[0] == p[1]), "{behaviour:?}");
    }
}

/// The scene somewhere else on the table.
fn moved(mut scene: Scene, by_m: [f64; 2]) -> Scene {
    scene.world.plant.reach_m = 5.0;
    let mut world = scene.world.clone();
    for body in &mut world.bodies {
        body.position_m[0] += by_m[0];
        body.position_m[1] += by_m[1];
    }
    let [x, y, z] = world.ee_m();
    world.place([x + by_m[0], y + by_m[1], z]);
    scene.world = world;
    scene
}

#[test]
fn inv_41_where_the_table_stands_changes_no_decision() {
    let mut params = Params::guarded();
    params.filter.workspace_min_x_m = -2.0;
    params.filter.workspace_max_x_m = 2.0;
    params.filter.workspace_min_y_m = -2.0;
    params.filter.workspace_max_y_m = 2.0;
    for scene in [Scene::can_to_plate(), Scene::can_to_basket()] {
        for behaviour in failures() {
            let mut runs = Vec::new();
            for by_m in [[0.0, 0.0], [0.25, -0.5], [-0.75, 0.125]] {
                let mut run = session(params, &moved(scene.clone(), by_m), behaviour.clone());
                assert!(run.run(400));
                runs.push(decided(&run));
            }
            assert!(runs.windows(2).all(|p| p[0] == p[1]), "{behaviour:?}");
        }
    }
}

#[test]
fn inv_42_what_the_monitor_sees_changes_no_command_of_the_base_policy() {
    for behaviour in failures() {
        let watched = Params {
            switches: Switches::BACKBONE_ONLY,
            ..Params::guarded()
        };
        let mut nervous = watched;
        nervous.patience.approach_steps = 1;
        nervous.patience.transport_steps = 1;
        nervous.timeout.approach_steps = 1;
        nervous.timeout.grasp_steps = 1;
        nervous.progress.reversals = 1;
        nervous.evidence.wrong_target_steps = 1;
        let mut a = session(watched, &Scene::can_to_plate(), behaviour.clone());
        let mut b = session(nervous, &Scene::can_to_plate(), behaviour.clone());
        let mut differed = false;
        for n in 0..3000 {
            let (x, y) = (a.tick(), b.tick());
            assert_eq!(
                x.command.action, y.command.action,
                "{behaviour:?}, tick {n}"
            );
            assert_eq!(x.command.setpoint_position_m, y.command.setpoint_position_m);
            differed |=
                a.queries.last().map(|r| r.evidence) != b.queries.last().map(|r| r.evidence);
        }
        assert!(differed, "{behaviour:?}: they do see different things");
    }
}

#[test]
fn inv_39_a_hidden_target_is_no_stall() {
    let mut params = Params::guarded();
    params.switches = Switches::BACKBONE_ONLY;
    let mut run = session(params, &Scene::can_to_plate(), Behaviour::Frozen);
    run.run_until(14, |_| false);
    let target = run.scene.target;
    run.world.hidden = vec![target];
    let known = run.queries.len();
    run.run_until(60, |_| false);
    for r in &run.queries[known..] {
        assert_eq!(r.evidence & (STALL | PROGRESS), 0, "{r:?}");
    }
    // And once it is seen again, the same arm does stall.
    run.world.hidden.clear();
    run.run_until(40, |_| false);
    assert_ne!(run.queries.last().map_or(0, |r| r.evidence) & STALL, 0);
}
