//! The lock at its limits.

use super::*;
use crate::message::{CANDIDATE_CAPACITY, ObjectSample};

fn record(target: ObjectId, confidence: f64) -> GroundingRecord {
    let mut candidates = [Candidate::default(); CANDIDATE_CAPACITY];
    candidates[0] = Candidate {
        id: 1,
        compatible: 1,
        ..Candidate::default()
    };
    GroundingRecord {
        epoch: 1,
        target,
        confidence,
        candidate_count: 1,
        candidates,
        ..GroundingRecord::default()
    }
}

fn locked(confidence: f64) -> Lock {
    let mut lock = Lock::open(0);
    lock.commit(&record(1, confidence));
    lock
}

/// Objects 1, 2, ... at these places, seen at `stamp_ns`.
fn sample(places: &[Vector3], stamp_ns: u64) -> StateSample {
    let mut sample = StateSample::default();
    for (n, (object, &position_m)) in sample.objects.iter_mut().zip(places).enumerate() {
        *object = ObjectSample {
            id: n as ObjectId + 1,
            visible: 1,
            stamp_ns,
            position_m,
            ..ObjectSample::default()
        };
    }
    sample.object_count = places.len() as u32;
    sample
}

#[test]
fn confidence_lasts_as_long_as_the_target_was_seen_lately_or_is_carried() {
    let params = LockParams {
        pose_lost_ms: 100,
        ..LockParams::default()
    };
    let lock = locked(0.75);
    let seen = sample(&[[0.0; 3]], 1_000);
    let kappa = |now_ns, carried| lock.kappa(&params, now_ns, Some(&seen), carried);
    assert_eq!(kappa(100_001_000, false), 0.75);
    assert_eq!(kappa(100_001_001, false), 0.0);
    assert_eq!(kappa(100_001_001, true), 0.75);
    assert_eq!(lock.kappa(&params, 0, None, false), 0.0);
    assert_eq!(Lock::open(3).kappa(&params, 1_000, Some(&seen), true), 0.0);
}

#[test]
fn a_lock_is_doubted_below_the_least_confidence_and_after_so_many_flaps() {
    let params = LockParams {
        kappa_min: 0.25,
        flaps: 3,
        ..LockParams::default()
    };
    let mut lock = locked(0.75);
    assert_eq!(lock.evidence(&params, 0.25), 0);
    assert_eq!(lock.evidence(&params, 0.249), evidence::KAPPA_LOW);
    for _ in 0..2 {
        lock.observe(&record(2, 0.5));
        assert_eq!(lock.evidence(&params, 0.25), 0);
    }
    lock.observe(&record(2, 0.5));
    assert_eq!(lock.evidence(&params, 0.25), evidence::FLAPPING);
    assert_eq!(lock.target(), 1, "it did not move");
    lock.observe(&GroundingRecord {
        candidate_count: 0,
        ..record(1, 0.5)
    });
    let doubts = evidence::FLAPPING | evidence::LOCK_INCOMPATIBLE;
    assert_eq!(lock.evidence(&params, 0.25), doubts);
    assert_eq!(Lock::open(0).evidence(&params, 1.0), evidence::NO_LOCK);
}

#[test]
fn a_jump_is_more_than_the_limit_with_the_hand_farther_off_than_it_can_hold() {
    let params = LockParams {
        jump_m: 0.5,
        ..LockParams::default()
    };
    let gripper = Gripper {
        held_radius_m: 0.25,
        ..Gripper::default()
    };
    let jumps = |hand_m: [f64; 2], target_m: [f64; 2]| {
        let at = |n: usize| Sighting {
            hand_m: [hand_m[n], 0.0, 0.0],
            target_m: [target_m[n], 0.0, 0.0],
        };
        let mut lock = locked(1.0);
        lock.watch(&params, &gripper, Some(at(0)), Some(at(1)));
        lock.evidence(&params, 1.0) == evidence::LOCK_JUMPED
    };
    assert!(jumps([2.0, 2.0], [0.0, 0.501]));
    assert!(!jumps([2.0, 2.0], [0.0, 0.5]));
    assert!(!jumps([0.25, 2.0], [0.0, 1.0]), "it was at hand");
    assert!(!jumps([2.0, 0.75], [0.0, 1.0]), "it is at hand");
    assert!(jumps([0.251, 0.749], [0.0, 1.0]));
}

#[test]
fn only_a_sound_direct_destination_is_an_anchor() {
    let direct = GroundingRecord {
        destination: 3,
        destination_kind: DestinationKind::Direct.code(),
        relation: PlaceRelation::In.code(),
        region_offset_m: [0.1, 0.2, 0.3],
        ..record(1, 1.0)
    };
    let anchor = |record: &GroundingRecord| {
        let mut lock = Lock::open(0);
        lock.commit(record);
        lock.anchor().copied()
    };
    let found = anchor(&direct).map(|a| (a.object, a.relation, a.offset_m));
    assert_eq!(found, Some((3, PlaceRelation::In, [0.1, 0.2, 0.3])));
    for spoilt in [
        GroundingRecord {
            destination: 0,
            ..direct
        },
        GroundingRecord {
            relation: 99,
            ..direct
        },
        GroundingRecord {
            destination_kind: DestinationKind::Relational.code(),
            ..direct
        },
    ] {
        assert_eq!(anchor(&spoilt), None);
    }
    // A relation is remembered as one: the policy places, and nothing is missing.
    let kind = |kind: DestinationKind| {
        let mut lock = Lock::open(0);
        lock.commit(&GroundingRecord {
            destination_kind: kind.code(),
            ..record(1, 1.0)
        });
        lock.binding().map(|b| b.destination)
    };
    assert_eq!(
        kind(DestinationKind::Relational),
        Some(Destination::Relational)
    );
    assert_eq!(
        kind(DestinationKind::Unresolved),
        Some(Destination::Unresolved)
    );
}

#[test]
fn the_closest_candidate_counts_height_by_its_weight_and_ties_go_to_the_lowest() {
    let params = LockParams {
        lambda_z: 0.5,
        ..LockParams::default()
    };
    let closest = |places: &[Vector3], ids: &[ObjectId]| {
        let candidates: [Candidate; 3] = core::array::from_fn(|n| Candidate {
            id: ids.get(n).copied().unwrap_or(0),
            compatible: u8::from(n < ids.len()),
            ..Candidate::default()
        });
        closest_candidate(&params, &sample(places, 0), &candidates)
    };
    assert_eq!(
        geometric_score(&params, [1.0, 0.0, 1.0], [4.0, 4.0, 3.0]),
        6.0
    );
    assert_eq!(
        geometric_score(&params, [1.0, 0.0, 3.0], [4.0, 4.0, 1.0]),
        6.0
    );
    let (near, high, far) = ([1.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 3.0, 0.0]);
    assert_eq!(closest(&[far, high, near], &[1, 2, 3]), Some(3));
    assert_eq!(closest(&[far, high, near], &[1, 2]), Some(2));
    let same = [near, near, near];
    assert_eq!(closest(&same, &[3, 2]), Some(2));
    assert_eq!(closest(&same, &[2, 3]), Some(2));
    assert_eq!(closest(&[[f64::NAN; 3], far], &[1, 2]), Some(2));
    assert_eq!(closest(&[], &[1, 2]), None);
}
