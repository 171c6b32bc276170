use super::*;
use crate::panda::{self, LIMITS, Panda};
use crate::rotation::UnitQuaternion;

/// Configurations spread over the inner 96 % of the joint ranges, the same in every run.
fn configurations() -> impl Iterator<Item = [f64; 7]> {
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    let mut share = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        0.02 + 0.96 * (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    core::iter::repeat_with(move || {
        LIMITS.map(|limit| limit.lower + share() * (limit.upper - limit.lower))
    })
}

fn within_limits(q: &[f64; 7]) -> bool {
    q.iter()
        .zip(&LIMITS)
        .all(|(q, l)| (l.lower..=l.upper).contains(q))
}

#[test]
fn what_an_arm_can_reach_is_found() {
    let mut found = 0;
    for q in configurations().take(1000) {
        let target = Panda.tip(&q).expect("finite").pose();
        let answer = solve(&Panda, &target, &panda::READY, &Search::default()).expect("usable");
        match answer {
            Answer::Reached(candidate) => {
                found += 1;
                assert!(within_limits(&candidate.q));
                let tip = Panda.tip(&candidate.q).expect("finite").pose();
                assert!(tip.distance(target) <= 1e-6);
                assert!(tip.orientation.angle_to(target.orientation) <= 1e-6);
            }
            Answer::NotReached(candidate) => assert!(within_limits(&candidate.q)),
            Answer::OutOfReach => panic!("{q:?} is a posture of the arm"),
        }
    }
    // The ranges are narrow and the search is bounded: a few need more starts.
    assert!(found >= 995, "{found} of 1000");
}

#[test]
fn the_general_chain_finds_the_same() {
    let q = [0.4, 0.2, -0.3, -1.8, 0.5, 2.0, 0.1];
    let target = Panda.tip(&q).expect("finite").pose();
    let chain = panda::chain().expect("the constants are a chain");
    let answer = solve(&chain, &target, &panda::READY, &Search::default()).expect("usable");
    assert!(
        matches!(answer, Answer::Reached(found) if found.steps < 50),
        "{answer:?}"
    );
}

#[test]
fn what_is_too_far_is_named() {
    let far = Pose::from_position([2.0, 0.0, 0.5]);
    let answer = solve(&Panda, &far, &panda::READY, &Search::default());
    assert_eq!(answer, Ok(Answer::OutOfReach));
    // Within the length of the stretched links, but not within the joint ranges.
    let behind = Pose::new([0.0, 0.0, -0.5], UnitQuaternion::HALF_TURN_X);
    let search = Search {
        restarts: 2,
        ..Search::default()
    };
    let Ok(Answer::NotReached(best)) = solve(&Panda, &behind, &panda::READY, &search) else {
        panic!("no arm reaches through its own base");
    };
    assert!(within_limits(&best.q) && best.steps <= 300);
}

#[test]
fn bad_requests_are_named() {
    let nowhere = Pose::from_position([f64::NAN, 0.0, 0.0]);
    let ask = |target: &Pose, seed: &[f64; 7], search| solve(&Panda, target, seed, &search).err();
    assert_eq!(
        ask(&nowhere, &panda::READY, Search::default()),
        Some(Refusal::Target)
    );
    let here = Pose::from_position([0.5, 0.0, 0.5]);
    let seed = [f64::NAN; 7];
    let refused = Some(Refusal::Seed(JointOutOfRange { joint: 0 }));
    assert_eq!(ask(&here, &seed, Search::default()), refused);
    let search = Search {
        position_tolerance_m: 0.0,
        ..Search::default()
    };
    assert_eq!(ask(&here, &panda::READY, search), Some(Refusal::Tolerance));
}
