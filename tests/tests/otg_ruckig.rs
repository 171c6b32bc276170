//! The motion generator against Ruckig: durations, limits, and endless replanning.

use fitmac_tests::oracle;
use kinematics::otg::{Input, Limits, Otg, State, Status, Synchronisation, Target, Trajectory};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A planning problem.
struct Problem<const N: usize> {
    start: State<N>,
    input: Input<N>,
}

fn each<const N: usize>(mut f: impl FnMut(usize) -> f64) -> [f64; N] {
    std::array::from_fn(&mut f)
}

fn limits<const N: usize>(rng: &mut ChaCha8Rng) -> Limits<N> {
    Limits {
        velocity: each(|_| rng.random_range(0.1..4.0)),
        acceleration: each(|_| rng.random_range(0.1..8.0)),
        jerk: each(|_| rng.random_range(0.2..40.0)),
    }
}

/// A state from which the limits can be kept: the acceleration can be taken back to zero before
/// the velocity leaves its limit.
fn reachable<const N: usize>(rng: &mut ChaCha8Rng, limits: &Limits<N>) -> State<N> {
    let mut state = State::at_rest(each(|_| rng.random_range(-2.0..2.0)));
    for i in 0..N {
        if rng.random_bool(0.3) {
            continue;
        }
        let (v, a, j) = (limits.velocity[i], limits.acceleration[i], limits.jerk[i]);
        loop {
            let (v0, a0): (f64, f64) = (rng.random_range(-v..v), rng.random_range(-a..a));
            if (v0 + a0 * a0.abs() / (2.0 * j)).abs() < v {
                state.velocity[i] = v0;
                state.acceleration[i] = a0;
                break;
            }
        }
    }
    state
}

fn target<const N: usize>(rng: &mut ChaCha8Rng, limits: &Limits<N>) -> Target<N> {
    let moving = rng.random_bool(0.7);
    Target::Reach {
        position: each(|_| rng.random_range(-2.0..2.0)),
        velocity: each(|i| {
            if moving {
                rng.random_range(-0.99..0.99) * limits.velocity[i]
            } else {
                0.0
            }
        }),
    }
}

fn problem<const N: usize>(rng: &mut ChaCha8Rng) -> Problem<N> {
    let limits = limits(rng);
    let start = reachable(rng, &limits);
    Problem {
        start,
        input: Input {
            target: target(rng, &limits),
            limits,
        },
    }
}

fn encode<const N: usize>(problem: &Problem<N>, bytes: &mut Vec<u8>) {
    let Target::Reach { position, velocity } = &problem.input.target else {
        return;
    };
    let limits = &problem.input.limits;
    bytes.extend((N as f64).to_le_bytes());
    for row in [
        &problem.start.position,
        &problem.start.velocity,
        &problem.start.acceleration,
        position,
        velocity,
        &limits.velocity,
        &limits.acceleration,
        &limits.jerk,
    ] {
        bytes.extend(row.iter().flat_map(|x| x.to_le_bytes()));
    }
}

/// Greatest excess over the limits at 1 kHz, and the error at the end.
fn excess<const N: usize>(problem: &Problem<N>, trajectory: &Trajectory<N>) -> f64 {
    let limits = &problem.input.limits;
    let mut worst = f64::NEG_INFINITY;
    let steps = (trajectory.duration_s() / 1e-3).ceil() as usize + 2;
    let mut last = trajectory.at(0.0);
    for step in 0..=steps {
        let state = trajectory.at(step as f64 * 1e-3);
        for i in 0..N {
            let jerk = (state.acceleration[i] - last.acceleration[i]).abs() / 1e-3;
            worst = worst
                .max(state.velocity[i].abs() - limits.velocity[i])
                .max(state.acceleration[i].abs() - limits.acceleration[i])
                .max(jerk - limits.jerk[i]);
            assert!(state.position[i].is_finite());
            // Position follows from velocity: what jumps would show here.
            let mean = 0.5 * (state.velocity[i] + last.velocity[i]);
            let slack = limits.jerk[i] * 1e-9 + 1e-9;
            let jump = state.position[i] - last.position[i] - mean * 1e-3;
            assert!(
                step == 0 || jump.abs() < slack,
                "position jumps by {jump:e}"
            );
        }
        last = state;
    }
    worst
}

