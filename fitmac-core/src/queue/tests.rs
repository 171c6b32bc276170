//! The queue and an action at the edge of its box.

use super::*;
use crate::params::PolicyGripper;

fn chunk(length: usize) -> ActionChunk {
    let mut chunk = ActionChunk {
        horizon: length as u32,
        ..ActionChunk::default()
    };
    for (n, action) in chunk.actions.iter_mut().enumerate() {
        action[0] = n as f32 / 128.0;
    }
    chunk
}

#[test]
fn a_refill_takes_what_is_not_overtaken_and_gives_it_out_once() {
    let params = Params::guarded();
    for (consumed, horizon, expected) in [
        (0, 8, 0..8),
        (0, 20, 0..10),
        (3, 4, 3..7),
        (3, 8, 3..10),
        (10, 8, 10..10),
        (12, 8, 10..10),
    ] {
        let mut queue = ActionQueue::new();
        let taken = queue.fill(&chunk(10), consumed, horizon);
        assert_eq!((taken, queue.len()), (expected.len(), expected.len()));
        assert_eq!(queue.is_empty(), expected.is_empty());
        for n in expected.clone() {
            let action = queue.pop(&params).map(|a| a.action[0]);
            assert_eq!(action, Some(n as f64 / 128.0));
        }
        assert_eq!(queue.pop(&params), None);
        assert_eq!(queue.played(), expected.len() as u64);
    }
}

#[test]
fn what_lies_outside_the_box_is_clamped_to_it_and_flagged() {
    let params = Params::guarded();
    for (raw, action, clamped) in [
        (1.0, 1.0, false),
        (1.5, 1.0, true),
        (-1.0, -1.0, false),
        (-1.5, -1.0, true),
        (-0.0, -0.0, false),
    ] {
        let found = decode(&params, [raw; ACTION_DIM]);
        assert_eq!(found.clamped, clamped, "{raw}");
        let same = |x: f64| x.to_bits() == f64::to_bits(action);
        assert!(found.action.into_iter().all(same), "{raw}");
    }
}

#[test]
fn a_gripper_that_opens_at_one_opens_above_a_half() {
    let mut params = Params::guarded();
    params.policy_gripper = PolicyGripper::OneOpen;
    for (raw, action) in [(0.0, 1.0), (0.5, 1.0), (0.51, -1.0), (1.0, -1.0)] {
        let found = decode(&params, [0.25, 0.0, 0.0, 0.0, 0.0, 0.0, raw]);
        assert_eq!(found.action, [0.25, 0.0, 0.0, 0.0, 0.0, 0.0, action]);
    }
}
