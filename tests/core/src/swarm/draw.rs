//! What a seed decides at the start of a run.

use std::collections::VecDeque;

use fitmac_core::{
    Params, ValidParams,
    message::ObjectId,
    params::{OutOfRange, PolicyGripper, Switches, WhileRebinding},
    wire::{DestinationKind, Provenance},
};
use kinematics::rotation::UnitQuaternion;
use rand::{RngExt, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

use crate::world::{Agent, Answer, BASKET, BOWL, BOX, Behaviour, CAN, OTHER, Policy, Scene, World};

/// How often each fault happens in a tick; most are off in a given run.
#[derive(Clone, Debug, Default)]
pub(super) struct Rates {
    pub(super) gap: f64,
    pub(super) leap: f64,
    pub(super) backwards: f64,
    pub(super) same_time: f64,
    pub(super) hide: f64,
    pub(super) show: f64,
    pub(super) push: f64,
    pub(super) slip: f64,
    pub(super) weak_grasp: f64,
    pub(super) deaf: f64,
    pub(super) restart_policy: f64,
    pub(super) new_behaviour: f64,
    pub(super) volunteer: f64,
    pub(super) other_kappa: f64,
    pub(super) freeze_state: f64,
    pub(super) lose_state: f64,
    pub(super) pose_noise_m: f64,
    pub(super) new_plan: f64,
    pub(super) verifier: f64,
    pub(super) verifier_lies: f64,
    pub(super) critic: f64,
    pub(super) reset: f64,
    pub(super) episode_ends: f64,
    pub(super) episode_ends_done: f64,
    pub(super) stop: f64,
    pub(super) unknown_request: f64,
    pub(super) bad_state: f64,
    pub(super) bad_chunk: f64,
    pub(super) bad_grounding: f64,
    pub(super) bad_plan: f64,
    pub(super) lose_chunk: f64,
    pub(super) lose_grounding: f64,
    pub(super) repeat: f64,
    pub(super) repeat_state: f64,
}

impl Rates {
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        // A run with every fault on gets nowhere: each has its own coin.
        let share = *[0.0, 0.1, 0.3, 0.6].choose(rng).unwrap_or(&0.1);
        let mut rate = |most: f64| {
            if rng.random_bool(share) {
                most * rng.random::<f64>()
            } else {
                0.0
            }
        };
        let hide = rate(0.003);
        Self {
            gap: rate(0.003),
            leap: rate(0.0003),
            backwards: rate(0.003),
            same_time: rate(0.02),
            hide,
            show: if hide > 0.0 { 0.02 } else { 0.0 },
            push: rate(0.003),
            slip: rate(0.005),
            weak_grasp: rate(0.003),
            deaf: rate(0.0005),
            restart_policy: rate(0.002),
            new_behaviour: rate(0.005),
            volunteer: rate(0.005),
            other_kappa: rate(0.01),
            freeze_state: rate(0.002),
            lose_state: rate(0.2),
            pose_noise_m: rate(0.004),
            new_plan: rate(0.0005),
            verifier: rate(0.2),
            verifier_lies: rate(0.002),
            critic: rate(0.05),
            reset: rate(0.0005),
            episode_ends: 0.0007,
            episode_ends_done: 0.02,
            stop: rate(0.0005),
            unknown_request: rate(0.01),
            bad_state: rate(0.02),
            bad_chunk: rate(0.3),
            bad_grounding: rate(0.3),
            bad_plan: rate(0.5),
            lose_chunk: rate(0.1),
            lose_grounding: rate(0.3),
            repeat: rate(0.05),
            repeat_state: rate(0.3),
        }
    }
}

fn one_of<T: Copy>(rng: &mut ChaCha8Rng, choices: &[T], or: T) -> T {
    choices.choose(rng).copied().unwrap_or(or)
}

/// Most draws until a set of parameters holds together.
const DRAWS: u32 = 1000;

/// Parameters around one of the profiles.
pub(super) fn params(rng: &mut ChaCha8Rng) -> ValidParams {
    (0..DRAWS)
        .find_map(|_| any_params(rng).validate().ok())
        .expect("a profile with some of its parameters changed is valid")
}