struct Report {
    count: usize,
    equal: usize,
    shorter: Vec<String>,
    longer: Vec<String>,
    unsolved: Vec<String>,
    worst_excess: f64,
}

fn compare<const N: usize>(seed: u64, count: usize, sampled: usize) -> Report {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let problems: Vec<Problem<N>> = (0..count).map(|_| problem(&mut rng)).collect();
    let mut bytes = Vec::new();
    for problem in &problems {
        encode(problem, &mut bytes);
    }
    let theirs = oracle::floats(&oracle::run("otg_ruckig.py", &[], &bytes));
    assert_eq!(theirs.len(), count, "the oracle answers every problem");
    let mut report = Report {
        count,
        equal: 0,
        shorter: vec![],
        longer: vec![],
        unsolved: vec![],
        worst_excess: f64::NEG_INFINITY,
    };
    for (index, (problem, theirs)) in problems.iter().zip(theirs).enumerate() {
        let ours = Trajectory::plan(&problem.start, &problem.input).expect("a valid problem");
        assert_eq!(
            ours.synchronisation(),
            Synchronisation::Time,
            "problem {index}: {:?}",
            problem.input
        );
        if index < sampled {
            report.worst_excess = report.worst_excess.max(excess(problem, &ours));
        }
        let line = || {
            format!(
                "{N} axes, seed {seed}, problem {index}: {} s, Ruckig {theirs} s, {:?} {:?}",
                ours.duration_s(),
                problem.start,
                problem.input
            )
        };
        if theirs.is_nan() {
            report.unsolved.push(line());
        } else if ours.duration_s() < theirs - 1e-9 {
            report.shorter.push(line());
        } else if ours.duration_s() > theirs + 1e-6 {
            report.longer.push(line());
        } else {
            report.equal += 1;
        }
    }
    report
}

#[test]
fn durations_are_those_of_ruckig() {
    let reports = [
        compare::<1>(1, 40_000, 4_000),
        compare::<3>(3, 40_000, 4_000),
        compare::<7>(7, 20_000, 2_000),
    ];
    let (mut count, mut equal) = (0, 0);
    for report in &reports {
        println!(
            "{} problems: {} equal within 1e-6 s, {} longer, {} shorter, {} unsolved by Ruckig, \
             worst excess over a limit {:.1e}",
            report.count,
            report.equal,
            report.longer.len(),
            report.shorter.len(),
            report.unsolved.len(),
            report.worst_excess
        );
        let rest = [&report.longer, &report.shorter, &report.unsolved];
        rest.into_iter()
            .flatten()
            .for_each(|line| println!("  {line}"));
        assert!(report.shorter.is_empty(), "shorter than the shortest");
        assert!(
            report.worst_excess <= 1e-9,
            "limits exceeded by {:e}",
            report.worst_excess
        );
        count += report.count;
        equal += report.equal;
    }
    assert!(
        equal as f64 >= 0.999 * count as f64,
        "{equal} of {count} are equal"
    );
}

/// Limits of the seven joints of a Panda (Franka's published values).
const PANDA_VELOCITY: [f64; 7] = [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61];
const PANDA_ACCELERATION: [f64; 7] = [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0];
const PANDA_JERK: [f64; 7] = [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10_000.0, 10_000.0];

fn fixed_limits<const N: usize>(scale: f64) -> Limits<N> {
    Limits {
        velocity: each(|i| scale * PANDA_VELOCITY[i]),
        acceleration: each(|i| scale * PANDA_ACCELERATION[i]),
        jerk: each(|i| scale * PANDA_JERK[i]),
    }
}

