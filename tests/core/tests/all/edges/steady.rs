//! A robot that does not move and a policy that wants one thing: where the setpoint goes, where it
//! stops, what is said of it, and what is taken for closed fingers.

use core::mem::replace;

use fitmac_core::{
    Controller, Params,
    message::{Action, ActionChunk, CHUNK_CAPACITY, Command, Input, StateSample},
    params::Switches,
    reason,
    signals::GripperState,
    wire::{ActionFrame, ActionSpace, GripperConvention, Mode, Request},
};
use kinematics::{
    otg::{self, Limits, Otg, State, Target},
    rotation::UnitQuaternion,
    vector::{self, Vector3},
};

const TICK_NS: u64 = 4_000_000;
const EE_M: [f64; 3] = [0.5, 0.0, 0.25];
/// Forwards, and about the vertical.
const ACTION: Action = [0.5, -0.25, 0.0, 0.0, 0.0, 0.5, -1.0];

/// A robot that does not move, and a policy that wants one action again and again.
struct Stand {
    controller: Controller,
    sample: StateSample,
    silent: bool,
    action: Action,
    chunk: Option<ActionChunk>,
}

impl Stand {
    fn new(mut params: Params, action: Action) -> Self {
        params.switches = Switches::BACKBONE_ONLY;
        params.clock.settle_steps = 0;
        params.chunk.frozen_chunks = 1000;
        Self {
            controller: Controller::new(params.validate().expect("they are valid")),
            sample: StateSample {
                session: 1,
                ee_position_m: EE_M,
                gripper_width_m: 0.08,
                ..StateSample::default()
            },
            silent: false,
            action,
            chunk: None,
        }
    }

    fn tick(&mut self, request: Option<Request>) -> Command {
        self.sample.sequence += 1;
        self.sample.stamp_ns += TICK_NS;
        let now_ns = self.sample.stamp_ns;
        let chunk = self.chunk.take();
        let input = Input {
            state: (!self.silent).then_some(&self.sample),
            chunk: chunk.as_ref(),
            request: request.map_or(0, Request::code),
            ..Input::default()
        };
        let output = self.controller.tick(now_ns, &input);
        self.sample.applied_command = output.command.sequence;
        self.chunk = output.query.map(|query| ActionChunk {
            sequence: query.query_id,
            session: 1,
            observation_ns: now_ns,
            stamp_ns: now_ns,
            query_id: query.query_id,
            epoch: query.epoch,
            subtask: query.subtask,
            prompt_id: query.prompt_id,
            horizon: 8,
            action_space: ActionSpace::OscPoseDelta.code(),
            frame: ActionFrame::Base.code(),
            gripper: GripperConvention::MinusOneOpen.code(),
            actions: [self.action.map(|x| x as f32); CHUNK_CAPACITY],
            ..ActionChunk::default()
        });
        output.command
    }

    /// Ticks until the setpoint moves in every way that it is asked to.
    fn run_until_it_moves(&mut self) -> Command {
        for _ in 0..100 {
            let command = self.tick(None);
            if vector::norm(command.setpoint_velocity_m_s) > 0.01 && turned_rad(&command) > 0.001 {
                return command;
            }
        }
        panic!("it never moved");
    }
}

fn turned_rad(command: &Command) -> f64 {
    let orientation = UnitQuaternion::from_wxyz(command.setpoint_orientation).expect("a rotation");
    vector::norm(orientation.to_rotation_vector())
}

#[test]
fn it_arrives_where_the_action_points() {
    let params = Params::guarded();
    let mut stand = Stand::new(params, ACTION);
    let mut last = stand.tick(None);
    for _ in 0..400 {
        last = stand.tick(None);
    }
    assert_eq!(last.mode(), Some(Mode::Normal));
    let step_m = params.action.translation_m;
    for axis in 0..3 {
        let goal_m = EE_M[axis] + ACTION[axis] * step_m;
        let miss_m = (last.setpoint_position_m[axis] - goal_m).abs();
        assert!(miss_m < 1e-9, "{axis}: {miss_m} m");
    }
    let miss_rad = (turned_rad(&last) - 0.5 * params.action.rotation_rad).abs();
    assert!(miss_rad < 1e-9, "{miss_rad} rad");
}

