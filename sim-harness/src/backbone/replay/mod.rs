//! S1 to S3: policies that replay what they memorised.
//!
//! At the first query the nearest remembered scene is recalled by the look and place of things;
//! the text is ignored. The hand then goes where it went in training. With a servo radius it
//! corrects for whatever stands within that radius of the remembered place, and looks no further,
//! except in the share of episodes in which it follows looks.
//!
//! Like a network, it has no memory of what it did beyond what it can see: if somebody else moved
//! the arm or the gripper, it picks the motion up at the stage that the scene shows.

mod luck;
mod params;
mod stage;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use self::luck::{Break, Luck};
pub use self::params::{BySuite, EndWeights, Latency, ReplayParams};
use self::stage::{Stage, Waypoints};
use super::memory::{Demonstration, Memory};
use super::motion::PointMass;
use super::{Backbone, Chunk, Observation, SeenObject};
use crate::action::{Action, ROTATION_SCALE_RAD};
use crate::pose::distance_xy_m;

/// Beyond the servo radius by this factor the correction still acts, but grows no further.
const SERVO_REACH: f64 = 1.5;
/// How far the tool rises after the release, m.
const RETREAT_M: f64 = 0.08;
/// Heights of the working surface that differ by less than this are the same, m.
const SAME_SURFACE_M: f64 = 0.005;

/// A policy that replays a remembered motion.
#[derive(Debug)]
pub struct Replay {
    params: ReplayParams,
    memory: Memory,
    luck: Luck,
    episode: Option<Episode>,
}

/// What lasts through an episode.
#[derive(Clone, Debug)]
struct Episode {
    demonstration: Demonstration,
    /// The object that is followed wherever it is, by its index among what was seen first.
    followed: Option<SeenObject>,
    /// How this episode goes wrong, if it does.
    breaks: Option<Break>,
    /// What is added to remembered heights, m.
    height_m: f64,
    /// Stage before each action of the newest chunk, and after the last.
    stages: Vec<Stage>,
    /// Policy step of the newest query.
    queried_at: u64,
    level: UnitQuaternion<f64>,
}

impl Replay {
    /// A policy with the given memory. Call [`Backbone::reset`] before each episode.
    #[must_use]
    pub fn new(params: ReplayParams, memory: Memory) -> Self {
        let luck = Luck::draw(&params, 0);
        Self {
            params,
            memory,
            luck,
            episode: None,
        }
    }

    fn begin(&self, observation: &Observation) -> Episode {
        let demonstration = self.memory.recall(observation).clone();
        let suite = self.memory.suite();
        let luck = &self.luck;
        let broken = (!demonstration.says(&observation.prompt)
            && luck.text < self.params.break_text.of(suite))
            || (!demonstration.looks_as_trained(&observation.objects)
                && luck.look < self.params.break_look.of(suite));
        let rise_m = observation.surface_m - demonstration.surface_m;
        let absolute = luck.height < self.params.absolute_height.of(suite);
        let relative = !absolute && rise_m.abs() > SAME_SURFACE_M;
        Episode {
            followed: self.follow(observation, &demonstration),
            breaks: broken.then_some(luck.breaks),
            height_m: if relative { rise_m } else { 0.0 },
            demonstration,
            stages: vec![Stage::Approach],
            queried_at: observation.policy_step,
            level: orientation_of(observation),
        }
    }

    /// The object that is followed beyond the servo radius, if any is in this episode.
    fn follow(&self, observation: &Observation, demo: &Demonstration) -> Option<SeenObject> {
        let reads = self.luck.language < self.params.language;
        if reads && !demo.says(&observation.prompt) {
            return demo
                .named_by(&observation.prompt, &observation.objects)
                .cloned();
        }
        (self.luck.follow < self.params.follow.of(self.memory.suite()))
            .then(|| demo.nearest_like_target(&observation.objects).cloned())
            .flatten()
    }

    fn waypoints(&self, episode: &Episode, seen: &[SeenObject]) -> Waypoints {
        let demo = &episode.demonstration;
        let radius = self.params.servo_radius_m;
        let follows = self.luck.follow < self.params.follow.of(self.memory.suite());
        let at_target = match &episode.followed {
            Some(object) => offset_to(demo.target_m, object, seen),
            None => correction(demo.target_m, seen, radius),
        };
        let at_destination = match demo.destination_among(seen).filter(|_| follows) {
            Some(place) => horizontal(demo.destination_m, place.pose.position_m),
            None => correction(demo.destination_m, seen, radius),
        };
        let up = Vector3::new(0.0, 0.0, episode.height_m);
        let miss = match episode.breaks {
            Some(Break::NearMiss(miss)) => miss,
            _ => Vector3::zeros(),
        };
        let vertical = |rise_m: f64| Vector3::new(0.0, 0.0, rise_m);
        let target_rise_m = self.rise_of(episode, seen);
        let place_rise_m = match demo.destination_among(seen).filter(|_| follows) {
            Some(place) => place.pose.position_m[2] - demo.destination_m[2] - episode.height_m,
            None => 0.0,
        };
        let grasp = Vector3::from(demo.grasp_m) + at_target + miss + up + vertical(target_rise_m);
        let release = Vector3::from(demo.release_m) + at_destination + up + vertical(place_rise_m);
        let carry_z = demo.carry_z_m + up.z + target_rise_m.max(place_rise_m).max(0.0);
        let premature = self.luck.premature < self.params.premature;
        Waypoints {
            hover: Vector3::new(grasp.x, grasp.y, grasp.z + demo.hover_z_m - demo.grasp_m[2]),
            grasp,
            carry: Vector3::new(release.x, release.y, carry_z),
            release,
            retreat: release + Vector3::new(0.0, 0.0, RETREAT_M),
            premature_m: premature.then_some(self.luck.premature_height_m),
            stalls: episode.breaks == Some(Break::Stall),
            drops: episode.breaks == Some(Break::DropEarly),
            close_wait: self.luck.close_wait,
        }
    }