/// Panics where one tick leads beyond the limits, or the state is not a number.
fn check_tick<const N: usize>(last: &State<N>, now: &State<N>, limits: &Limits<N>, dt: f64) {
    for i in 0..N {
        let jerk = (now.acceleration[i] - last.acceleration[i]).abs() / dt;
        let step = now.position[i] - last.position[i];
        assert!(
            now.velocity[i].abs() <= limits.velocity[i] + 1e-9,
            "velocity {now:?}"
        );
        assert!(
            now.acceleration[i].abs() <= limits.acceleration[i] + 1e-9,
            "acceleration {now:?}"
        );
        assert!(
            jerk <= limits.jerk[i] + 1e-8,
            "jerk {jerk} from {last:?} to {now:?}"
        );
        assert!(
            step.abs() <= limits.velocity[i] * dt + 1e-9,
            "step {last:?} {now:?}"
        );
    }
}

/// Replans `count` times, a random number of ticks apart, and lets every hundredth target be
/// reached. Returns the number of motions that were not synchronised.
fn replan<const N: usize>(seed: u64, count: usize, limits: Limits<N>) -> usize {
    const DT: f64 = 1e-3;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut otg = Otg::new(State::at_rest([0.0; N]));
    let mut lost = 0;
    for round in 0..count {
        let input = Input {
            target: target(&mut rng, &limits),
            limits,
        };
        let patient = round % 100 == 99;
        let ticks = if patient {
            200_000
        } else {
            rng.random_range(1..4)
        };
        for tick in 0..ticks {
            let last = otg.state();
            let output = otg.update(&input, DT);
            check_tick(&last, &output.state, &limits, DT);
            match output.status {
                // The target velocity is kept: the next target takes over from here.
                Status::Reached => break,
                Status::Moving(Synchronisation::Lost) => lost += usize::from(tick == 0),
                Status::Moving(_) => {}
                Status::Refused(refusal) => panic!("{refusal}"),
            }
            assert!(tick + 1 < 200_000, "stuck: {output:?} for {input:?}");
        }
    }
    lost
}

#[test]
fn endless_replanning_keeps_the_limits_and_arrives() {
    let mut lost = 0;
    lost += replan(11, 1_000_000, fixed_limits::<1>(1.0));
    lost += replan(12, 1_000_000, fixed_limits::<3>(1.0));
    lost += replan(13, 1_000_000, fixed_limits::<7>(1.0));
    // Low jerk: the acceleration limit is hardly ever reached.
    let mut soft = fixed_limits::<3>(0.5);
    soft.jerk = [5.0, 3.0, 8.0];
    lost += replan(14, 1_000_000, soft);
    println!("4000000 replans, {lost} not synchronised");
    assert_eq!(lost, 0);
}

/// Limits that change on the way: the axes come back within the new ones, stay there, and arrive.
#[test]
fn limits_may_change_every_tick() {
    const DT: f64 = 1e-3;
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let mut otg = Otg::new(State::at_rest([0.0; 3]));
    for _ in 0..20_000 {
        let limits = limits(&mut rng);
        let input = Input {
            target: target(&mut rng, &limits),
            limits,
        };
        let mut within = false;
        for _ in 0..rng.random_range(1..400) {
            let last = otg.state();
            let output = otg.update(&input, DT);
            assert!(!matches!(output.status, Status::Refused(_)), "{output:?}");
            let state = output.state;
            for i in 0..3 {
                let jerk = (state.acceleration[i] - last.acceleration[i]).abs() / DT;
                let moving = output.status != Status::Reached;
                assert!(!moving || jerk <= limits.jerk[i] + 1e-8, "jerk {jerk}");
            }
            let inside = (0..3).all(|i| {
                let (v, a, j) = (limits.velocity[i], limits.acceleration[i], limits.jerk[i]);
                let (v0, a0) = (state.velocity[i], state.acceleration[i]);
                let ahead = v0 + a0 * a0.abs() / (2.0 * j);
                v0.abs().max(ahead.abs()) <= v + 1e-9 && a0.abs() <= a + 1e-9
            });
            assert!(
                inside || !within,
                "left the limits again: {state:?} for {input:?}"
            );
            within |= inside;
        }
    }
}
