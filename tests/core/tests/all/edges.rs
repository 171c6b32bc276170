//! Single functions at the edges of what they take, where no session leads.

mod intake;
mod params;
mod steady;

use fitmac_core::{
    Controller, Params,
    filter::{Commanded, limit_action},
    message::{Input, StateSample},
    recovery::{
        EDGES,
        geometry::levelling,
        is_legal,
        waypoint::{Grip, Motion, recovery_action},
    },
    signals::TargetView,
    wire::{GraspClass, Phase, Route, SubPhase},
};
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene, Session};
use kinematics::rotation::UnitQuaternion;

const EE_M: [f64; 3] = [0.4, 0.0, 0.3];

#[test]
fn a_code_without_a_member_says_of_which_vocabulary() {
    let error = Phase::try_from(200).expect_err("no such phase");
    assert_eq!(error.to_string(), "Phase has no member 200");
}

#[test]
fn only_the_listed_changes_of_a_recoverys_step_are_legal() {
    let all = || SubPhase::ALL.iter().copied();
    let legal = all().flat_map(|from| all().map(move |to| (from, to)));
    let legal: Vec<_> = legal.filter(|&(from, to)| is_legal(from, to)).collect();
    assert_eq!(legal.len(), EDGES.len());
    assert!(EDGES.iter().all(|edge| legal.contains(edge)));
    assert!(!is_legal(SubPhase::Idle, SubPhase::Retreat));
}

#[test]
fn a_commands_bytes_are_read_back() {
    let params = Params::guarded().validate().expect("the profile is valid");
    let mut command = Controller::new(params).tick(0, &Input::default()).command;
    (command.route, command.phase) = (Route::Execution.code(), Phase::Descend.code());
    assert_eq!(command.route(), Some(Route::Execution));
    assert_eq!(command.phase(), Some(Phase::Descend));
    (command.route, command.phase) = (250, 251);
    assert_eq!((command.route(), command.phase()), (None, None));
}

#[test]
fn an_action_with_a_number_that_is_none_stands_still_and_keeps_the_gripper() {
    let params = Params::guarded();
    for gripper in [-1.0, 1.0] {
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for i in 0..7 {
                let mut wanted = [0.5; 7];
                wanted[i] = wrong;
                let out = limit_action(&params.action, &params.filter, EE_M, gripper, &wanted);
                assert!(out.limited);
                assert_eq!(out.value, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, gripper], "{i}");
            }
        }
    }
}

#[test]
fn a_setpoint_that_is_no_number_is_braked_to_a_stand() {
    let limits = Params::guarded().filter;
    let mut now = Commanded {
        position_m: EE_M,
        velocity_m_s: [0.1, 0.0, -0.05],
        acceleration_m_s2: [0.0; 3],
    };
    let wanted = Commanded {
        position_m: [0.4, f64::NAN, 0.3],
        ..now
    };
    for _ in 0..2000 {
        let next = now.step(&limits, &wanted, 1e-3);
        assert!(next.limited);
        now = next.value;
        let numbers = [now.position_m, now.velocity_m_s, now.acceleration_m_s2];
        assert!(numbers.iter().flatten().all(|x| x.is_finite()), "{now:?}");
    }
    for (at, began) in now.position_m.iter().zip(EE_M) {
        assert!((at - began).abs() < 0.05, "{now:?}");
    }
    assert!(now.velocity_m_s.iter().all(|v| v.abs() < 1e-2), "{now:?}");
}

#[test]
fn a_rotation_that_is_no_number_gives_no_action() {
    let params = Params::guarded();
    let mut motion = Motion::to(EE_M, Grip::Close);
    let action = |motion: &Motion| recovery_action(&params.action, &params.filter, EE_M, motion);
    assert!(action(&motion).is_some());
    for i in 0..3 {
        motion.rotation_rad = [0.1; 3];
        motion.rotation_rad[i] = f64::NAN;
        assert_eq!(action(&motion), None, "{i}");
    }
}

