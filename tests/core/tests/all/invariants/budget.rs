//! G. Budgets, cool-down, and how a correction ends.

use fitmac_core::{
    Params,
    message::TraceRecord,
    reason,
    wire::{Route, SubPhase},
};
use fitmac_core_tests::world::{Behaviour, Scene, Session};

use super::stand::{failures, run_to_correction, session, swarms};

#[test]
fn inv_57_each_query_costs_one_and_nothing_gives_it_back() {
    let mut paid = 0;
    swarms(|seen| {
        let recovery = seen.after.subtask().recovery();
        let queried = seen.after.episode().queries() > seen.before.query;
        if seen.before.pending && recovery.is_pending() {
            let expected = seen.before.budget - u32::from(queried);
            assert_eq!(recovery.budget(), expected, "seed {}", seen.seed);
            paid += u32::from(queried);
        }
    });
    assert!(paid > 500, "{paid}");
}

fn corrections(run: &Session) -> Vec<TraceRecord> {
    let is = |r: &&TraceRecord| r.sub_phase != SubPhase::Idle.code();
    run.queries.iter().filter(is).copied().collect()
}

#[test]
fn inv_57_and_58_a_budget_of_n_queries_gives_n_actions_and_then_none() {
    for budget in 1..12 {
        let mut params = Params::guarded();
        params.switches.hard_place = false;
        params.recovery.pick_budget = budget;
        params.gate.activations = 1;
        let mut run = session(params, &Scene::can_to_plate(), Behaviour::Frozen);
        run.run(120);
        assert_eq!(corrections(&run).len(), budget as usize);
        let last = corrections(&run).last().expect("one").query;
        let next = run
            .queries
            .iter()
            .find(|r| r.query == last + 1)
            .expect("one more");
        assert_ne!(next.reasons & reason::BUDGET_EXHAUSTED, 0, "{next:?}");
        assert_eq!((next.budget, next.sub_phase), (0, 0));
        assert!(
            next.base_action[0].is_finite(),
            "the base policy acts in the same query"
        );
    }
}

#[test]
fn inv_57_the_episodes_budget_bounds_the_sum() {
    for budget in [1, 7, 30] {
        let mut params = Params::guarded();
        params.recovery.episode_budget = budget;
        params.recovery.pick_budget = 5;
        params.recovery.place_budget = 5;
        params.gate.activations = 100;
        params.gate.cool_down_steps = 0;
        let mut run = session(params, &Scene::can_to_plate(), Behaviour::Frozen);
        run.run(1000);
        assert_eq!(
            run.controller.state().episode().correction_queries(),
            budget
        );
        assert_eq!(corrections(&run).len(), budget as usize);
    }
}

/// Runs into a correction, a few queries further, then breaks it; the next
/// query must end it.
fn broken(break_it: impl FnOnce(&mut Session)) -> TraceRecord {
    let mut run = session(Params::guarded(), &Scene::can_to_plate(), Behaviour::Frozen);
    assert!(run_to_correction(&mut run));
    run.run_until(5, |_| false);
    assert!(run.controller.state().subtask().recovery().is_pending());
    let before = run.queries.len();
    break_it(&mut run);
    run.run_until(30, |s| s.queries.len() > before + 1);
    let end = run.queries[before..]
        .iter()
        .find(|r| r.sub_phase == 0)
        .expect("it ends");
    *end
}

#[test]
fn inv_59_a_target_that_is_lost_ends_the_correction() {
    let end = broken(|run| run.world.hidden = vec![run.scene.target]);
    assert_ne!(end.reasons & reason::VALIDITY_LOST, 0, "{end:?}");
    assert_eq!(end.route, Route::Pending.code());
}

#[test]
fn inv_59_a_grounding_that_is_withdrawn_ends_it() {
    for kappa in [0.0, 0.11, f64::NAN] {
        let end = broken(|run| {
            let now_ns = run.world.now_ns();
            run.agent.observe_again(now_ns, kappa);
        });
        assert_ne!(end.reasons & reason::VALIDITY_LOST, 0, "{end:?}");
        assert!(end.kappa < 0.12);
    }
}

#[test]
fn inv_59_a_waypoint_out_of_the_workspace_ends_it() {
    let end = broken(|run| {
        let id = run.scene.target;
        if let Some(body) = run.world.body_mut(id) {
            body.position_m[0] = 1.5;
        }
    });
    assert_ne!(
        end.reasons & (reason::NO_ACTION | reason::VALIDITY_LOST),
        0,
        "{end:?}"
    );
}

#[test]
fn inv_60_corrections_are_few_and_far_between() {
    let mut starts = 0;
    swarms(|seen| {
        let recovery = seen.after.subtask().recovery();
        let same = seen.before.subtask == seen.after.subtask().index();
        let restarted = seen.told.request != 0 || seen.told.plan.is_some();
        if recovery.activations() > seen.before.activations && same && !restarted {
            let gate = &seen.params.gate;
            assert!(
                recovery.activations() <= gate.activations,
                "seed {}",
                seen.seed
            );
            // The steps that this tick observed count too.
            let since = seen.before.since_hand_back.map(|n| n.saturating_add(1));
            let rested = since.is_none_or(|n| n >= gate.cool_down_steps);
            assert!(rested, "seed {}: {since:?}", seen.seed);
            starts += 1;
        }
    });
    assert!(starts > 30, "{starts}");
}

#[test]
fn inv_60_a_hopeless_grasp_ends_for_good() {
    for activations in [1, 2, 3] {
        let mut params = Params::guarded();
        params.gate.activations = activations;
        params.recovery.episode_budget = 10_000;
        let mut run = session(params, &Scene::can_to_plate(), Behaviour::Frozen);
        run.world.plant.weak_grasps = u32::MAX;
        assert!(!run.run(2000));
        let recovery = run.controller.state().subtask().recovery();
        assert_eq!(recovery.activations(), activations);
        assert!(!recovery.is_pending());
        let last = corrections(&run).last().expect("some").query;
        let total = run.queries.last().expect("some").query;
        assert!(total > last + 100, "the base policy has it to the end");
    }
}

#[test]
fn inv_61_after_success_no_recovery_action_follows() {
    for scene in [
        Scene::can_to_plate(),
        Scene::can_to_basket(),
        Scene::bowl_to_plate(),
    ] {
        for behaviour in failures() {
            let mut run = session(Params::guarded(), &scene, behaviour);
            assert!(run.run(400));
            // The verifier's word arrives with the next tick.
            run.tick();
            let known = run.queries.len();
            run.run_until(100, |_| false);
            let later = &run.queries[known..];
            assert!(later.iter().all(|r| r.sub_phase == 0), "{later:?}");
            assert!(!run.controller.state().subtask().recovery().is_pending());
            assert!(run.scene.is_done(&run.world));
        }
    }
}
