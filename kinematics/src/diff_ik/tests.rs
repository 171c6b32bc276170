use proptest::prelude::*;

use super::*;
use crate::arm::Arm;
use crate::panda::{self, LIMITS, Panda};

fn configuration() -> impl Strategy<Value = [f64; 7]> {
    prop::collection::vec(-0.05..1.05_f64, 7).prop_map(|share| {
        core::array::from_fn(|i| LIMITS[i].lower + share[i] * (LIMITS[i].upper - LIMITS[i].lower))
    })
}

fn solve(q: &[f64; 7], twist: &[f64; 6], posture: &[f64; 7]) -> JointMotion<7> {
    let at = Panda.solve(q).expect("finite");
    velocities(&at, q, &LIMITS, twist, posture, &Tuning::default()).expect("usable")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn limits_hold_whatever_is_asked(
        q in configuration(),
        twist in prop::array::uniform6(-5.0..5.0_f64),
        posture in prop::array::uniform7(-3.0..3.0_f64),
    ) {
        let motion = solve(&q, &twist, &posture);
        for i in 0..7 {
            let v = motion.velocity[i];
            prop_assert!(v.abs() <= LIMITS[i].velocity);
            let after = q[i] + v * 0.02;
            let inside = (LIMITS[i].lower..=LIMITS[i].upper).contains(&q[i]);
            prop_assert!(!inside || (after >= LIMITS[i].lower - 1e-12 && after <= LIMITS[i].upper + 1e-12));
        }
        let missing = motion.missing.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        prop_assert!(motion.outcome != Outcome::Followed || missing < 1e-9);
    }
}

#[test]
fn a_modest_twist_is_followed_and_the_posture_uses_the_rest() {
    let twist = [0.1, -0.05, 0.02, 0.1, 0.0, -0.2];
    let still = solve(&panda::READY, &twist, &[0.0; 7]);
    assert_eq!(still.outcome, Outcome::Followed);
    let posture = [0.3, 0.0, -0.2, 0.0, 0.1, 0.0, 0.0];
    let leaning = solve(&panda::READY, &twist, &posture);
    assert_eq!(leaning.outcome, Outcome::Followed);
    let along = |m: &JointMotion<7>| {
        m.velocity
            .iter()
            .zip(posture)
            .map(|(a, b)| a * b)
            .sum::<f64>()
    };
    assert!(along(&leaning) > along(&still) + 0.01);
}

#[test]
fn a_singular_arm_is_damped() {
    let straight = [0.0, 0.0, 0.0, -0.0698, 0.0, 0.0, 0.0];
    let motion = solve(&straight, &[0.0, 0.0, 0.1, 0.0, 0.0, 0.0], &[0.0; 7]);
    assert!(
        matches!(motion.outcome, Outcome::Damped { damping } if damping > 0.0),
        "{motion:?}"
    );
}

#[test]
fn a_joint_at_its_limit_is_held_and_the_others_take_over() {
    let mut q = panda::READY;
    q[5] = LIMITS[5].upper;
    q[3] = -1.5;
    // Turning the hand about base y pushes joint 6 outwards in one of the two directions.
    let free = |sign: f64| solve(&q, &[0.0, 0.0, 0.0, 0.0, sign * 0.3, 0.0], &[0.0; 7]);
    let motions = [free(1.0), free(-1.0)];
    assert!(
        motions
            .iter()
            .any(|m| matches!(m.outcome, Outcome::Limited { held } if held[5])),
        "{motions:?}"
    );
    assert!(motions.iter().all(|m| m.velocity[5] <= 1e-12));
}

#[test]
fn bad_requests_are_named() {
    let at = Panda.solve(&panda::READY).expect("finite");
    let ask = |twist: [f64; 6], tuning: Tuning| {
        velocities(&at, &panda::READY, &LIMITS, &twist, &[0.0; 7], &tuning).err()
    };
    assert_eq!(ask([f64::NAN; 6], Tuning::default()), Some(Refusal::Twist));
    let stuck = Tuning {
        horizon_s: 0.0,
        ..Tuning::default()
    };
    assert_eq!(ask([0.0; 6], stuck), Some(Refusal::Tuning));
    let q = [f64::INFINITY; 7];
    let refused = velocities(&at, &q, &LIMITS, &[0.0; 6], &[0.0; 7], &Tuning::default());
    assert_eq!(
        refused.err(),
        Some(Refusal::Joint(JointOutOfRange { joint: 0 }))
    );
}
