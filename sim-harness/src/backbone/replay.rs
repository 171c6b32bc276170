//! S1 and S2: policies that replay what they memorised.
//!
//! At the first query the nearest remembered scene is recalled by the look and place of things;
//! the text is ignored. The hand then goes where it went in training. With a servo radius (S2) it
//! corrects for whatever stands within that radius of the remembered place, and looks no further.
//!
//! Like a network, it has no memory of what it did beyond what it can see: if somebody else moved
//! the arm or the gripper, it picks the motion up at the stage that the scene shows.

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::memory::{Demonstration, Memory};
use super::motion::PointMass;
use super::{Backbone, Chunk, Observation, SeenObject};
use crate::action::{Action, ROTATION_SCALE_RAD};
use crate::panda::GRIPPER_OPEN_M;
use crate::pose::distance_xy_m;

/// Beyond the servo radius by this factor the correction still acts, but grows no further.
const SERVO_REACH: f64 = 1.5;
/// The tool is at a waypoint within this distance, m.
const ARRIVED_M: f64 = 0.008;
/// On the way between high waypoints, m.
const PASSED_M: f64 = 0.02;
/// Policy steps for which the gripper is commanded shut before the lift.
const CLOSE_STEPS: u32 = 9;
/// Policy steps for which the object is held still above its place.
const POISE_STEPS: u32 = 4;
/// Policy steps for which the gripper is commanded open before the retreat.
const OPEN_STEPS: u32 = 6;
/// How far the tool rises after the release, m.
const RETREAT_M: f64 = 0.08;
/// Narrower than open by this much: something else than an open gripper, m.
const NOT_OPEN_M: f64 = 0.010;
/// Farther than this from where a stage belongs, the stage is not believed, m.
const LOST_M: f64 = 0.06;

/// What makes one replaying policy differ from another.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayParams {
    /// Name in tables.
    pub name: String,
    /// Radius of the local visual correction, m; 0 replays blindly.
    pub servo_radius_m: f64,
    /// Standard deviation of the noise on each component but the gripper, in action units.
    pub noise: f64,
    /// Speed of free motion, in action units.
    pub speed: f64,
    /// Actions of a chunk.
    pub horizon: usize,
    /// Spread of the moment at which the gripper closes, policy steps either way.
    pub close_jitter_steps: u32,
    /// How long an inference takes, s.
    pub latency_s: f64,
}

impl ReplayParams {
    /// Like OpenVLA: chunks of 8, corrects within 3 cm.
    #[must_use]
    pub fn openvla_like() -> Self {
        Self {
            name: "openvla-like".to_owned(),
            servo_radius_m: 0.03,
            noise: 0.05,
            speed: 0.8,
            horizon: 8,
            close_jitter_steps: 3,
            latency_s: 0.086,
        }
    }
}

/// Where the motion stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Approach,
    Descend,
    Settle { steps: u32 },
    Close { steps: u32 },
    Lift,
    Transport,
    Lower,
    Poise { steps: u32 },
    Open { steps: u32 },
    Retreat,
    Done,
}

/// A policy that replays a remembered motion.
#[derive(Debug)]
pub struct Replay {
    params: ReplayParams,
    memory: Memory,
    rng: ChaCha8Rng,
    close_wait: u32,
    episode: Option<Episode>,
}

/// What lasts through an episode.
#[derive(Clone, Debug)]
struct Episode {
    demonstration: Demonstration,
    /// Stage before each action of the newest chunk, and after the last.
    stages: Vec<Stage>,
    /// Policy step of the newest query.
    queried_at: u64,
    level: UnitQuaternion<f64>,
}

/// The waypoints of one query, corrected by what is seen.
struct Waypoints {
    hover: Vector3<f64>,
    grasp: Vector3<f64>,
    carry: Vector3<f64>,
    release: Vector3<f64>,
    retreat: Vector3<f64>,
}