#[test]
fn a_waypoint_on_the_edge_of_the_workspace_is_in_it() {
    let params = Params::guarded();
    let edges = params.filter.workspace();
    for axis in 0..3 {
        for (edge, outwards) in edges.iter().zip([-1.0, 1.0]) {
            let goes = |x: f64| {
                let mut waypoint_m = EE_M;
                waypoint_m[axis] = x;
                let motion = Motion::to(waypoint_m, Grip::Open);
                recovery_action(&params.action, &params.filter, EE_M, &motion).is_some()
            };
            assert!(goes(edge[axis]), "{axis} {outwards}");
            assert!(!goes(edge[axis] + outwards * 1e-9), "{axis} {outwards}");
            assert!(!goes(f64::NAN));
        }
    }
}

/// The turn about the vertical towards a box of these half extents, yawed by `yaw_rad` against a
/// hand that points straight down.
fn turn(half_extent_m: [f64; 3], yaw_rad: f64) -> f64 {
    let mut params = Params::guarded();
    params.recovery.align_yaw_rad = 0.05;
    let target = TargetView {
        id: 1,
        position_m: [0.4, 0.0, 0.03],
        orientation: UnitQuaternion::from_rotation_vector([0.0, 0.0, yaw_rad]),
        half_extent_m,
        half_height_m: half_extent_m[2],
        depth_m: half_extent_m[2],
        class: GraspClass::Box,
        distance_m: 0.2,
        distance_xy_m: 0.0,
        height_m: 0.2,
    };
    let sample = StateSample {
        ee_orientation: [0.0, 1.0, 0.0, 0.0],
        ..StateSample::default()
    };
    let [x, y, z] = levelling(&params, &sample, &target, false);
    assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "it is level: {x} {y}");
    z
}

#[test]
fn the_hand_turns_to_the_nearest_side_that_fits_between_the_fingers() {
    let (narrow, wide) = (0.02, 0.06);
    for yaw in [-0.7, -0.3, 0.1, 0.3, 0.7] {
        // A cube: the nearest of its two sides, never more than an eighth of a turn.
        let cube = turn([narrow, narrow, 0.03], yaw);
        assert!((cube - yaw).abs() < 1e-9, "{yaw}: {cube}");
        // Fingers close along y: a box that is narrow along y is turned with, one that is narrow
        // along x needs a quarter of a turn more.
        let along_y = turn([wide, narrow, 0.03], yaw);
        assert!((along_y - yaw).abs() < 1e-9, "{yaw}: {along_y}");
        let along_x = turn([narrow, wide, 0.03], yaw);
        let quarter = core::f64::consts::FRAC_PI_2;
        assert!(
            ((along_x - yaw).abs() - quarter).abs() < 1e-9,
            "{yaw}: {along_x}"
        );
        assert!(along_x.abs() <= quarter, "{yaw}: {along_x}");
        // What fits nowhere is left as it is.
        assert_eq!(turn([wide, wide, 0.03], yaw), 0.0);
    }
    // Beyond an eighth of a turn the cube's other side is nearer.
    let beyond = turn([narrow, narrow, 0.03], 1.0);
    assert!(
        (beyond - (1.0 - core::f64::consts::FRAC_PI_2)).abs() < 1e-9,
        "{beyond}"
    );
}

#[test]
fn above_the_middle_of_a_bowl_its_rim_is_a_radius_away() {
    let mut scene = Scene::bowl_to_plate();
    let [x, y, _] = scene.world.ee_m();
    let bowl = scene.target;
    let rim_m = scene.world.body_mut(bowl).map(|body| {
        body.position_m[0] = x;
        body.position_m[1] = y;
        body.half_extent_m[0]
    });
    let agent = Agent::knowing(&scene);
    let policy = Policy::new(Behaviour::Frozen);
    let mut session = Session::new(Params::guarded(), scene, policy, agent);
    let mut seen = None;
    session.run_until(40, |s| {
        let signals = s.controller.state().subtask().signals();
        seen = signals.and_then(|signals| signals.target);
        seen.is_some()
    });
    let target = seen.expect("it is seen");
    let rim_m = rim_m.expect("it is there");
    assert!(target.distance_xy_m > 0.5 * rim_m, "{target:?}");
    assert!(target.distance_xy_m <= rim_m, "{target:?}");
}
