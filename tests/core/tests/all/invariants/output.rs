//! A. What leaves the core is safe, in every tick.

use fitmac_core::{
    Controller, Params,
    message::{ActionChunk, Command, Input},
    params::{ActionScale, OutOfRange, Switches},
    reason,
    recovery::waypoint::recovery_translation,
    wire::{Mode, Route, SubPhase},
};
use fitmac_core_tests::world::{Agent, Behaviour, Policy, Scene};
use kinematics::rotation::UnitQuaternion;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::stand::{bits, failures, run_to_correction, session, swarms};

fn all_finite(c: &Command) -> bool {
    c.action
        .iter()
        .chain(&c.setpoint_position_m)
        .chain(&c.setpoint_velocity_m_s)
        .chain(&c.setpoint_acceleration_m_s2)
        .chain(&c.setpoint_orientation)
        .all(|x| x.is_finite())
}

#[test]
fn inv_01_every_output_is_finite_whatever_the_input() {
    swarms(|seen| assert!(all_finite(&seen.output.command), "seed {}", seen.seed));
}

#[test]
fn inv_01_no_bit_pattern_of_a_message_gets_through() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let scene = Scene::can_to_plate();
    let mut running = session(Params::guarded(), &scene, Behaviour::Frozen);
    run_to_correction(&mut running);
    let before = running.controller.clone();
    for lane in 0..61 {
        for pattern in 0..40 {
            let odd = f64::from_bits(rng.random());
            let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, odd][pattern % 4];
            let mut world = running.world.clone();
            world.advance(50_000_000);
            let mut sample = world.sample();
            let object = &mut sample.objects[lane % 3];
            match lane {
                0..3 => sample.ee_position_m[lane] = odd,
                3..7 => sample.ee_orientation[lane - 3] = odd,
                7..10 => sample.ee_velocity_m_s[lane - 7] = odd,
                10..17 => sample.joint_position_rad[lane - 10] = odd,
                17..24 => sample.joint_velocity_rad_s[lane - 17] = odd,
                24 => sample.gripper_width_m = odd,
                25..34 => object.position_m[(lane - 25) / 3] = odd,
                34..46 => object.orientation[(lane - 34) / 3] = odd,
                46..55 => object.half_extent_m[(lane - 46) / 3] = odd,
                _ => object.confidence = odd,
            }
            let mut controller = before.clone();
            for later in 0..3 {
                let input = Input {
                    state: Some(&sample),
                    ..Input::default()
                };
                let now_ns = world.now_ns() + later * 50_000_000;
                let output = controller.tick(now_ns, &input);
                assert!(all_finite(&output.command), "lane {lane}, {odd}");
            }
        }
    }
}

#[test]
fn inv_02_recovery_actions_stay_in_the_action_box() {
    swarms(|seen| {
        if seen.starts_recovery_action() {
            let [x, y, z, rx, ry, rz, grip] = seen.output.command.action;
            for a in [x, y, z, rx, ry, rz] {
                assert!(a.abs() <= 1.0, "seed {}: {a}", seen.seed);
            }
            assert!(grip == 1.0 || grip == -1.0, "seed {}: {grip}", seen.seed);
        }
    });
}

#[test]
fn inv_03_a_recovery_of_the_paper_profile_never_turns_the_hand() {
    for scene in [Scene::bowl_to_plate(), Scene::box_to_plate()] {
        for behaviour in failures() {
            let mut run = session(Params::paper(), &scene, behaviour);
            run.run(400);
            let mut corrections = 0;
            for r in run.queries.iter().filter(|r| r.sub_phase != 0) {
                assert_eq!(bits(&r.action)[3..6], [0; 3], "plus zero, bit for bit");
                corrections += 1;
            }
            assert!(corrections > 0);
        }
    }
}

