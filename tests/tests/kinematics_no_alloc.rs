//! Kinematics and the motion generator allocate nothing: a counting allocator watches them.

mod meter;

use std::hint::black_box;

use kinematics::{
    Arm, Pose,
    clearance::{self, PANDA_HAND},
    diff_ik::{self, Tuning},
    otg::{Input, Limits, Otg, State, Status, Target},
    panda::{self, LIMITS, Panda},
    pose_ik::{self, Search},
};
use meter::calls;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn configuration(rng: &mut ChaCha8Rng) -> [f64; 7] {
    LIMITS.map(|limit| rng.random_range(limit.lower..limit.upper))
}

#[test]
fn kinematics_allocate_nothing() {
    let chain = panda::chain().expect("the Panda is a chain");
    let mut rng = ChaCha8Rng::seed_from_u64(64);
    let (mut solved, mut near) = (0, 0);
    for n in 0..500 {
        let (q, v, goal) = (
            configuration(&mut rng),
            configuration(&mut rng),
            configuration(&mut rng),
        );
        let twist = [(); 6].map(|()| rng.random_range(-0.5..0.5));
        let allocated = calls(|| {
            let at = chain.solve(&q).expect("a joint in range");
            black_box(Panda.solve(&q).expect("a joint in range"));
            black_box(chain.links(&q).expect("joints in range"));
            black_box(
                chain
                    .jacobian_dot_velocity(&q, &v)
                    .expect("joints in range"),
            );
            black_box(at.jacobian.manipulability());
            let velocities = diff_ik::velocities(&at, &q, &LIMITS, &twist, &v, &Tuning::default());
            solved += u32::from(black_box(velocities).is_ok());
            let goal = chain.tip(&goal).expect("a joint in range");
            let goal: Pose = goal.pose();
            let found = pose_ik::solve(&Panda, &goal, &q, &Search::default());
            near += u32::from(black_box(found).is_ok());
            black_box(clearance::narrowest(&PANDA_HAND, &[goal; 4], &[]).ok());
        });
        assert_eq!(allocated, 0, "configuration {n}");
    }
    assert!(solved > 400 && near > 100, "{solved} {near}");
}

#[test]
fn the_motion_generator_allocates_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(65);
    let mut otg = Otg::new(State::at_rest([0.0; 7]));
    let (mut plans, mut refused) = (0, 0);
    for n in 0..20_000 {
        // Every tenth tick has a new target, now and then one that is no number.
        let bad = n % 1000 == 0;
        let position = [(); 7].map(|()| rng.random_range(-1.0..1.0));
        let input = Input {
            target: Target::Reach {
                position: if bad { [f64::NAN; 7] } else { position },
                velocity: [0.0; 7],
            },
            limits: Limits {
                velocity: [2.0; 7],
                acceleration: [10.0; 7],
                jerk: [500.0; 7],
            },
        };
        for _ in 0..10 {
            let mut status = None;
            let allocated = calls(|| status = Some(otg.update(&input, 0.001).status));
            assert_eq!(allocated, 0, "target {n}");
            refused += u32::from(matches!(status, Some(Status::Refused(_))));
        }
        plans += 1;
    }
    assert!(plans > 1000 && refused >= 200, "{plans} {refused}");
}