fn any_params(rng: &mut ChaCha8Rng) -> Params {
    let mut p = if rng.random_bool(0.5) {
        Params::guarded()
    } else {
        Params::paper()
    };
    p.clock.step_ms = one_of(rng, &[10, 20, 50], 50);
    p.clock.settle_steps = one_of(rng, &[0, 1, 10], 10);
    p.chunk.open_loop_steps = one_of(rng, &[1, 2, 5, 8, 12], 8);
    p.chunk.query_lead_steps = one_of(rng, &[0, 0, 0, 1, 3], 0);
    p.chunk.hold_after_ms = one_of(rng, &[100, 1000], 1000);
    p.chunk.stop_after_ms = one_of(rng, &[2000, 10_000], 10_000);
    p.horizon.execution_steps = one_of(rng, &[1, 2, 3, 4], 2);
    p.gate.failure_streak = one_of(rng, &[1, 2, 3, 4], 3);
    p.gate.confidence_streak = one_of(rng, &[1, 2, 4], 2);
    p.gate.rescue_min_step = one_of(rng, &[0, 8, 12, 16], 12);
    p.gate.progress_guard_steps = one_of(rng, &[0, 4, 8], 8);
    p.gate.cool_down_steps = one_of(rng, &[0, 4, 16], 16);
    p.gate.activations = one_of(rng, &[0, 1, 2, 10], 2);
    if rng.random_bool(0.3) {
        p.recovery.pick_budget = one_of(rng, &[1, 3, 20, 40], 40);
        p.recovery.place_budget = one_of(rng, &[1, 3, 20, 40], 40);
        p.recovery.episode_budget = one_of(rng, &[5, 50, 200], 200);
    }
    if rng.random_bool(0.3) {
        p.recovery.redescents = one_of(rng, &[0, 1], 1);
        p.recovery.settle = one_of(rng, &[0, 3], 3);
        p.recovery.verify = one_of(rng, &[0, 5], 5);
        p.lock.rebinds = one_of(rng, &[0, 1, 5], 1);
        p.lock.rebind_wait_ms = one_of(rng, &[0, 100], 100);
        p.tracking.gain = one_of(rng, &[0.2, 0.5, 1.0], 0.5);
    }
    if rng.random_bool(0.3) {
        let shorter = |steps: &mut u32| *steps = (*steps / 2).max(1);
        shorter(&mut p.patience.approach_steps);
        shorter(&mut p.patience.transport_steps);
        shorter(&mut p.timeout.approach_steps);
        shorter(&mut p.timeout.grasp_steps);
        shorter(&mut p.timeout.transport_steps);
    }
    if rng.random_bool(0.5) {
        p.while_rebinding = one_of(
            rng,
            &[WhileRebinding::Hold, WhileRebinding::BaseActs],
            WhileRebinding::Hold,
        );
        p.out_of_range = one_of(
            rng,
            &[OutOfRange::Clamp, OutOfRange::Refuse],
            OutOfRange::Clamp,
        );
    }
    if rng.random_bool(0.1) {
        p.policy_gripper = PolicyGripper::OneOpen;
    }
    if rng.random_bool(0.25) {
        let mut coin = || rng.random_bool(0.5);
        p.switches = Switches {
            target_corrector: coin(),
            execution_corrector: coin(),
            hard_pick: coin(),
            hard_place: coin(),
        };
    }
    p
}

/// What the agents will say.
pub(super) fn answers(rng: &mut ChaCha8Rng, scene: &Scene) -> VecDeque<Answer> {
    let mut answers = VecDeque::new();
    if rng.random_bool(0.85) {
        answers.push_back(Answer::Target {
            id: scene.target,
            kappa: rng.random_range(0.5..=1.0),
            provenance: one_of(
                rng,
                &[Provenance::Rules, Provenance::Resolver],
                Provenance::Rules,
            ),
        });
    }
    for _ in 0..rng.random_range(1..4) {
        answers.push_back(answer(rng, scene));
    }
    answers
}

/// A scene whose arm and fingers fit the policy step.
pub(super) fn scene(rng: &mut ChaCha8Rng, step_ms: u32) -> Scene {
    let mut scene = match rng.random_range(0..4) {
        0 => Scene::can_to_plate(),
        1 => Scene::bowl_to_plate(),
        2 => Scene::box_to_plate(),
        _ => Scene::can_to_basket(),
    };
    let faster = f64::from(step_ms) / 50.0;
    scene.world.plant.lag_s = faster * one_of(rng, &[0.05, 0.10, 0.16], 0.16);
    scene.world.plant.finger_m_s /= faster;
    if rng.random_bool(0.2) {
        scene.world.plant.weak_grasps = rng.random_range(1..5);
    }
    if rng.random_bool(0.1) {
        scene.world.plant.reach_m = rng.random_range(0.45..0.6);
    }
    if rng.random_bool(0.2) {
        let turn = [(); 3].map(|()| 0.3 * (rng.random::<f64>() - 0.5));
        let turned = UnitQuaternion::from_rotation_vector(turn) * scene.world.orientation();
        scene.world.set_orientation(turned);
    }
    for body in &mut scene.world.bodies {
        let by = xy(rng, 0.05);
        body.position_m[0] += by[0];
        body.position_m[1] += by[1];
    }
    scene
}