impl Replay {
    /// A policy with the given memory. Call [`Backbone::reset`] before each episode.
    #[must_use]
    pub fn new(params: ReplayParams, memory: Memory) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(0);
        Self {
            params,
            memory,
            rng,
            close_wait: 0,
            episode: None,
        }
    }

    fn begin(&self, observation: &Observation) -> Episode {
        let [w, x, y, z] = observation.robot.tcp.orientation;
        let level = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        Episode {
            demonstration: self.memory.recall(observation).clone(),
            stages: vec![Stage::Approach],
            queried_at: observation.policy_step,
            level,
        }
    }

    fn waypoints(&self, demonstration: &Demonstration, seen: &[SeenObject]) -> Waypoints {
        let radius = self.params.servo_radius_m;
        let at_target = correction(demonstration.target_m, seen, radius);
        let at_destination = correction(demonstration.destination_m, seen, radius);
        let grasp = Vector3::from(demonstration.grasp_m) + at_target;
        let release = Vector3::from(demonstration.release_m) + at_destination;
        Waypoints {
            hover: Vector3::new(grasp.x, grasp.y, demonstration.hover_z_m),
            grasp,
            carry: Vector3::new(release.x, release.y, demonstration.carry_z_m),
            release,
            retreat: release + Vector3::new(0.0, 0.0, RETREAT_M),
        }
    }

    fn noise(&mut self) -> f64 {
        let unit: f64 = StandardNormal.sample(&mut self.rng);
        self.params.noise * unit
    }
}

impl Backbone for Replay {
    fn name(&self) -> &str {
        &self.params.name
    }

    fn reset(&mut self, seed: u64) {
        self.rng = ChaCha8Rng::seed_from_u64(seed);
        self.close_wait = self
            .rng
            .random_range(0..=2 * self.params.close_jitter_steps);
        self.episode = None;
    }

    fn infer(&mut self, observation: &Observation) -> Chunk {
        let mut episode = self
            .episode
            .take()
            .unwrap_or_else(|| self.begin(observation));
        let waypoints = self.waypoints(&episode.demonstration, &observation.objects);
        let mut stage = resynchronise(&episode, observation, &waypoints);
        let robot = &observation.robot;
        let mut mass = PointMass {
            position_m: robot.tcp.position_m.into(),
            velocity_m_s: robot.tcp_velocity_m_s.into(),
        }
        // The answer comes late; so it did when the demonstrations were made.
        .coasting(self.params.latency_s);
        let [w, x, y, z] = robot.tcp.orientation;
        let now = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        // The tilt is corrected over the chunk's first steps, not all at once.
        let mut tilt = (episode.level * now.inverse()).scaled_axis();
        episode.stages.clear();
        let mut actions = Vec::with_capacity(self.params.horizon);
        for _ in 0..self.params.horizon {
            stage = advance(stage, &mass, &waypoints, self.close_wait);
            episode.stages.push(stage);
            let (waypoint, gripper) = stage.drive(&mass, &waypoints);
            let translation = mass.towards(waypoint, self.params.speed);
            let turn = 0.5 * tilt / ROTATION_SCALE_RAD;
            tilt *= 0.7;
            let mut action: Action = [
                translation.x,
                translation.y,
                translation.z,
                turn.x,
                turn.y,
                turn.z,
                gripper,
            ];
            for component in &mut action[..6] {
                *component = (*component + self.noise()).clamp(-1.0, 1.0);
            }
            actions.push(action);
            mass = mass.after(translation);
        }
        episode.stages.push(stage);
        episode.queried_at = observation.policy_step;
        self.episode = Some(episode);
        Chunk {
            actions,
            latency_s: self.params.latency_s,
        }
    }
}

impl Stage {
    /// Where the tool goes and what the gripper does.
    fn drive(self, mass: &PointMass, w: &Waypoints) -> (Vector3<f64>, f64) {
        let here = mass.position_m;
        match self {
            Self::Approach => (w.hover, -1.0),
            Self::Descend | Self::Settle { .. } => (w.grasp, -1.0),
            Self::Close { .. } => (w.grasp, 1.0),
            // Straight up from wherever the grasp was.
            Self::Lift => (Vector3::new(here.x, here.y, w.carry.z), 1.0),
            Self::Transport => (w.carry, 1.0),
            Self::Lower | Self::Poise { .. } => (w.release, 1.0),
            Self::Open { .. } => (w.release, -1.0),
            Self::Retreat => (w.retreat, -1.0),
            Self::Done => (here, -1.0),
        }
    }
}

