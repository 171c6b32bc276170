//! C. The gate, in the loop. Its tables are enumerated in the core's own
//! tests, beside the code.

use fitmac_core::{
    Controller, Params, evidence,
    message::CriticReport,
    wire::{CriticLabel, Provenance, Route},
};
use fitmac_core_tests::{
    swarm::Swarm,
    world::{Agent, Answer, Behaviour, Scene},
};

use super::stand::{SEEDS, failures, session, swarms};

#[test]
fn inv_23_a_streak_grows_by_one_a_query_of_the_same_kind() {
    let mut last: Option<(u64, u64, u8)> = None;
    swarms(|seen| {
        let queries = seen.after.episode().queries();
        let streak = seen.after.subtask().streaks().failures();
        if let Some((seed, before, was)) = last
            && seed == seen.seed
        {
            match queries.checked_sub(before) {
                Some(0) => assert!(streak == was || streak == 0, "seed {}", seen.seed),
                Some(1) => assert!(
                    streak == was.saturating_add(1) || streak <= 1,
                    "seed {}: {was} to {streak}",
                    seen.seed
                ),
                _ => {}
            }
        }
        last = Some((seen.seed, queries, streak));
    });
}

#[test]
fn inv_30_a_confidence_that_is_none_is_zero() {
    for kappa in [f64::NAN, f64::INFINITY, -0.1, 1.1, 1e300] {
        let scene = Scene::can_to_plate();
        let agent = Agent::new([Answer::Target {
            id: scene.target,
            kappa,
            provenance: Provenance::Resolver,
        }]);
        let mut run = session(Params::guarded(), &scene, Behaviour::Frozen);
        run.agent = agent;
        run.run(60);
        let bound: Vec<_> = run.queries.iter().filter(|r| r.epoch > 0).collect();
        assert!(!bound.is_empty());
        for r in bound {
            assert_eq!(r.kappa, 0.0, "{kappa}");
            assert_ne!(r.route, Route::Execution.code());
        }
    }
}

#[test]
fn inv_30_the_critic_alone_moves_nothing() {
    let mut heard = 0;
    for seed in SEEDS {
        let mut swarm = Swarm::new(seed);
        let mut quiet = Controller::new(swarm.params);
        let mut told_all = quiet.clone();
        for n in 0..600 {
            let mut told = swarm.tick();
            told.critic = None;
            let output = quiet.tick(told.now_ns, &told.input());
            // A report as sure as can be, in every tick.
            told.critic = Some(CriticReport {
                sequence: n + 1,
                label: CriticLabel::ALL[n as usize % CriticLabel::ALL.len()].code(),
                confidence: 7.0,
                ..CriticReport::default()
            });
            let critical = told_all.tick(told.now_ns, &told.input());
            assert_eq!(critical.command, output.command, "seed {seed}, tick {n}");
            let noted = evidence::CRITIC_TARGET | evidence::CRITIC_EXECUTION;
            heard += u32::from(critical.trace.is_some_and(|r| r.evidence & noted != 0));
            swarm.hear(&output);
        }
    }
    assert!(heard > 100, "it is noted in the trace: {heard}");
}

/// Queries until the gate first opens for an execution correction.
fn first_opening(params: Params, behaviour: Behaviour) -> Option<u64> {
    let mut run = session(params, &Scene::can_to_plate(), behaviour);
    run.run(300);
    run.queries
        .iter()
        .find(|r| r.route == Route::Execution.code())
        .map(|r| r.policy_step)
}

#[test]
fn inv_32_a_lower_threshold_opens_no_later() {
    for behaviour in failures() {
        let mut last = None;
        for n in 1..=5 {
            let mut params = Params::guarded();
            params.gate.failure_streak = n;
            // A streak changes how often is asked: keep that out of it.
            params.horizon.execution_steps = params.chunk.open_loop_steps;
            let step = first_opening(params, behaviour.clone()).expect("it opens");
            assert!(last.is_none_or(|l| l <= step), "{behaviour:?} {n}");
            last = Some(step);
        }
    }
}

#[test]
fn inv_24_streaks_saturate_in_the_loop() {
    let mut params = Params::guarded();
    params.switches.execution_corrector = false;
    let mut run = session(params, &Scene::can_to_plate(), Behaviour::Frozen);
    run.run(1200);
    let last = run.queries.last().expect("some");
    assert_eq!((last.failure_streak, last.confidence_streak), (255, 255));
}
