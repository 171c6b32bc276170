//! The scripted expert: what a demonstrator would do next, whatever happened before.
//!
//! It is a function of what can be seen: where the hand is and how fast, how wide the gripper
//! stands, where the target and its destination are. It can therefore be asked in any state that a
//! learner gets into (DAgger, Ross et al. 2011), and the network that learns from it is asked for a
//! function, not for a history. A chunk is that function, applied step after step to a model of how
//! the arm answers.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sim_harness::SimError;
use sim_harness::action::{Action, POLICY_STEP_S, ROTATION_SCALE_RAD};
use sim_harness::backbone::bc::{CHUNK_STEPS, LATENCY_S};
use sim_harness::backbone::{Demonstration, Observation, PointMass};
use sim_harness::object::{ObjectClass, ObjectKind, Shape};
use sim_harness::panda::{
    GRIPPER_CLOSE_SETPOINT_M, GRIPPER_OPEN_M, GRIPPER_OPEN_SETPOINT_M, GRIPPER_RATE_M_S,
};
use sim_harness::pose::Pose;
use sim_harness::sim::Sim;
use sim_harness::suite::{Suite, Task};

/// Speed of free motion, in action units.
const SPEED: f64 = 0.9;
/// At a waypoint: within this distance to the side, and not higher than this above it, m.
const ARRIVED_M: f64 = 0.010;
/// Lower than a waypoint by no more than this, m.
const TOO_LOW_M: f64 = 0.020;
/// At rest, as far as closing and opening are concerned, m/s.
const SLOW_M_S: f64 = 0.06;
/// Nearer than this to the side, it goes down: a can leaves 9 mm on either side, m.
const GRASP_FUNNEL_M: f64 = 0.005;
/// The same for what is carried, m.
const RELEASE_FUNNEL_M: f64 = 0.018;
/// Farther off than a funnel's neck by this much, all of its height is kept, m.
const FUNNEL_WIDTH_M: f64 = 0.012;
/// The target's centre is this near to the destination's, to the side: there it is let go, m.
const CENTRED_M: f64 = 0.018;
/// Too low by this much, the motion to the side begins to slow down ...
const LOW_M: f64 = 0.02;
/// ... and by this much more it has ended: first it rises, m.
const TOO_LOW_FOR_SIDEWAYS_M: f64 = 0.03;
/// The tool is this near to where it took hold, to the side: the target is in the hand, m.
const IN_HAND_M: f64 = 0.035;
/// The same in height: a bowl that is held by its rim hangs lower than demonstrated, m.
const IN_HAND_Z_M: core::ops::Range<f64> = -0.03..0.05;
/// As wide as the target, to within this, m.
const WIDTH_M: f64 = 0.006;
/// Narrower than open by this much: not open, m.
const NOT_OPEN_M: f64 = 0.010;
/// The fingers are told to go this much farther than they can, each, before the lift, m.
const PRESSING_M: f64 = 0.010;
/// This much higher than at the start, the target is off its support, m.
const LIFTED_M: f64 = 0.005;
/// The target's centre is this near to the destination's, m: delivered.
const DELIVERED_M: f64 = 0.05;
/// How far the tool rises after the release, m.
const RETREAT_M: f64 = 0.08;
/// A target that was pushed farther than this cannot be seen from its remembered place, m.
const LOST_M: f64 = 0.05;
/// A target that leans more than this has fallen: cosine.
const UPRIGHT: f64 = 0.9;

/// What an action is decided on; it is predicted over the steps of a chunk.
#[derive(Clone, Copy, Debug)]
struct State {
    mass: PointMass,
    width_m: f64,
    target_m: Vector3<f64>,
    /// Where each finger is told to be, from the middle, m.
    set_point_m: f64,
}

/// What the hand should do now: go somewhere, with the gripper open or shut.
struct Intent {
    to_m: Vector3<f64>,
    gripper: f64,
}

/// A demonstrator of one task in one scene.
#[derive(Clone, Debug)]
pub(crate) struct Expert {
    target: usize,
    destination: usize,
    start_m: Vector3<f64>,
    /// From the target's centre to the tool when it takes hold.
    offset_m: Vector3<f64>,
    /// From the destination's centre to the tool when it lets go.
    release_m: Vector3<f64>,
    hover_above_m: f64,
    carry_z_m: f64,
    held_width_m: f64,
    level: UnitQuaternion<f64>,
}