/// The stage after one more policy step, seen from the predicted motion.
fn advance(stage: Stage, mass: &PointMass, w: &Waypoints, close_wait: u32) -> Stage {
    let away = |from: Vector3<f64>| (mass.position_m - from).norm();
    let away_xy = |from: Vector3<f64>| (mass.position_m - from).xy().norm();
    match stage {
        Stage::Approach if away(w.hover) < PASSED_M => Stage::Descend,
        Stage::Descend if away(w.grasp) < ARRIVED_M => Stage::Settle { steps: 0 },
        Stage::Settle { steps } if steps >= close_wait => Stage::Close { steps: 0 },
        Stage::Settle { steps } => Stage::Settle { steps: steps + 1 },
        Stage::Close { steps } if steps >= CLOSE_STEPS => Stage::Lift,
        Stage::Close { steps } => Stage::Close { steps: steps + 1 },
        Stage::Lift if w.carry.z - mass.position_m.z < PASSED_M => Stage::Transport,
        Stage::Transport if away_xy(w.carry) < ARRIVED_M => Stage::Lower,
        Stage::Lower if away(w.release) < ARRIVED_M => Stage::Poise { steps: 0 },
        Stage::Poise { steps } if steps >= POISE_STEPS => Stage::Open { steps: 0 },
        Stage::Poise { steps } => Stage::Poise { steps: steps + 1 },
        Stage::Open { steps } if steps >= OPEN_STEPS => Stage::Retreat,
        Stage::Open { steps } => Stage::Open { steps: steps + 1 },
        Stage::Retreat if away(w.retreat) < PASSED_M => Stage::Done,
        same => same,
    }
}

/// The stage that the scene shows: the planned one, unless it can't be.
fn resynchronise(episode: &Episode, observation: &Observation, w: &Waypoints) -> Stage {
    let elapsed = observation.policy_step.saturating_sub(episode.queried_at);
    let last = episode.stages.len().saturating_sub(1);
    let played = usize::try_from(elapsed).unwrap_or(last).min(last);
    let planned = episode
        .stages
        .get(played)
        .copied()
        .unwrap_or(Stage::Approach);
    let here = Vector3::from(observation.robot.tcp.position_m);
    let closed = observation.robot.gripper_width_m < GRIPPER_OPEN_M - NOT_OPEN_M;
    let near = |from: Vector3<f64>| (here - from).xy().norm() < LOST_M;
    match planned {
        // Somebody closed the gripper: there is something to carry.
        Stage::Approach | Stage::Descend | Stage::Settle { .. } | Stage::Done if closed => {
            Stage::Lift
        }
        Stage::Descend | Stage::Settle { .. } | Stage::Close { .. } if !near(w.grasp) => {
            Stage::Approach
        }
        // Somebody opened it on the way.
        Stage::Lift | Stage::Transport | Stage::Lower | Stage::Poise { .. } if !closed => {
            if near(w.release) {
                Stage::Retreat
            } else {
                Stage::Approach
            }
        }
        Stage::Lower | Stage::Poise { .. } | Stage::Open { .. } if !near(w.release) => {
            Stage::Transport
        }
        as_planned => as_planned,
    }
}

/// The horizontal offset from a remembered place to what stands near it, m.
fn correction(place_m: [f64; 3], seen: &[SeenObject], radius_m: f64) -> Vector3<f64> {
    let nearest = seen
        .iter()
        .map(|o| (distance_xy_m(o.pose.position_m, place_m), o.pose.position_m))
        .filter(|(distance, _)| *distance <= SERVO_REACH * radius_m)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((distance, [x, y, _])) = nearest else {
        return Vector3::zeros();
    };
    let offset = Vector3::new(x - place_m[0], y - place_m[1], 0.0);
    if distance > radius_m {
        offset * (radius_m / distance)
    } else {
        offset
    }
}