#[test]
fn inv_03_a_recovery_of_the_guarded_profile_turns_it_only_while_it_hovers() {
    let mut turned = 0;
    swarms(|seen| {
        if seen.starts_recovery_action() {
            let rotates = bits(&seen.output.command.action)[3..6] != [0; 3];
            let may =
                seen.sub_phase() == SubPhase::ApproachHover && seen.params.recovery.level_rad > 0.0;
            assert!(!rotates || may, "seed {}", seen.seed);
            turned += u32::from(rotates);
        }
    });
    assert!(turned > 0, "some hand was turned");
}

#[test]
fn inv_04_equation_8_agrees_with_an_independent_oracle_to_the_bit() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let divisors = [0.045, 0.045, 0.035];
    for n in 0..200_000 {
        let spread = if n % 2 == 0 { 0.1 } else { 3.0 };
        let mut draw = || [(); 3].map(|()| rng.random_range(-spread..spread));
        let (goal, ee): ([f64; 3], [f64; 3]) = (draw(), draw());
        let found = recovery_translation(&ActionScale::default(), goal, ee).expect("finite");
        for axis in 0..3 {
            let quotient = (goal[axis] - ee[axis]) / divisors[axis];
            let outside = quotient.abs() > 1.0;
            let expected = if outside { quotient.signum() } else { quotient };
            assert_eq!(found[axis].to_bits(), f64::to_bits(expected));
        }
    }
}

#[test]
fn inv_05_a_waypoint_or_pose_that_is_not_finite_gives_no_action() {
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for axis in 0..3 {
            let mut point = [0.1; 3];
            point[axis] = odd;
            let scale = ActionScale::default();
            assert_eq!(recovery_translation(&scale, point, [0.0; 3]), None);
            assert_eq!(recovery_translation(&scale, [0.0; 3], point), None);
        }
    }
    // And where the difference overflows.
    let scale = ActionScale::default();
    assert_eq!(
        recovery_translation(&scale, [f64::MAX; 3], [f64::MIN; 3]),
        None
    );
}

#[test]
fn inv_06_an_accepted_chunk_passes_bit_for_bit() {
    let odd = [
        -0.0_f32,
        f32::MIN_POSITIVE / 8.0,
        0.123_456_79,
        -1.0,
        1.0,
        -0.7,
        1e-20,
    ];
    let mut compared = 0;
    chunked(
        watched(Params::guarded()),
        |n, chunk| {
            for (i, action) in chunk.actions.iter_mut().enumerate() {
                for (lane, x) in action.iter_mut().enumerate() {
                    *x = odd[(n + i + lane) % odd.len()] * 0.01 * ((i % 3) as f32);
                }
                action[6] = if i % 2 == 0 { 1.0 } else { -1.0 };
                action[3] = -0.0;
                action[4] = f32::MIN_POSITIVE / 8.0;
            }
        },
        |record, chunk| {
            assert_eq!(
                bits(&record.action),
                chunk.actions[0].map(|x| f64::from(x).to_bits())
            );
            assert_eq!(bits(&record.action), bits(&record.base_action));
            compared += 1;
        },
    );
    assert!(compared > 5);
}

/// The base policy alone.
fn watched(params: Params) -> Params {
    Params {
        switches: Switches::BACKBONE_ONLY,
        ..params
    }
}

/// Runs a session by hand, `change` writes each chunk, `compare` sees the
/// record of each query that a chunk answered.
fn chunked(
    params: Params,
    mut change: impl FnMut(usize, &mut ActionChunk),
    mut compare: impl FnMut(&fitmac_core::message::TraceRecord, &ActionChunk),
) {
    let scene = Scene::can_to_plate();
    let mut world = scene.world.clone();
    let mut policy = Policy::new(Behaviour::Frozen);
    let mut agent = Agent::knowing(&scene);
    let mut controller = Controller::new(params.validate().expect("valid"));
    let mut last = None;
    let mut count = 0;
    for _ in 0..1000 {
        world.advance(4_000_000);
        let now_ns = world.now_ns();
        let sample = world.sample();
        let chunk = policy.poll(now_ns).map(|mut chunk| {
            change(count, &mut chunk);
            count += 1;
            chunk
        });
        let grounding = agent.poll(now_ns);
        let input = Input {
            state: Some(&sample),
            chunk: chunk.as_ref(),
            grounding: grounding.as_ref(),
            ..Input::default()
        };
        let output = controller.tick(now_ns, &input);
        world.apply(&output.command);
        last = chunk.or(last);
        if let Some(query) = &output.query {
            policy.ask(query, &world, &scene);
        }
        if let Some(request) = &output.rebind {
            agent.ask(now_ns, request, &scene);
        }
        let from_policy = output.command.flags & Command::FROM_POLICY != 0;
        if let (Some(record), Some(chunk), true) = (&output.trace, &last, from_policy) {
            compare(record, chunk);
        }
    }
}