impl Expert {
    /// A demonstrator for a scene of the task.
    ///
    /// # Errors
    /// If the task's names do not resolve.
    pub(crate) fn new(suite: &Suite, task: &Task, sim: &Sim) -> Result<Self, SimError> {
        let demo = Demonstration::of(suite, task)?;
        let scene = sim.scene();
        let index = |name: &str| -> Result<usize, SimError> {
            let id = scene.by_name(name)?.id;
            Ok(scene.objects().iter().position(|o| o.id == id).unwrap_or(0))
        };
        let (target, destination) = (index(&task.target)?, index(&task.destination)?);
        let placed = &scene.objects()[target];
        let grasp = Vector3::from(demo.grasp_m);
        Ok(Self {
            target,
            destination,
            start_m: placed.pose.position_m.into(),
            offset_m: grasp - Vector3::from(demo.target_m),
            release_m: Vector3::from(demo.release_m) - Vector3::from(demo.destination_m),
            hover_above_m: demo.hover_z_m - demo.grasp_m[2],
            carry_z_m: demo.carry_z_m,
            held_width_m: held_width_m(&placed.kind),
            level: rotation(&sim.robot().tcp),
        })
    }

    /// Whether the target is where the motion can still reach it: in its place, in the hand or
    /// delivered. Elsewhere there is nothing to teach.
    pub(crate) fn can_teach(&self, seen: &Observation) -> bool {
        let state = self.state(seen);
        let pose = &seen.objects[self.target].pose;
        let in_place = (state.target_m - self.start_m).xy().norm() < LOST_M;
        let upright = pose.uprightness() > UPRIGHT;
        self.in_hand(&state) || self.delivered(&state, seen) || (in_place && upright)
    }

    /// What to do next.
    pub(crate) fn chunk(&self, seen: &Observation) -> [Action; CHUNK_STEPS] {
        let mut state = self.state(seen);
        // The answer comes late.
        state.mass = state.mass.coasting(LATENCY_S);
        // The tilt is corrected over the first steps, not all at once.
        let mut tilt = (self.level * rotation(&seen.robot.tcp).inverse()).scaled_axis();
        std::array::from_fn(|_| {
            let intent = self.intent(&state, seen);
            let by = state.mass.towards(intent.to_m, SPEED);
            let turn = 0.5 * tilt / ROTATION_SCALE_RAD;
            tilt *= 0.7;
            state = self.after(&state, by, intent.gripper);
            let mut action = [by.x, by.y, by.z, turn.x, turn.y, turn.z, intent.gripper];
            for component in &mut action {
                *component = component.clamp(-1.0, 1.0);
            }
            action
        })
    }

    fn state(&self, seen: &Observation) -> State {
        let mut state = State {
            mass: PointMass {
                position_m: seen.robot.tcp.position_m.into(),
                velocity_m_s: seen.robot.tcp_velocity_m_s.into(),
            },
            width_m: seen.robot.gripper_width_m,
            target_m: seen.objects[self.target].pose.position_m.into(),
            set_point_m: 0.5 * seen.robot.gripper_width_m,
        };
        // Fingers that hold something press; those that have just come to it don't yet.
        if self.gripped(&state) && !self.supported(&state) {
            state.set_point_m = GRIPPER_CLOSE_SETPOINT_M;
        }
        state
    }

    /// The state after one policy step, as far as it can be foreseen.
    fn after(&self, state: &State, by: Vector3<f64>, gripper: f64) -> State {
        let mass = state.mass.after(by);
        let step_m = GRIPPER_RATE_M_S * POLICY_STEP_S;
        let (set_point_m, least_m) = if gripper < 0.0 {
            let up = (state.set_point_m + step_m).min(GRIPPER_OPEN_SETPOINT_M);
            (up, state.width_m)
        } else {
            let down = (state.set_point_m - step_m).max(GRIPPER_CLOSE_SETPOINT_M);
            let around = if self.in_hand(state) {
                self.held_width_m
            } else {
                0.0
            };
            (down, around.min(state.width_m))
        };
        let moved = mass.position_m - state.mass.position_m;
        let carried = gripper > 0.0 && self.gripped(state);
        State {
            mass,
            width_m: least_m.max(2.0 * set_point_m),
            target_m: state.target_m + if carried { moved } else { Vector3::zeros() },
            set_point_m,
        }
    }

    /// Whether the target stands where it stood at the start.
    fn supported(&self, state: &State) -> bool {
        let from_m = state.target_m - self.start_m;
        from_m.z < LIFTED_M && from_m.xy().norm() < LOST_M
    }

    fn in_hand(&self, state: &State) -> bool {
        let from_m = state.mass.position_m - self.grasp_m(state);
        from_m.xy().norm() < IN_HAND_M && IN_HAND_Z_M.contains(&from_m.z)
    }