#[test]
fn a_stop_brakes_from_its_first_tick_as_hard_as_the_limits_allow_and_then_stays() {
    let mut params = Params::guarded();
    params.state.hold_age_ms = 5;
    let p = params.shaping;
    let limits = Limits {
        velocity: [p.velocity_m_s; 3],
        acceleration: [p.acceleration_m_s2; 3],
        jerk: [p.jerk_m_s3; 3],
    };
    let braking = otg::Input {
        target: Target::Stop,
        limits,
    };
    let goal_rad = 0.5 * params.action.rotation_rad;
    for least in [Mode::Hold, Mode::Stop] {
        let mut stand = Stand::new(params, ACTION);
        let mut before = stand.run_until_it_moves();
        // No news of the robot leads to a hold, a request to a stop.
        stand.silent = least == Mode::Hold;
        let mut last = stand.tick((least == Mode::Stop).then_some(Request::Stop));
        for _ in 0..10 {
            if last.mode() < Some(least) {
                before = replace(&mut last, stand.tick(None));
            }
        }
        let mut oracle = Otg::new(State {
            position: before.setpoint_position_m,
            velocity: before.setpoint_velocity_m_s,
            acceleration: before.setpoint_acceleration_m_s2,
        });
        for n in 0..60 {
            let expected = oracle.update(&braking, 1e-9 * TICK_NS as f64).state;
            assert_eq!(last.setpoint_position_m, expected.position, "tick {n}");
            assert_eq!(last.setpoint_velocity_m_s, expected.velocity, "tick {n}");
            assert_eq!(last.mode(), Some(least));
            last = stand.tick(None);
        }
        assert_eq!(last.setpoint_velocity_m_s, [0.0; 3]);
        let rest_rad = turned_rad(&last);
        assert!(rest_rad >= turned_rad(&before), "{least:?}");
        assert!(rest_rad < 0.9 * goal_rad, "{least:?}: {rest_rad} rad");
    }
}

