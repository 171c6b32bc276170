//! Steadying and carrying, with numbers that a binary fraction holds.

use super::*;

const TARGET: ObjectId = 1;
const ANCHOR: ObjectId = 2;

fn params() -> Params {
    let mut params = Params::guarded();
    params.tracking = TrackingParams {
        gain: 0.25,
        jump_m: 0.5,
    };
    params.gripper.held_radius_m = 0.5;
    params
}

/// A level hand at `ee_m` at `now_ns`, and the target as it was seen at `seen_ns`.
fn sample(now_ns: u64, ee_m: Vector3, seen_ns: u64, target_m: Vector3) -> StateSample {
    let mut sample = StateSample {
        stamp_ns: now_ns,
        ee_position_m: ee_m,
        ee_orientation: [1.0, 0.0, 0.0, 0.0],
        object_count: 2,
        ..StateSample::default()
    };
    for (object, (id, position_m)) in sample
        .objects
        .iter_mut()
        .zip([(TARGET, target_m), (ANCHOR, [0.0, 0.0, target_m[0]])])
    {
        *object = ObjectSample {
            id,
            visible: 1,
            stamp_ns: seen_ns,
            position_m,
            ..ObjectSample::default()
        };
    }
    sample
}

const AWAY: Vector3 = [9.0, 0.0, 0.0];

#[test]
fn what_rests_is_averaged_and_what_jumps_is_followed_at_once() {
    let params = params();
    let mut tracking = Tracking::new();
    for (seen_ns, x, expected) in [
        (1, 1.0, 1.0),
        (2, 1.5, 1.125),
        (2, 9.0, 1.125),
        (3, 1.625, 1.25),
        (4, 1.751, 1.751),
    ] {
        let sample = sample(seen_ns, AWAY, seen_ns, [x, 0.0, 0.0]);
        tracking.step(&params, &sample, TARGET, ANCHOR, false);
        assert_eq!(tracking.target_m(&sample), Some([expected, 0.0, 0.0]));
        assert_eq!(tracking.anchor_m(), Some([0.0, 0.0, expected]));
        assert!(!tracking.is_carried());
    }
}

#[test]
fn what_is_within_reach_of_a_closed_hand_goes_along_with_it() {
    let params = params();
    let carried = |x: f64| {
        let mut tracking = Tracking::new();
        let near = sample(1, [0.0; 3], 1, [x, 0.0, 0.0]);
        tracking.step(&params, &near, TARGET, ANCHOR, true);
        tracking.is_carried()
    };
    assert!(carried(0.499) && !carried(0.5));

    let mut tracking = Tracking::new();
    let near = sample(1, [0.0; 3], 1, [0.25, 0.0, 0.0]);
    tracking.step(&params, &near, TARGET, ANCHOR, true);
    // It is not seen again, and the hand has moved.
    let moved = sample(2, [0.0, 4.0, 0.0], 1, [0.25, 0.0, 0.0]);
    tracking.step(&params, &moved, TARGET, ANCHOR, true);
    assert_eq!(tracking.target_m(&moved), Some([0.25, 4.0, 0.0]));
    // Let go, it stays where the hand had it.
    tracking.step(&params, &moved, TARGET, ANCHOR, false);
    assert!(!tracking.is_carried());
    assert_eq!(tracking.target_m(&moved), Some([0.25, 4.0, 0.0]));
}

#[test]
fn a_late_pose_is_compared_with_where_the_hand_was_then() {
    let params = params();
    let mut tracking = Tracking::new();
    for n in 0..4_u32 {
        let at = f64::from(n);
        let now_ns = 100 + 100 * u64::from(n);
        let sample = sample(now_ns, [at, 0.0, 0.0], 1, [0.25, 0.0, 0.0]);
        tracking.step(&params, &sample, TARGET, ANCHOR, false);
    }
    // Between the second step and the third, a quarter of the way on.
    assert_eq!(tracking.hand_at(225), Some([1.25, 0.0, 0.0]));
    assert_eq!(tracking.hand_at(200), Some([1.0, 0.0, 0.0]));
    assert_eq!(tracking.hand_at(900), Some([3.0, 0.0, 0.0]), "the newest");
    assert_eq!(tracking.hand_at(5), Some([0.0; 3]), "the oldest");
    assert_eq!(Tracking::new().hand_at(5), None);
    // Seen under the hand while it was at 1.25; the hand is at 4 now.
    let sample = sample(500, [4.0, 0.0, 0.0], 225, [1.5, 0.0, 0.0]);
    tracking.step(&params, &sample, TARGET, ANCHOR, true);
    assert_eq!(tracking.target_m(&sample), Some([4.25, 0.0, 0.0]));
}

#[test]
fn what_is_gone_is_known_nowhere() {
    let params = params();
    let mut tracking = Tracking::new();
    let seen = sample(1, [0.0; 3], 1, [0.25, 0.0, 0.0]);
    tracking.step(&params, &seen, TARGET, ANCHOR, true);
    assert!(tracking.is_carried());
    let mut gone = seen;
    gone.object_count = 0;
    tracking.step(&params, &gone, TARGET, ANCHOR, true);
    assert!(!tracking.is_carried());
    assert_eq!(
        (tracking.target_m(&gone), tracking.anchor_m()),
        (None, None)
    );
}

#[test]
fn another_object_is_not_averaged_with_the_last_one() {
    let params = params();
    let mut tracking = Tracking::new();
    let first = sample(1, AWAY, 1, [0.25, 0.0, 0.0]);
    tracking.step(&params, &first, TARGET, ANCHOR, false);
    let second = sample(2, AWAY, 2, [0.25, 0.0, 0.0]);
    tracking.step(&params, &second, ANCHOR, TARGET, false);
    assert_eq!(tracking.anchor_m(), Some([0.25, 0.0, 0.0]));
    assert_eq!(tracking.target_m(&second), Some([0.0, 0.0, 0.25]));
    // Nor if it was seen at the same moment.
    let mut again = Tracking::new();
    again.step(&params, &first, TARGET, ANCHOR, false);
    again.step(&params, &first, ANCHOR, TARGET, false);
    assert_eq!(again.anchor_m(), Some([0.25, 0.0, 0.0]));
    assert_eq!(again.target_m(&first), Some([0.0, 0.0, 0.25]));
}

#[test]
fn what_the_hand_holds_unseen_stays_where_it_was_seen_last() {
    let params = params();
    let mut tracking = Tracking::new();
    let near = sample(1, [0.0; 3], 1, [0.25, 0.0, 0.0]);
    tracking.step(&params, &near, TARGET, ANCHOR, true);
    let mut unseen = sample(2, [0.0; 3], 2, [4.0, 0.0, 0.0]);
    unseen.objects[0].visible = 0;
    tracking.step(&params, &unseen, TARGET, ANCHOR, true);
    assert_eq!(tracking.target_m(&unseen), Some([0.25, 0.0, 0.0]));
    // Nor is one look taken for two.
    let mut repeated = sample(3, [0.0; 3], 2, [0.375, 0.0, 0.0]);
    tracking.step(&params, &repeated, TARGET, ANCHOR, true);
    assert_eq!(tracking.target_m(&repeated), Some([0.25, 0.0, 0.0]));
    repeated.objects[0].stamp_ns = 3;
    tracking.step(&params, &repeated, TARGET, ANCHOR, true);
    assert_eq!(tracking.target_m(&repeated), Some([0.28125, 0.0, 0.0]));
}