    fn gripped(&self, state: &State) -> bool {
        self.in_hand(state) && (state.width_m - self.held_width_m).abs() < WIDTH_M
    }

    fn grasp_m(&self, state: &State) -> Vector3<f64> {
        state.target_m + self.offset_m
    }

    fn release_point_m(&self, seen: &Observation) -> Vector3<f64> {
        Vector3::from(seen.objects[self.destination].pose.position_m) + self.release_m
    }

    /// From the target's centre to where it is let go.
    fn way_m(&self, state: &State, seen: &Observation) -> Vector3<f64> {
        let destination = Vector3::from(seen.objects[self.destination].pose.position_m);
        let low_z = self.release_point_m(seen).z - self.offset_m.z;
        Vector3::new(destination.x, destination.y, low_z) - state.target_m
    }

    fn delivered(&self, state: &State, seen: &Observation) -> bool {
        let way = self.way_m(state, seen);
        way.xy().norm() < DELIVERED_M && way.z > -ARRIVED_M
    }

    fn intent(&self, state: &State, seen: &Observation) -> Intent {
        let here = state.mass.position_m;
        let release = self.release_point_m(seen);
        let stay = |gripper: f64| Intent {
            to_m: here,
            gripper,
        };
        if self.gripped(state) {
            let way = self.way_m(state, seen);
            let low = way.z > -ARRIVED_M && slow(state);
            // Heights are those of what is carried: it may hang lower than demonstrated.
            let lower = Vector3::new(release.x, release.y, here.z + way.z);
            return if low && way.xy().norm() < CENTRED_M {
                stay(-1.0)
            } else {
                self.carry(state, lower, here.z + way.z + self.carry_z_m - release.z)
            };
        }
        let open = state.width_m > GRIPPER_OPEN_M - NOT_OPEN_M;
        if self.delivered(state, seen) {
            let up = Vector3::new(here.x, here.y, here.z.max(release.z + RETREAT_M));
            return Intent {
                to_m: if open { up } else { here },
                gripper: -1.0,
            };
        }
        if open {
            return self.approach(state);
        }
        // Closing around the target, or on nothing.
        let closing = self.in_hand(state) && state.width_m > self.held_width_m;
        stay(if closing { 1.0 } else { -1.0 })
    }

    fn carry(&self, state: &State, release: Vector3<f64>, carry_z_m: f64) -> Intent {
        let presses = state.set_point_m < 0.5 * self.held_width_m - PRESSING_M;
        let to_m = if self.supported(state) && !presses {
            state.mass.position_m
        } else {
            funnelled(state, release, carry_z_m, RELEASE_FUNNEL_M)
        };
        Intent { to_m, gripper: 1.0 }
    }

    fn approach(&self, state: &State) -> Intent {
        let grasp = self.grasp_m(state);
        let hover_z_m = grasp.z + self.hover_above_m;
        Intent {
            to_m: funnelled(state, grasp, hover_z_m, GRASP_FUNNEL_M),
            gripper: if arrived(state, grasp) { 1.0 } else { -1.0 },
        }
    }
}

/// The next waypoint on the way to a point from above: over a funnel whose neck is as wide as
/// given, and whose edge is at a height. No step of it depends on which side of a border it is:
/// a network follows what is continuous.
fn funnelled(state: &State, to_m: Vector3<f64>, edge_z_m: f64, neck_m: f64) -> Vector3<f64> {
    let here = state.mass.position_m;
    let aside = (to_m - here).xy();
    let open = ((aside.norm() - neck_m) / FUNNEL_WIDTH_M).clamp(0.0, 1.0);
    let z = to_m.z + open * (edge_z_m - to_m.z);
    let share = (1.0 - (z - here.z - LOW_M) / TOO_LOW_FOR_SIDEWAYS_M).clamp(0.0, 1.0);
    Vector3::new(here.x + share * aside.x, here.y + share * aside.y, z)
}

fn slow(state: &State) -> bool {
    state.mass.velocity_m_s.norm() < SLOW_M_S
}

fn arrived(state: &State, at_m: Vector3<f64>) -> bool {
    let from_m = state.mass.position_m - at_m;
    slow(state) && from_m.xy().norm() < ARRIVED_M && (-TOO_LOW_M..ARRIVED_M).contains(&from_m.z)
}