pub(super) fn behaviour(rng: &mut ChaCha8Rng) -> Behaviour {
    match rng.random_range(0..8) {
        0 => Behaviour::Competent,
        2 => Behaviour::WrongObject(OTHER),
        3 => Behaviour::StallsAbove(rng.random_range(0.0..0.2)),
        4 => Behaviour::MissesPlace(xy(rng, 0.2)),
        5 => Behaviour::Dithers,
        6 => Behaviour::Replays(xy(rng, 0.15)),
        _ => Behaviour::Frozen,
    }
}

pub(super) fn policy(rng: &mut ChaCha8Rng, params: &Params) -> Policy {
    let mut policy = Policy::new(behaviour(rng));
    policy.step_ms = params.clock.step_ms;
    policy.gripper = params.policy_gripper.convention();
    policy.horizon = one_of(rng, &[1, 4, 8, 10, 16], 8);
    policy.delay_ns = one_of(
        rng,
        &[0, 0, 5_000_000, 5_000_000, 60_000_000, 300_000_000],
        0,
    );
    policy.speed = one_of(rng, &[0.3, 0.7, 1.0], 1.0);
    policy
}

pub(super) fn agent(rng: &mut ChaCha8Rng, scene: &Scene) -> Agent {
    let answers = answers(rng, scene);
    let mut agent = Agent::new(answers);
    agent.delay_ns = one_of(rng, &[0, 0, 20_000_000, 20_000_000, 400_000_000], 0);
    if rng.random_bool(0.05) {
        agent.delay_ns = 3_000_000_000;
    }
    if rng.random_bool(0.2) {
        agent.destination = one_of(rng, DestinationKind::ALL, DestinationKind::Direct);
    }
    agent
}

fn answer(rng: &mut ChaCha8Rng, scene: &Scene) -> Answer {
    if rng.random_bool(0.1) {
        return Answer::Silence;
    }
    let id = if rng.random_bool(0.7) {
        scene.target
    } else {
        one_of(rng, &[0, OTHER, CAN, BOWL], OTHER)
    };
    Answer::Target {
        id,
        kappa: kappa(rng),
        provenance: one_of(rng, Provenance::ALL, Provenance::Rules),
    }
}

/// A confidence, mostly plausible.
pub(super) fn kappa(rng: &mut ChaCha8Rng) -> f64 {
    match rng.random_range(0..8) {
        0 => one_of(rng, &[0.0, 0.1, 0.11, 0.12, 0.13, 0.29, 0.3], 0.0),
        1 => one_of(rng, &[f64::NAN, -0.5, 1.5, f64::INFINITY, -0.0], 0.0),
        _ => rng.random_range(0.3..=1.0),
    }
}

pub(super) fn plan_confidence(rng: &mut ChaCha8Rng) -> u32 {
    one_of(rng, &[1000, 1000, 1000, 800, 500, 499, 100], 1000)
}

/// A tick that divides the policy step or not.
pub(super) fn tick_ns(rng: &mut ChaCha8Rng, step_ms: u32) -> u64 {
    let step_ns = u64::from(step_ms) * 1_000_000;
    one_of(
        rng,
        &[step_ns, step_ns / 2, step_ns / 2, step_ns / 5, 3_000_000],
        step_ns / 2,
    )
}

/// An object of the world.
pub(super) fn thing(rng: &mut ChaCha8Rng, world: &World) -> ObjectId {
    let ids: Vec<ObjectId> = world.bodies.iter().map(|b| b.id).collect();
    let or = one_of(rng, &[CAN, OTHER, BOX, BASKET], CAN);
    one_of(rng, &ids, or)
}

/// A vector in a square of this half side, m.
pub(super) fn xy(rng: &mut ChaCha8Rng, half_m: f64) -> [f64; 2] {
    [(); 2].map(|()| rng.random_range(-half_m..=half_m))
}

/// Nearly a standard normal number.
pub(super) fn gauss(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}
