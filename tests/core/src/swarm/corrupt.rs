//! Broken messages, each broken in one way.

use fitmac_core::message::{ActionChunk, GroundingRecord, StateSample};
use rand::{RngExt, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

/// Numbers that no sensor means.
const ODD: [f64; 9] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e300,
    -1e300,
    f64::MIN_POSITIVE / 4.0,
    -0.0,
    1000.0,
    2.0,
];

fn odd(rng: &mut ChaCha8Rng) -> f64 {
    ODD.choose(rng).copied().unwrap_or(f64::NAN)
}

pub(super) fn state(rng: &mut ChaCha8Rng, state: &mut StateSample) {
    let axis = rng.random_range(0..3);
    let slot = rng.random_range(0..4);
    match rng.random_range(0..17) {
        0 => state.ee_position_m[axis] = odd(rng),
        1 => state.ee_orientation[slot] = odd(rng),
        2 => state.ee_velocity_m_s[axis] = odd(rng),
        3 => state.gripper_width_m = odd(rng),
        4 => state.joint_position_rad[slot] = odd(rng),
        5 => state.joint_velocity_rad_s[slot] = odd(rng),
        6 => state.objects[slot].position_m[axis] = odd(rng),
        7 => state.objects[slot].orientation[slot] = odd(rng),
        8 => state.objects[slot].half_extent_m[axis] = odd(rng),
        9 => state.objects[slot].grasp_class = rng.random(),
        10 => state.objects[slot].visible = rng.random(),
        11 => state.object_count = rng.random_range(0..50),
        12 => state.sequence = state.sequence.wrapping_sub(rng.random_range(0..5)),
        13 => state.session = rng.random_range(0..3),
        14 => state.sequence = rng.random(),
        15 => state.stamp_ns = state.stamp_ns.wrapping_add(rng.random_range(0..20_000_000)),
        _ => state.ee_position_m[axis] += rng.random_range(-0.5..0.5),
    }
}

pub(super) fn chunk(rng: &mut ChaCha8Rng, chunk: &mut ActionChunk) {
    let action = rng.random_range(0..8);
    let lane = rng.random_range(0..7);
    match rng.random_range(0..15) {
        0 => chunk.actions[action][lane] = odd(rng) as f32,
        1 => chunk.actions[action][lane] *= 3.0,
        2 => chunk.horizon = *[0, 1, 64, 65, u32::MAX].choose(rng).unwrap_or(&0),
        3 => chunk.sequence = chunk.sequence.wrapping_sub(rng.random_range(0..3)),
        4 => chunk.session = rng.random_range(0..3),
        5 => {
            chunk.epoch = chunk
                .epoch
                .wrapping_add(rng.random_range(0..3))
                .wrapping_sub(1)
        }
        6 => chunk.subtask = rng.random_range(0..3),
        7 => chunk.query_id = chunk.query_id.wrapping_sub(rng.random_range(0..2)),
        8 => chunk.action_space = rng.random_range(0..4),
        9 => chunk.frame = rng.random_range(0..4),
        10 => chunk.gripper = rng.random_range(0..4),
        11 => chunk.observation_ns = chunk.observation_ns.saturating_sub(3_000_000_000),
        12 => chunk.sequence = rng.random(),
        13 => chunk.stamp_ns = chunk.stamp_ns.wrapping_add(20_000_000),
        _ => chunk.observation_ns = chunk.observation_ns.wrapping_add(20_000_000),
    }
}

pub(super) fn grounding(rng: &mut ChaCha8Rng, record: &mut GroundingRecord) {
    let axis = rng.random_range(0..3);
    match rng.random_range(0..16) {
        0 => record.confidence = odd(rng),
        1 => record.candidate_count = rng.random(),
        2 => record.target = rng.random_range(0..8),
        3 => record.epoch = record.epoch.wrapping_sub(rng.random_range(0..3)),
        4 => record.epoch = record.epoch.wrapping_add(rng.random_range(0..3)),
        5 => record.destination_kind = rng.random_range(0..5),
        6 => record.relation = rng.random_range(0..5),
        7 => record.provenance = rng.random_range(0..5),
        8 => record.region_offset_m[axis] = odd(rng),
        9 => record.region_half_extent_m[axis] = odd(rng),
        10 => record.subtask = rng.random_range(0..3),
        11 => record.sequence = record.sequence.wrapping_sub(rng.random_range(0..3)),
        12 => record.sequence = rng.random(),
        13 => record.epoch = record.epoch.wrapping_add(rng.random::<u32>().into()),
        14 => {
            for candidate in &mut record.candidates {
                candidate.compatible = rng.random_range(0..3);
            }
        }
        _ => record.destination = rng.random_range(0..8),
    }
}