fn rotation(pose: &Pose) -> UnitQuaternion<f64> {
    let [w, x, y, z] = pose.orientation;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// How wide the gripper stands around a thing that is held as demonstrated, m.
fn held_width_m(kind: &ObjectKind) -> f64 {
    let [x, y, _] = kind.half_extent_m();
    match (kind.class, &kind.shape) {
        (ObjectClass::Bowl, Shape::Bowl { wall_m, .. }) => *wall_m,
        (_, Shape::Bottle { neck_radius_m, .. }) => 2.0 * neck_radius_m,
        _ => 2.0 * x.min(y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An expert for a task, and what is seen at the start.
    fn scene(suite: &str, task: &str) -> (Expert, Observation) {
        let suite = Suite::embedded(suite).unwrap();
        let task = suite.task(task).unwrap();
        let sim = Sim::new(suite.nominal_scene(task).unwrap()).unwrap();
        let expert = Expert::new(&suite, task, &sim).unwrap();
        (expert, Observation::of(&sim, &task.instruction, 0))
    }

    fn put_hand(seen: &mut Observation, at_m: Vector3<f64>, width_m: f64) {
        seen.robot.tcp.position_m = at_m.into();
        seen.robot.tcp_velocity_m_s = [0.0; 3];
        seen.robot.gripper_width_m = width_m;
    }

    fn grippers(actions: &[Action]) -> Vec<f64> {
        actions.iter().map(|a| a[6]).collect()
    }

    #[test]
    fn it_goes_to_the_target_with_an_open_hand() {
        let (expert, seen) = scene("object", "milk");
        let chunk = expert.chunk(&seen);
        let way = seen.objects[expert.target].pose.position_m[1] - seen.robot.tcp.position_m[1];
        assert!(chunk[0][1] * way > 0.0, "{:?}", chunk[0]);
        assert_eq!(grippers(&chunk), [-1.0; CHUNK_STEPS]);
    }

    #[test]
    fn what_it_does_depends_on_what_it_sees_only() {
        for (suite, task) in [("object", "alphabet_soup"), ("spatial", "table_center")] {
            let (expert, mut seen) = scene(suite, task);
            let target = Vector3::from(seen.objects[expert.target].pose.position_m);
            let grasp = target + expert.offset_m;
            // Around the target it closes, whatever came before.
            put_hand(&mut seen, grasp, GRIPPER_OPEN_M);
            assert_eq!(grippers(&expert.chunk(&seen)), [1.0; CHUNK_STEPS]);
            // Closed on it, it presses and lifts.
            put_hand(&mut seen, grasp, expert.held_width_m);
            let lifting = expert.chunk(&seen);
            assert!(
                lifting[0][2].abs() < 0.1 && lifting[7][2] > 0.5,
                "{lifting:?}"
            );
            // Closed on nothing, it opens.
            put_hand(&mut seen, grasp + Vector3::new(0.0, 0.0, 0.15), 0.0);
            assert_eq!(grippers(&expert.chunk(&seen)), [-1.0; CHUNK_STEPS]);
            // Too low beside the target, it rises before it goes there.
            put_hand(
                &mut seen,
                grasp + Vector3::new(0.06, 0.0, 0.0),
                GRIPPER_OPEN_M,
            );
            let rising = expert.chunk(&seen)[0];
            assert!(rising[2] > 0.5 && rising[0].abs() < 0.1, "{rising:?}");
            // At the destination, holding, it lets go.
            let release = expert.release_point_m(&seen);
            let place = seen.objects[expert.destination].pose.position_m;
            let low_z = release.z - expert.offset_m.z;
            seen.objects[expert.target].pose.position_m = [place[0], place[1], low_z];
            put_hand(&mut seen, release, expert.held_width_m);
            assert_eq!(grippers(&expert.chunk(&seen)), [-1.0; CHUNK_STEPS]);
            // When it has let go, it rises with an open hand.
            put_hand(&mut seen, release, GRIPPER_OPEN_M);
            let leaving = expert.chunk(&seen);
            assert!(leaving[0][2] > 0.5, "{leaving:?}");
            assert_eq!(grippers(&leaving), [-1.0; CHUNK_STEPS]);
        }
    }

    #[test]
    fn it_does_not_teach_what_cannot_be_seen() {
        let (expert, mut seen) = scene("object", "milk");
        assert!(expert.can_teach(&seen));
        seen.objects[expert.target].pose.position_m[0] += 2.0 * LOST_M;
        assert!(!expert.can_teach(&seen));
        seen.objects[expert.target].pose.position_m[0] -= 2.0 * LOST_M;
        seen.objects[expert.target].pose.orientation = [0.8, 0.6, 0.0, 0.0];
        assert!(!expert.can_teach(&seen));
    }
}