#[test]
fn a_hand_outside_the_workspace_stays_or_comes_back_as_it_is_asked() {
    let mut params = Params::guarded();
    params.filter.workspace_max_x_m = EE_M[0] - 0.1;
    for x in [1.0, 0.0, -1.0] {
        let mut stand = Stand::new(params, [x, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
        let mut last = stand.tick(None);
        for n in 0..200 {
            let before = last;
            last = stand.tick(None);
            let moved_m = last.setpoint_position_m[0] - before.setpoint_position_m[0];
            assert!(moved_m <= 0.0, "{x}, tick {n}: {moved_m} m further out");
            // The wish to go out is cut, and it is said so.
            let cut = last.policy_step > 0 && x > 0.0;
            assert_eq!(last.flags & Command::LIMITED != 0, cut, "{x}, tick {n}");
            assert_eq!(last.reasons & reason::LIMITED != 0, cut, "{x}, tick {n}");
        }
        assert_eq!(last.action[0], x.min(0.0));
        let goal_m = EE_M[0] + x.min(0.0) * params.action.translation_m;
        assert!((last.setpoint_position_m[0] - goal_m).abs() < 1e-9, "{x}");
    }
}

#[test]
fn only_a_command_beyond_the_middle_closes_fingers_that_stand_wide() {
    let state = |grip: f64| {
        let mut stand = Stand::new(Params::guarded(), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, grip]);
        stand.sample.gripper_width_m = 0.07;
        for _ in 0..100 {
            stand.tick(None);
        }
        let signals = stand.controller.state().subtask().signals().copied();
        signals.map(|s| s.gripper.state)
    };
    assert_eq!(state(-1.0), Some(GripperState::Open));
    assert_eq!(state(0.0), Some(GripperState::Open));
    assert_eq!(state(1.0), Some(GripperState::Holding));
}

/// The hand follows at once, and turns as this action says, again and again.
fn turning(action: Action, ticks: usize) -> Vec<Vector3> {
    let mut stand = Stand::new(Params::guarded(), action);
    let mut last = UnitQuaternion::IDENTITY;
    let mut velocities = Vec::new();
    for _ in 0..ticks {
        let command = stand.tick(None);
        stand.sample.ee_orientation = command.setpoint_orientation;
        let now = UnitQuaternion::from_wxyz(command.setpoint_orientation).expect("a rotation");
        let turned = (now * last.inverse()).to_rotation_vector();
        velocities.push(vector::scale(turned, 1e9 / TICK_NS as f64));
        last = now;
    }
    velocities
}

#[test]
fn a_hand_may_turn_on_and_on() {
    for action in [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.4, -1.0],
        [0.0, 0.0, 0.0, 0.3, -0.2, 0.2, -1.0],
    ] {
        let velocities = turning(action, 2000);
        let [.., rx, ry, rz, _] = action;
        let axis = vector::scale([rx, ry, rz], 1.0 / vector::norm([rx, ry, rz]));
        let (begun, rest) = velocities.split_at(100);
        assert!(begun.iter().all(|v| vector::dot(*v, axis) > -1e-9));
        // Several turns, never slower than half of what it came to, and about the same axis.
        let speed = vector::norm(rest[0]);
        for (n, v) in rest.iter().enumerate() {
            let along = vector::dot(*v, axis);
            assert!(along > 0.5 * speed, "{n}: {along} of {speed} rad/s");
            assert!(vector::norm(*v) - along < 0.02 * speed, "{n}: {v:?}");
        }
        assert!(speed * 8.0 > 2.0 * core::f64::consts::TAU, "{speed}");
    }
}

#[test]
fn its_rotation_keeps_its_limits_through_every_change_of_goal() {
    let p = Params::guarded().shaping;
    let dt_s = 1e-9 * TICK_NS as f64;
    let mut stand = Stand::new(Params::guarded(), ACTION);
    let mut last = UnitQuaternion::IDENTITY;
    let mut velocities: Vec<Vector3> = Vec::new();
    for n in 0..1500_i32 {
        // A new axis every time, and a rest now and then.
        let phase = 0.7 * f64::from(n / 25);
        let size = if n % 200 < 150 { 0.6 } else { 0.0 };
        let turn = [phase.sin(), phase.cos(), (2.3 * phase).sin()].map(|x| size * x);
        stand.action[3..6].copy_from_slice(&turn);
        let command = stand.tick(None);
        stand.sample.ee_orientation = command.setpoint_orientation;
        let now = UnitQuaternion::from_wxyz(command.setpoint_orientation).expect("a rotation");
        let turned = (now * last.inverse()).to_rotation_vector();
        velocities.push(vector::scale(turned, 1.0 / dt_s));
        last = now;
    }
    // Limits are an axis each; differences of samples and the bend of the path blur them.
    let change = |two: &[Vector3]| vector::scale(vector::sub(two[1], two[0]), 1.0 / dt_s);
    let accelerations: Vec<Vector3> = velocities.windows(2).map(change).collect();
    let jerks: Vec<Vector3> = accelerations.windows(2).map(change).collect();
    let greatest = |all: &[Vector3]| all.iter().flatten().fold(0.0_f64, |a, x| a.max(x.abs()));
    assert!(greatest(&velocities) <= 1.02 * p.angular_velocity_rad_s);
    assert!(greatest(&accelerations) <= 1.1 * p.angular_acceleration_rad_s2);
    assert!(greatest(&jerks) <= 1.1 * p.angular_jerk_rad_s3);
}
