//! What the network sees: numbers made of an observation.

use nalgebra::{Quaternion, UnitQuaternion};

use crate::backbone::{Observation, SeenObject};
use crate::pose::distance_xy_m;

/// Numbers of the robot's own state: LIBERO's eight, which are position (m), axis-angle (rad) and
/// the two fingers (m), and the velocity of the tool (m/s): an answer comes late, and the arm goes
/// on until then.
pub const PROPRIO: usize = 11;
/// Objects that are seen; more are ignored.
pub const SLOTS: usize = 8;
/// Numbers of an object: position (m), colour (0 to 1), mean half extent (m).
pub const SLOT_WIDTH: usize = 7;
/// Which numbers of an object are its place.
pub const PLACES: core::ops::Range<usize> = 0..3;
/// Which numbers of an object are its colour.
pub const COLOURS: core::ops::Range<usize> = 3..6;
/// Where the view from the hand begins.
pub const NEAR_AT: usize = PROPRIO + SLOTS * SLOT_WIDTH;
/// Numbers of an object in the view from the hand: its centre relative to the tool (m).
pub const NEAR_WIDTH: usize = 3;
/// Buckets of the hashed bag of words.
pub const WORDS: usize = 32;
/// Where the words begin.
pub const WORDS_AT: usize = NEAR_AT + SLOTS * NEAR_WIDTH;
/// Numbers in all.
pub const INPUTS: usize = WORDS_AT + WORDS;
/// Actions of an answer; all are played before the next query.
pub const CHUNK_STEPS: usize = 8;
/// Numbers of an answer: for each action six increments, and the log-odds of closing the gripper.
pub const OUTPUTS: usize = 7 * CHUNK_STEPS;

/// The view from the hand: how far to the sides it reaches, m, and where it has faded out.
const VIEW_ASIDE_M: [f64; 2] = [0.06, 0.09];
/// The same up and down. What lies below the hand on its way is not seen, what it grasps is.
const VIEW_DEPTH_M: [f64; 2] = [0.12, 0.16];

/// The network's input. An empty slot is all zeros. Objects take their slots in the order of the
/// observation, which is that of the scene's ids.
#[must_use]
pub fn features(observation: &Observation) -> [f32; INPUTS] {
    let mut all = [0.0; INPUTS];
    let robot = &observation.robot;
    let [w, x, y, z] = robot.tcp.orientation;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).scaled_axis();
    let finger_m = 0.5 * robot.gripper_width_m;
    // The hand points down: half a turn about a horizontal axis, whose sign is arbitrary.
    let turn = if turn.x < 0.0 {
        turn * (1.0 - core::f64::consts::TAU / turn.norm())
    } else {
        turn
    };
    let [px, py, pz] = robot.tcp.position_m;
    let [vx, vy, vz] = robot.tcp_velocity_m_s;
    let proprio = [
        px, py, pz, turn.x, turn.y, turn.z, finger_m, -finger_m, vx, vy, vz,
    ];
    for (slot, value) in all.iter_mut().zip(proprio) {
        *slot = value as f32;
    }
    let slots = all[PROPRIO..NEAR_AT].chunks_exact_mut(SLOT_WIDTH);
    for (slot, object) in slots.zip(&observation.objects) {
        slot.copy_from_slice(&looks(object));
    }
    let views = all[NEAR_AT..WORDS_AT].chunks_exact_mut(NEAR_WIDTH);
    for (view, object) in views.zip(&observation.objects) {
        view.copy_from_slice(&from_hand(robot.tcp.position_m, object));
    }
    for word in observation.prompt.split_whitespace() {
        all[WORDS_AT + bucket(word)] = 1.0;
    }
    all
}

fn looks(object: &SeenObject) -> [f32; SLOT_WIDTH] {
    let [x, y, z] = object.pose.position_m.map(|v| v as f32);
    let [red, green, blue] = object.colour;
    let size = object.half_extent_m.iter().sum::<f64>() / 3.0;
    [x, y, z, red, green, blue, size as f32]
}

/// An object as a camera at the hand shows it: relative to the tool, and only if it is near.
fn from_hand(tool_m: [f64; 3], object: &SeenObject) -> [f32; NEAR_WIDTH] {
    let place_m = object.pose.position_m;
    let rel_m: [f64; 3] = std::array::from_fn(|i| place_m[i] - tool_m[i]);
    let aside = share(distance_xy_m(place_m, tool_m), VIEW_ASIDE_M);
    let depth = share(rel_m[2].abs(), VIEW_DEPTH_M);
    rel_m.map(|v| (aside * depth * v) as f32)
}

/// How clearly something is seen at a distance: 1 up to the first, 0 from the second on.
fn share(distance_m: f64, [all, none]: [f64; 2]) -> f64 {
    ((none - distance_m) / (none - all)).clamp(0.0, 1.0)
}

/// The bucket of a word: FNV-1a of its lower-case letters.
fn bucket(word: &str) -> usize {
    let letters = word.bytes().map(|b| b.to_ascii_lowercase());
    let hash = letters.fold(0x811c_9dc5_u32, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    });
    hash as usize % WORDS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Sim;
    use crate::suite::Suite;

    #[test]
    fn words_fill_buckets_whatever_their_case() {
        // FNV-1a of "a" is 0xe40c292c.
        assert_eq!(bucket("a"), 0xe40c_292c % WORDS);
        assert_eq!(bucket("Bowl"), bucket("bowl"));
    }

    #[test]
    fn an_observation_fills_its_places() {
        let suite = Suite::embedded("object").unwrap();
        let scene = suite.nominal_scene(&suite.tasks[0]).unwrap();
        let sim = Sim::new(scene).unwrap();
        let seen = Observation::of(&sim, "pick it up", 0);
        let all = features(&seen);
        assert!((f64::from(all[2]) - seen.robot.tcp.position_m[2]).abs() < 1e-6);
        assert!(all[3] > 3.0, "the hand points down: {:?}", &all[3..6]);
        let first = &all[PROPRIO..PROPRIO + SLOT_WIDTH];
        assert_eq!(first, looks(&seen.objects[0]));
        assert_eq!(all[WORDS_AT..].iter().sum::<f32>(), 3.0);
        let empty = PROPRIO + seen.objects.len() * SLOT_WIDTH;
        assert!(all[empty..NEAR_AT].iter().all(|v| *v == 0.0));
    }

    #[test]
    fn the_hand_sees_what_is_near() {
        let suite = Suite::embedded("object").unwrap();
        let scene = suite.nominal_scene(&suite.tasks[0]).unwrap();
        let sim = Sim::new(scene).unwrap();
        let mut seen = Observation::of(&sim, "", 0);
        let [x, y, z] = seen.robot.tcp.position_m;
        let view = |seen: &Observation| {
            let all = features(seen);
            [all[NEAR_AT], all[NEAR_AT + 1], all[NEAR_AT + 2]]
        };
        let cases = [
            ([x + 0.03, y, z - 0.05], [0.03, 0.0, -0.05]),
            ([x, y - 0.075, z - 0.10], [0.0, -0.0375, -0.05]),
            ([x, y + 0.02, z - 0.14], [0.0, 0.01, -0.07]),
            ([x + 0.10, y, z], [0.0, 0.0, 0.0]),
            ([x, y, z - 0.17], [0.0, 0.0, 0.0]),
        ];
        for (place, expected) in cases {
            seen.objects[0].pose.position_m = place;
            for (value, expected) in view(&seen).iter().zip(expected) {
                assert!(
                    (value - expected).abs() < 1e-5,
                    "{:?} {expected}",
                    view(&seen)
                );
            }
        }
    }
}
