//! B. One route a query, and what it leads to.

use fitmac_core::{
    Controller, Params,
    gate::Authorisation,
    message::{Command, Input, TraceRecord},
    reason,
    route::route,
    wire::{Mode, Route, SubPhase},
};
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene};

use super::stand::{failures, session, swarms};

const AUTHORISATIONS: [Authorisation; 5] = [
    Authorisation::Closed(0),
    Authorisation::Closed(reason::STREAK_SHORT),
    Authorisation::Target(reason::STRONG_EVIDENCE),
    Authorisation::Execution(reason::EXECUTION_STREAK),
    Authorisation::Execution(reason::STRONG_EVIDENCE),
];

#[test]
fn inv_12_the_priority_is_total_and_exclusive() {
    for pending in [false, true] {
        for gate in AUTHORISATIONS {
            let chosen: Vec<Route> = Route::ALL
                .iter()
                .copied()
                .filter(|r| match r {
                    Route::Pending => pending,
                    Route::Target => !pending && matches!(gate, Authorisation::Target(_)),
                    Route::Execution => !pending && matches!(gate, Authorisation::Execution(_)),
                    Route::Base => !pending && matches!(gate, Authorisation::Closed(_)),
                })
                .collect();
            assert_eq!(chosen, [route(pending, gate)], "{pending} {gate:?}");
        }
    }
}

#[test]
fn inv_13_a_pending_correction_goes_first_whatever_the_gate_says() {
    for gate in AUTHORISATIONS {
        assert_eq!(route(true, gate), Route::Pending);
    }
    // And in the loop: while one is pending every query takes that route.
    let mut checked = 0;
    swarms(|seen| {
        if seen.before.pending && seen.after.episode().queries() > seen.before.query {
            let same_subtask = seen.after.subtask().index() == seen.before.subtask;
            let restarted = seen.told.request != 0 || seen.told.plan.is_some();
            if same_subtask && !restarted {
                assert_eq!(
                    seen.after.decision().route,
                    Route::Pending,
                    "seed {}",
                    seen.seed
                );
                checked += 1;
            }
        }
    });
    assert!(checked > 100);
}

#[test]
fn inv_14_an_allowed_target_correction_is_taken_when_none_is_pending() {
    for bits in [0, reason::STRONG_EVIDENCE] {
        assert_eq!(route(false, Authorisation::Target(bits)), Route::Target);
    }
}

#[test]
fn inv_15_the_route_changes_only_at_a_query_or_by_a_fault() {
    swarms(|seen| {
        let changed = seen.output.command.route != seen.before.route;
        let queried = seen.after.episode().queries() != seen.before.query;
        let fault = seen.output.command.mode != Mode::Normal.code();
        let restarted = seen.told.request != 0 || seen.told.plan.is_some();
        assert!(
            !changed || queried || fault || restarted,
            "seed {}",
            seen.seed
        );
    });
}

const ENDS: u64 = reason::NO_ACTION
    | reason::VALIDITY_LOST
    | reason::PHASE_INCOMPATIBLE
    | reason::BUDGET_EXHAUSTED
    | reason::CORRECTED;

#[test]
fn inv_16_without_an_action_the_base_policy_acts_and_nothing_stays_pending() {
    let mut bottoms = 0;
    swarms(|seen| {
        let Some(record) = &seen.output.trace else {
            return;
        };
        let executes =
            record.route == Route::Pending.code() || record.route == Route::Execution.code();
        if executes && record.reasons & ENDS != 0 {
            assert_eq!(
                record.sub_phase,
                SubPhase::Idle.code(),
                "seed {}",
                seen.seed
            );
            assert!(
                !seen.after.subtask().recovery().is_pending(),
                "seed {}",
                seen.seed
            );
            assert!(
                seen.output.command.flags & Command::FROM_POLICY != 0,
                "seed {}",
                seen.seed
            );
            bottoms += 1;
        }
    });
    assert!(bottoms > 10, "{bottoms}");
}

#[test]
fn inv_17_a_refill_takes_the_prefix_that_the_horizon_allows() {
    let mut refills = 0;
    swarms(|seen| {
        let Some(record) = &seen.output.trace else {
            return;
        };
        if seen.output.command.flags & Command::FROM_POLICY == 0 {
            return;
        }
        let taken = seen.after.queue().len() + 1;
        let horizon = record.effective_horizon as usize;
        assert!(
            taken >= 1 && taken <= horizon,
            "seed {}: {taken} of {horizon}",
            seen.seed
        );
        refills += 1;
    });
    assert!(refills > 500);
}