    /// How much higher the followed object's grasp point is than the remembered one's, m.
    fn rise_of(&self, episode: &Episode, seen: &[SeenObject]) -> f64 {
        let demo = &episode.demonstration;
        let Some(first) = &episode.followed else {
            return 0.0;
        };
        let Some(now) = same_object(first, seen) else {
            return 0.0;
        };
        let grasp_z = first.pose.position_m[2] + now.half_extent_m[2] - demo.grasp_below_top_m;
        let lowest = grasp_z.max(demo.surface_m + episode.height_m + crate::grasp::LOWEST_M);
        lowest - demo.grasp_m[2] - episode.height_m
    }
}

impl Backbone for Replay {
    fn name(&self) -> &str {
        &self.params.name
    }

    fn reset(&mut self, seed: u64) {
        self.luck = Luck::draw(&self.params, seed);
        self.episode = None;
    }

    fn infer(&mut self, observation: &Observation) -> Chunk {
        let mut episode = self
            .episode
            .take()
            .unwrap_or_else(|| self.begin(observation));
        let waypoints = self.waypoints(&episode, &observation.objects);
        let mut stage = planned(&episode, observation).resynchronised(observation, &waypoints);
        let robot = &observation.robot;
        let mut mass = PointMass {
            position_m: robot.tcp.position_m.into(),
            velocity_m_s: robot.tcp_velocity_m_s.into(),
        }
        // The answer comes late; so it did when the demonstrations were made.
        .coasting(self.params.latency.median_s);
        // The tilt is corrected over the chunk's first steps, not all at once.
        let mut tilt = (episode.level * orientation_of(observation).inverse()).scaled_axis();
        episode.stages.clear();
        let mut actions = Vec::with_capacity(self.params.horizon);
        for _ in 0..self.params.horizon {
            stage = stage.advance(&mass, &waypoints);
            episode.stages.push(stage);
            let (translation, gripper) =
                stage.drive(&mass, &waypoints, self.params.speed, self.luck.end);
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
                let noise = self.luck.noise(&self.params);
                *component = (*component + noise).clamp(-1.0, 1.0);
            }
            actions.push(action);
            mass = mass.after(translation);
        }
        episode.stages.push(stage);
        episode.queried_at = observation.policy_step;
        self.episode = Some(episode);
        Chunk {
            actions,
            latency_s: self.luck.latency_s(&self.params),
            copies: 1,
        }
    }
}

/// The stage that the newest chunk had planned for now.
fn planned(episode: &Episode, observation: &Observation) -> Stage {
    let elapsed = observation.policy_step.saturating_sub(episode.queried_at);
    let last = episode.stages.len().saturating_sub(1);
    let played = usize::try_from(elapsed).unwrap_or(last).min(last);
    episode
        .stages
        .get(played)
        .copied()
        .unwrap_or(Stage::Approach)
}

fn orientation_of(observation: &Observation) -> UnitQuaternion<f64> {
    let [w, x, y, z] = observation.robot.tcp.orientation;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn horizontal(from_m: [f64; 3], to_m: [f64; 3]) -> Vector3<f64> {
    Vector3::new(to_m[0] - from_m[0], to_m[1] - from_m[1], 0.0)
}

/// Among what is seen now, the object of that look nearest to where it was.
fn same_object<'a>(first: &SeenObject, seen: &'a [SeenObject]) -> Option<&'a SeenObject> {
    let away = |o: &SeenObject| distance_xy_m(o.pose.position_m, first.pose.position_m);
    seen.iter()
        .filter(|o| o.label == first.label)
        .min_by(|a, b| away(a).total_cmp(&away(b)))
}

fn offset_to(place_m: [f64; 3], object: &SeenObject, seen: &[SeenObject]) -> Vector3<f64> {
    let now = same_object(object, seen).unwrap_or(object);
    horizontal(place_m, now.pose.position_m)
}

/// The horizontal offset from a remembered place to what stands near it, m.
fn correction(place_m: [f64; 3], seen: &[SeenObject], radius_m: f64) -> Vector3<f64> {
    let nearest = seen
        .iter()
        .map(|o| (distance_xy_m(o.pose.position_m, place_m), o.pose.position_m))
        .filter(|(distance, _)| *distance <= SERVO_REACH * radius_m)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((distance, place)) = nearest else {
        return Vector3::zeros();
    };
    let offset = horizontal(place_m, place);
    if distance > radius_m {
        offset * (radius_m / distance)
    } else {
        offset
    }
}