#[test]
fn inv_07_target_correction_never_replaces_an_action() {
    swarms(|seen| {
        let Some(record) = &seen.output.trace else {
            return;
        };
        if record.route == Route::Target.code() {
            let from_policy = seen.output.command.flags & Command::FROM_POLICY != 0;
            let still = record.action[..6] == [0.0; 6];
            assert!(from_policy || still, "seed {}", seen.seed);
            assert_eq!(record.sub_phase, SubPhase::Idle.code());
        }
    });
}

#[test]
fn inv_08_an_action_out_of_range_is_clamped_and_flagged() {
    let mut clamped = 0;
    chunked(
        watched(Params::guarded()),
        |n, chunk| {
            if n % 2 == 0 {
                chunk.actions[0][n % 7] = 1.5;
            }
        },
        |record, chunk| {
            let outside = chunk.actions[0].iter().any(|x| x.abs() > 1.0);
            for (x, sent) in record.action.iter().zip(chunk.actions[0]) {
                assert_eq!(*x, f64::from(sent).clamp(-1.0, 1.0));
            }
            clamped += u32::from(outside);
        },
    );
    assert!(clamped > 3);
}

#[test]
fn inv_08_the_flag_stands_iff_the_action_was_clamped() {
    swarms(|seen| {
        let c = &seen.output.command;
        let flag = c.flags & Command::CLAMPED != 0;
        assert_eq!(
            flag,
            c.reasons & reason::ACTION_CLAMPED != 0,
            "seed {}",
            seen.seed
        );
        if flag {
            assert!(
                c.action.iter().any(|x| x.abs() == 1.0),
                "seed {}",
                seen.seed
            );
            assert!(c.flags & Command::FROM_POLICY != 0);
        }
    });
}

#[test]
fn inv_08_or_its_chunk_is_refused_where_the_parameters_say_so() {
    let params = Params {
        out_of_range: OutOfRange::Refuse,
        ..Params::guarded()
    };
    let mut passed = 0;
    chunked(
        params,
        |_, chunk| chunk.actions[3][6] = 2.0,
        |_, _| passed += 1,
    );
    assert_eq!(
        passed, 0,
        "the number that real data sets hold in the gripper slot"
    );
}

#[test]
fn inv_09_a_hold_stands_still_and_keeps_the_gripper() {
    let mut holds = 0;
    swarms(|seen| {
        let mode = seen.output.command.mode().expect("known");
        if mode >= Mode::Hold {
            let [.., grip] = seen.output.command.action;
            assert_eq!(
                seen.output.command.action[..6],
                [0.0; 6],
                "seed {}",
                seen.seed
            );
            // What was commanded before stays.
            assert_eq!(grip, seen.before.action[6], "seed {}", seen.seed);
            holds += 1;
        }
    });
    assert!(holds > 100);
}

