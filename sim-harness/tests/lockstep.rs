//! The whole loop in one process: deterministic, transparent when nothing is wrong, and of use
//! when something is.

use fitmac_core::message::Command;
use fitmac_core::params::{Params, Switches};
use fitmac_core::wire::Route;
use sim_harness::agents::OracleAgents;
use sim_harness::backbone::Registry;
use sim_harness::lockstep::{Lockstep, Outcome, Setup};
use sim_harness::perception::{PerceptionParams, PoseSource};
use sim_harness::sim::Sim;
use sim_harness::suite::Suite;

fn setup(seed: u64, swapped: bool, switches: Switches, pose_source: PoseSource) -> Setup {
    let suite = Suite::embedded("object").unwrap();
    let task = suite.task("alphabet_soup").unwrap();
    let mut scene = suite.sample_scene(task, seed).unwrap();
    if swapped {
        scene
            .swap_places(&task.target, task.pos.with.as_ref().unwrap())
            .unwrap();
    }
    let goal = task.goal(&scene).unwrap();
    let registry = Registry::embedded().unwrap();
    Setup {
        sim: Sim::new(scene).unwrap(),
        goal,
        instruction: task.instruction.clone(),
        backbone: registry.build("openvla-like", &suite).unwrap(),
        agents: Box::new(OracleAgents::new(goal)),
        params: Params {
            switches,
            ..Params::guarded()
        }
        .validate()
        .unwrap(),
        pose_source,
        seed,
        max_steps: u64::from(suite.max_steps) + 10,
    }
}

struct Run {
    outcome: Outcome,
    interventions: usize,
    /// Every command that started an action, as text: a NaN equals itself there.
    actions: Vec<String>,
    from_policy: bool,
}

fn run(setup: Setup) -> Run {
    let mut actions = Vec::new();
    let (mut interventions, mut from_policy) = (0, true);
    let mut settled = false;
    let outcome = Lockstep::new(setup)
        .run(|_, ticked| {
            let Some(command) = ticked.command.filter(|_| ticked.acted) else {
                return;
            };
            let corrects = [Route::Execution.code(), Route::Pending.code()];
            interventions += usize::from(corrects.contains(&command.route));
            let ours = command.flags & Command::FROM_POLICY != 0;
            settled |= ours;
            from_policy &= ours || !settled;
            actions.push(format!(
                "{:?}",
                (command.policy_step, command.action, command.route)
            ));
        })
        .unwrap();
    Run {
        outcome,
        interventions,
        actions,
        from_policy,
    }
}

#[test]
fn the_same_seed_gives_the_same_episode() {
    let modelled = || PoseSource::Modelled(PerceptionParams::embedded().unwrap());
    let first = run(setup(1003, true, Switches::FULL, modelled()));
    let second = run(setup(1003, true, Switches::FULL, modelled()));
    assert_eq!(first.actions, second.actions);
    assert!(first.interventions > 0, "a dull episode shows nothing");
    let other = run(setup(1004, true, Switches::FULL, modelled()));
    assert_ne!(first.actions, other.actions);
}

#[test]
fn a_displaced_target_is_lost_on_the_policy_and_saved_by_the_controller() {
    let alone = run(setup(
        1001,
        true,
        Switches::BACKBONE_ONLY,
        PoseSource::Truth,
    ));
    assert_ne!(alone.outcome, Outcome::Success);
    assert!(
        alone.from_policy,
        "with nothing switched on only the policy acts"
    );
    let together = run(setup(1001, true, Switches::FULL, PoseSource::Truth));
    assert_eq!(together.outcome, Outcome::Success);
    assert!(together.interventions > 0);
}

#[test]
fn where_the_policy_succeeds_nothing_is_changed() {
    let alone = run(setup(
        1002,
        false,
        Switches::BACKBONE_ONLY,
        PoseSource::Truth,
    ));
    let together = run(setup(1002, false, Switches::FULL, PoseSource::Truth));
    assert_eq!(alone.outcome, Outcome::Success);
    assert_eq!(together.outcome, Outcome::Success);
    assert_eq!(together.interventions, 0);
    assert!(together.from_policy);
}
