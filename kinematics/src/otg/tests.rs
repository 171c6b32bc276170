use proptest::prelude::*;

use super::*;

const DT: f64 = 1e-3;

fn limits() -> Limits<3> {
    Limits {
        velocity: [0.5, 0.4, 0.3],
        acceleration: [2.0, 1.5, 1.0],
        jerk: [20.0, 10.0, 15.0],
    }
}

fn reach(position: [f64; 3]) -> Input<3> {
    Input {
        target: Target::Reach {
            position,
            velocity: [0.0; 3],
        },
        limits: limits(),
    }
}

/// Ticks until the motion is over, and the last output.
fn run(otg: &mut Otg<3>, input: &Input<3>) -> (usize, Output<3>) {
    for tick in 1..100_000 {
        let output = otg.update(input, DT);
        if output.status == Status::Reached {
            return (tick, output);
        }
    }
    panic!("never reached");
}

#[test]
fn one_axis_from_rest_to_rest_takes_the_textbook_time() {
    // Full acceleration and full velocity are reached: t = d/v + v/a + a/j.
    let plan = Trajectory::plan(
        &State::at_rest([1.0]),
        &Input {
            target: Target::Reach {
                position: [-1.0],
                velocity: [0.0],
            },
            limits: Limits {
                velocity: [1.0],
                acceleration: [4.0],
                jerk: [20.0],
            },
        },
    )
    .expect("valid");
    assert!((plan.duration_s() - (2.0 / 1.0 + 1.0 / 4.0 + 4.0 / 20.0)).abs() < 1e-12);
    // Neither is reached: t = 4 (d / 2j)^(1/3).
    let plan = Trajectory::plan(
        &State::at_rest([0.0]),
        &Input {
            target: Target::Reach {
                position: [0.016],
                velocity: [0.0],
            },
            limits: Limits {
                velocity: [1.0],
                acceleration: [4.0],
                jerk: [1.0],
            },
        },
    )
    .expect("valid");
    assert!(
        (plan.duration_s() - 0.8).abs() < 1e-12,
        "{}",
        plan.duration_s()
    );
}

#[test]
fn an_unchanged_input_only_samples_the_plan() {
    let input = reach([0.3, -0.2, 0.1]);
    let start = State::at_rest([0.0; 3]);
    let plan = Trajectory::plan(&start, &input).expect("valid");
    let mut otg = Otg::new(start);
    let mut time = 0.0;
    for _ in 0..2000 {
        time += DT;
        assert_eq!(otg.update(&input, DT).state, plan.at(time));
    }
    assert_eq!(otg.state(), State::at_rest([0.3, -0.2, 0.1]));
}

#[test]
fn a_copy_goes_on_alike() {
    let mut otg = Otg::new(State::at_rest([0.0; 3]));
    for _ in 0..100 {
        otg.update(&reach([0.3, -0.2, 0.1]), DT);
    }
    let mut copy = otg.clone();
    for _ in 0..100 {
        assert_eq!(
            otg.update(&reach([-0.3, 0.0, 0.1]), DT),
            copy.update(&reach([-0.3, 0.0, 0.1]), DT)
        );
    }
    assert_eq!(otg, copy);
}

#[test]
fn from_rest_no_axis_overshoots() {
    let mut otg = Otg::new(State::at_rest([0.0; 3]));
    let input = reach([0.5, 0.01, -0.1]);
    let mut last = otg.state();
    while otg.update(&input, DT).status != Status::Reached {
        let now = otg.state();
        assert!(now.position[0] >= last.position[0] && now.position[1] >= last.position[1]);
        assert!(now.position[2] <= last.position[2]);
        last = now;
    }
}

#[test]
fn a_moving_target_state_is_passed_through() {
    let input = Input {
        target: Target::Reach {
            position: [0.2, 0.0, 0.0],
            velocity: [0.3, 0.0, 0.0],
        },
        limits: limits(),
    };
    let mut otg = Otg::new(State::at_rest([0.0; 3]));
    let (_, output) = run(&mut otg, &input);
    assert_eq!(output.state.velocity, [0.3, 0.0, 0.0]);
    let before = output.state.position[0];
    otg.update(&input, 0.1);
    assert!((otg.state().position[0] - before - 0.03).abs() < 1e-12);
}

#[test]
fn stop_ends_at_rest_within_the_shortest_time() {
    let mut otg = Otg::new(State::at_rest([0.0; 3]));
    for _ in 0..300 {
        otg.update(&reach([3.0, 2.0, 1.0]), DT);
    }
    let stop = Input {
        target: Target::Stop,
        limits: limits(),
    };
    let (ticks, output) = run(&mut otg, &stop);
    assert_eq!(output.state.velocity, [0.0; 3]);
    // v/a + a/j bounds a stop from at most full velocity and acceleration, plus taking back a.
    assert!(ticks < 700, "{ticks}");
    assert_eq!(run(&mut otg, &stop).1.state, output.state);
}

#[test]
fn a_refused_input_is_named_and_the_axes_come_to_rest() {
    let mut otg = Otg::new(State::at_rest([0.0; 3]));
    for _ in 0..300 {
        otg.update(&reach([3.0, 2.0, 1.0]), DT);
    }
    assert!(otg.state().velocity[0] > 0.1);
    let bad = reach([f64::NAN, 0.0, 0.0]);
    let refusal = Refusal::OutOfRange {
        quantity: Quantity::TargetPosition,
        axis: 0,
    };
    for _ in 0..1000 {
        assert_eq!(otg.update(&bad, DT).status, Status::Refused(refusal));
        assert!(otg.state().velocity[0].abs() <= 0.5);
    }
    assert_eq!(otg.state().velocity, [0.0; 3]);
    let (_, output) = run(&mut otg, &reach([0.0; 3]));
    assert_eq!(output.state, State::at_rest([0.0; 3]));
}