#[test]
fn inv_09_no_fault_opens_a_hand_that_carries() {
    // Each fault for itself, while the recovery carries the can.
    for fault in 0..6 {
        let mut run = session(Params::guarded(), &Scene::can_to_plate(), Behaviour::Frozen);
        let carrying = run.run_until(400, |s| s.world.ee_m()[2] > 0.1 && s.world.held() != 0);
        assert!(carrying);
        let mut sample = run.world.sample();
        let mut now_ns = run.world.now_ns();
        for n in 0..200 {
            now_ns += if fault == 5 && n == 0 {
                400_000_000
            } else {
                4_000_000
            };
            sample.sequence += 1;
            sample.stamp_ns = now_ns;
            match fault {
                0 => sample.ee_position_m[0] = f64::NAN,
                1 => sample.stamp_ns = 0,
                2 => sample.ee_orientation = [0.0; 4],
                3 => sample.applied_command = 7,
                _ => {}
            }
            let input = Input {
                state: (fault != 4).then_some(&sample),
                request: u8::from(fault == 4 && n == 20),
                ..Input::default()
            };
            let output = run.controller.tick(now_ns, &input);
            assert_eq!(output.command.action[6], 1.0, "fault {fault}, tick {n}");
            if n == 190 && fault != 3 {
                assert!(output.command.mode() >= Some(Mode::Hold), "fault {fault}");
            }
        }
    }
}

#[test]
fn inv_10_the_setpoint_keeps_its_limits_against_the_last_command() {
    let (mut moved, mut turned) = (0, 0);
    let mut last: Option<(Command, u64)> = None;
    swarms(|seen| {
        let c = seen.output.command;
        // The core's clock never runs backwards.
        let (p, then_ns) = match last {
            Some((p, ns)) if p.sequence + 1 == c.sequence => (p, ns),
            _ => (c, seen.told.now_ns),
        };
        let now_ns = seen.told.now_ns.max(then_ns);
        last = Some((c, now_ns));
        if p.setpoint_position_m == [0.0; 3] {
            return; // No state has arrived yet.
        }
        let dt_s = (now_ns - then_ns) as f64 * 1e-9;
        let f = &seen.params.filter;
        for axis in 0..3 {
            let change = |of: fn(&Command) -> [f64; 3]| (of(&c)[axis] - of(&p)[axis]).abs();
            let most = |limit: f64| limit * dt_s * (1.0 + 1e-6) + 1e-9;
            let dp = change(|c| c.setpoint_position_m);
            let dv = change(|c| c.setpoint_velocity_m_s);
            let da = change(|c| c.setpoint_acceleration_m_s2);
            let at_full_speed = c.setpoint_velocity_m_s[axis].abs() > 0.999 * f.velocity_m_s;
            assert!(dp <= most(f.velocity_m_s), "seed {}: {dp} m", seen.seed);
            assert!(
                dv <= most(f.acceleration_m_s2),
                "seed {}: {dv} m/s",
                seen.seed
            );
            // The speed limit may cut an acceleration off at once.
            let jerk_ok = da <= most(f.jerk_m_s3) || at_full_speed;
            assert!(jerk_ok, "seed {}: {da} m/s^2 in {dt_s} s", seen.seed);
            moved += u32::from(dp > 0.0);
        }
        // The rotation's limits are an axis each; its path may bend.
        let speed = 3.0_f64.sqrt() * 1.05 * seen.params.shaping.angular_velocity_rad_s;
        let angle = orientation(&p).angle_to(orientation(&c));
        assert!(
            angle <= speed * dt_s + 1e-6,
            "seed {}: {angle} rad in {dt_s} s",
            seen.seed
        );
        turned += u32::from(angle > 1e-6);
    });
    assert!(moved > 1000 && turned > 200, "{moved} {turned}");
}

fn orientation(command: &Command) -> UnitQuaternion {
    UnitQuaternion::from_wxyz(command.setpoint_orientation).expect("a rotation")
}

#[test]
fn inv_11_each_tick_gives_one_command_with_the_next_number() {
    let mut last: Option<(u64, u64)> = None;
    swarms(|seen| {
        let number = seen.output.command.sequence;
        if let Some((seed, before)) = last
            && seed == seen.seed
        {
            assert_eq!(number, before + 1);
        } else {
            assert_eq!(number, 1);
        }
        last = Some((seen.seed, number));
    });
}