#[test]
fn inv_17_the_table_of_horizons_is_equation_12() {
    for behaviour in failures() {
        for (open, exec, sent) in [(8, 2, 8), (5, 3, 10), (8, 2, 1), (1, 4, 8)] {
            let mut params = Params::guarded();
            params.chunk.open_loop_steps = open;
            params.horizon.execution_steps = exec;
            let mut run = session(params, &Scene::can_to_plate(), behaviour.clone());
            run.policy.horizon = sent;
            run.run(200);
            for r in &run.queries {
                let armed = open.min(exec);
                let is_correction = r.sub_phase != 0;
                let expected: &[u32] = match (is_correction, r.failure_streak > 0) {
                    (true, _) => &[1],
                    (false, true) if r.target != 0 => &[armed],
                    _ => &[open, armed],
                };
                assert!(
                    expected.contains(&r.effective_horizon),
                    "{open} {exec}: {r:?}"
                );
            }
            assert_played(&run.queries, sent);
        }
    }
}

/// The next query comes after min(H_eff, |A|) policy steps.
fn assert_played(queries: &[TraceRecord], sent: u32) {
    for pair in queries.windows(2) {
        let steps = pair[1].policy_step - pair[0].policy_step;
        let acted = pair[0].base_action[0].is_finite() || pair[0].sub_phase != 0;
        if acted {
            let most = pair[0].effective_horizon.min(sent);
            assert_eq!(steps, u64::from(most), "{:?}", pair[0]);
        }
    }
}

#[test]
fn inv_18_a_pending_correction_emits_one_action_a_query() {
    for behaviour in failures() {
        let mut run = session(Params::guarded(), &Scene::can_to_plate(), behaviour);
        run.run(400);
        let pending = run.queries.windows(2).filter(|p| p[0].sub_phase != 0);
        let mut seen = 0;
        for pair in pending {
            assert_eq!(pair[1].policy_step, pair[0].policy_step + 1);
            assert_eq!(pair[1].query, pair[0].query + 1);
            seen += 1;
        }
        assert!(seen > 10, "{seen}");
    }
}

/// A policy whose actions carry the number of the query and the epoch that
/// they answer, small enough to move nothing.
struct Tagged {
    policy: Policy,
}

const TAG: f32 = 1.0 / 1024.0 / 1024.0;

#[test]
fn inv_19_and_20_no_action_outlives_its_query_or_its_epoch() {
    for (lead, behaviour) in [(0, Behaviour::Frozen), (3, Behaviour::Frozen)] {
        let mut params = Params::guarded();
        params.chunk.query_lead_steps = lead;
        params.recovery.pick_budget = 10;
        params.recovery.place_budget = 10;
        params.gate.cool_down_steps = 4;
        params.recovery.episode_budget = 1000;
        params.gate.activations = 50;
        let scene = Scene::can_to_plate();
        let mut world = scene.world.clone();
        let mut tagged = Tagged {
            policy: Policy::new(behaviour),
        };
        let mut agent = Agent::knowing(&scene);
        let mut controller = Controller::new(params.validate().expect("valid"));
        let (mut corrections, mut base, mut newest_correction) = (0, 0, 0);
        let mut asked_after_correction = 0;
        for n in 0..6000 {
            world.advance(4_000_000);
            let now_ns = world.now_ns();
            let sample = world.sample();
            let chunk = tagged.policy.poll(now_ns).map(|mut chunk| {
                for action in &mut chunk.actions {
                    action[0] = TAG * (chunk.query_id % 4096) as f32;
                    action[1] = TAG * chunk.epoch as f32;
                }
                chunk
            });
            if n % 900 == 899 {
                agent.volunteer(now_ns, scene.target, &scene);
            }
            let grounding = agent.poll(now_ns);
            let input = Input {
                state: Some(&sample),
                chunk: chunk.as_ref(),
                grounding: grounding.as_ref(),
                ..Input::default()
            };
            let before = controller.state().action().map(f64::to_bits);
            let step_before = world.sample().applied_command;
            let output = controller.tick(now_ns, &input);
            let _ = (before, step_before);
            world.apply(&output.command);
            if let Some(query) = &output.query {
                asked_after_correction = asked_after_correction.max(query.query_id);
                tagged.policy.ask(query, &world, &scene);
            }
            if let Some(request) = &output.rebind {
                agent.ask(now_ns, request, &scene);
            }
            if output.command.sub_phase != 0 {
                newest_correction = asked_after_correction;
                corrections += 1;
            } else if output.command.flags & Command::FROM_POLICY != 0
                && output.command.mode < Mode::Hold.code()
            {
                let [tag, epoch, ..] = output.command.action;
                let tag = (tag / f64::from(TAG)).round() as u64;
                assert!(
                    tag > newest_correction,
                    "action of query {tag} after a correction"
                );
                let epoch = (epoch / f64::from(TAG)).round() as u64;
                assert_eq!(epoch, controller.state().subtask().lock().epoch());
                base += 1;
            }
        }
        assert!(corrections > 500 && base > 500, "{corrections} {base}");
    }
}