#[test]
fn every_kind_of_bad_input_has_its_name() {
    let fresh = || Otg::new(State::at_rest([0.1; 3]));
    let status = |input: &Input<3>, dt| fresh().update(input, dt).status;
    let range = |quantity, axis| Status::Refused(Refusal::OutOfRange { quantity, axis });
    let mut input = reach([0.0; 3]);
    input.limits.jerk[1] = 0.0;
    assert_eq!(status(&input, DT), range(Quantity::JerkLimit, 1));
    input = reach([0.0; 3]);
    input.limits.velocity[2] = f64::INFINITY;
    assert_eq!(status(&input, DT), range(Quantity::VelocityLimit, 2));
    input = reach([0.0; 3]);
    input.limits.acceleration[0] = -1.0;
    assert_eq!(status(&input, DT), range(Quantity::AccelerationLimit, 0));
    input = reach([0.0; 3]);
    input.target = Target::Reach {
        position: [0.0; 3],
        velocity: [0.0, 0.0, 0.31],
    };
    assert_eq!(
        status(&input, DT),
        Status::Refused(Refusal::TargetTooFast { axis: 2 })
    );
    for dt in [-1e-3, f64::NAN, f64::INFINITY, 11.0] {
        assert_eq!(
            status(&reach([0.0; 3]), dt),
            Status::Refused(Refusal::TimeStep)
        );
    }
    let mut otg = Otg::new(State {
        velocity: [0.0, f64::NAN, 0.0],
        ..State::at_rest([0.0; 3])
    });
    assert_eq!(
        otg.update(&reach([0.0; 3]), DT).status,
        range(Quantity::Velocity, 1)
    );
    assert_eq!(fresh().update(&input, DT).state, State::at_rest([0.1; 3]));
}

#[test]
fn nothing_to_do_is_reached_at_once() {
    let mut otg = Otg::new(State::at_rest([0.1, 0.2, 0.3]));
    let output = otg.update(&reach([0.1, 0.2, 0.3]), 0.0);
    assert_eq!(output.status, Status::Reached);
    assert_eq!(output.state, State::at_rest([0.1, 0.2, 0.3]));
}

#[test]
fn too_fast_a_start_is_braked_back() {
    let mut otg = Otg::new(State {
        velocity: [1.2, -0.9, 0.0],
        acceleration: [0.0, -3.0, 1.5],
        ..State::at_rest([0.0; 3])
    });
    let (_, output) = run(&mut otg, &reach([0.0, 0.1, 0.0]));
    assert_eq!(output.state, State::at_rest([0.0, 0.1, 0.0]));
}

fn numbers(range: f64) -> impl Strategy<Value = [f64; 2]> {
    prop::array::uniform2(prop_oneof![
        4 => -range..range,
        1 => Just(0.0),
        1 => -1e-9..1e-9_f64,
        1 => -1e9..1e9_f64,
    ])
}

fn positive() -> impl Strategy<Value = [f64; 2]> {
    prop::array::uniform2((-6.0..9.0_f64).prop_map(|e| 10.0_f64.powf(e)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    /// Whatever is accepted gives numbers, however far apart the magnitudes are.
    #[test]
    fn accepted_input_never_gives_nan(
        p in numbers(2.0), v in numbers(2.0), a in numbers(2.0),
        goal in numbers(2.0), share in prop::array::uniform2(-1.0..1.0_f64),
        v_max in positive(), a_max in positive(), j_max in positive(),
    ) {
        let limits = Limits { velocity: v_max, acceleration: a_max, jerk: j_max };
        let velocity = [share[0] * v_max[0], share[1] * v_max[1]];
        let input = Input { target: Target::Reach { position: goal, velocity }, limits };
        let start = State { position: p, velocity: v, acceleration: a };
        let plan = Trajectory::plan(&start, &input).expect("in range");
        prop_assert!(plan.duration_s().is_finite() && plan.duration_s() >= 0.0);
        for k in 0..=20 {
            let state = plan.at(plan.duration_s() * f64::from(k) / 20.0);
            prop_assert!(state.check().is_ok() || state.position.iter().all(|x| x.is_finite()));
        }
    }

    /// Planning again on the way with the same target does not prolong the motion.
    #[test]
    fn replanning_keeps_the_arrival_time(
        goal in prop::array::uniform3(-1.0..1.0_f64),
        share in prop::array::uniform3(-0.9..0.9_f64),
        when in 0.05..0.95_f64,
    ) {
        let limits = limits();
        let velocity = core::array::from_fn(|i| share[i] * limits.velocity[i]);
        let input = Input { target: Target::Reach { position: goal, velocity }, limits };
        let plan = Trajectory::plan(&State::at_rest([0.0; 3]), &input).expect("valid");
        let elapsed = when * plan.duration_s();
        let again = Trajectory::plan(&plan.at(elapsed), &input).expect("valid");
        prop_assert!((again.duration_s() + elapsed - plan.duration_s()).abs() < 1e-6);
    }
}
