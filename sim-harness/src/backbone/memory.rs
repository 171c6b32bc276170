//! What a policy that learnt by rote keeps of its training: one layout and one motion a task.

use crate::backbone::{Observation, SeenObject};
use crate::error::SimError;
use crate::grasp::{Side, freer_side, grasp_offset_m};
use crate::pose::distance_xy_m;
use crate::scene::PlacedObject;
use crate::suite::{Relation, Suite, Task};

/// Distance beyond which an object counts as not in its place, m.
const MISPLACED_M: f64 = 0.10;
/// Height of the carried object's bottom above the destination's top, m.
const CARRY_CLEARANCE_M: f64 = 0.035;
/// Height of the carried object's bottom above the working surface, m: over what stands around.
const CARRY_ABOVE_SURFACE_M: f64 = 0.09;
/// How far the grasped object is raised at least, m.
const LIFT_M: f64 = 0.08;
/// Height of the released object's bottom above a surface, m.
const RELEASE_CLEARANCE_M: f64 = 0.006;
/// A bowl that is held by its rim tilts and swings under the hand: it is set down with its centre
/// at this share of the distance at which it was grasped.
const HELD_SHARE: f64 = 0.6;
/// Height of the hover point above the target's top, m.
const HOVER_M: f64 = 0.10;

/// Where a thing stood in training.
#[derive(Clone, Debug, PartialEq)]
struct Landmark {
    label: String,
    xy_m: [f64; 2],
}

/// One trained task: what the scene looked like and where the hand went.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    /// The task's name.
    pub task: String,
    instruction: String,
    landmarks: Vec<Landmark>,
    target_label: String,
    target_colour: [f32; 3],
    target_half_m: [f64; 3],
    destination_label: String,
    /// Height of the working surface in training, m.
    pub surface_m: f64,
    /// How far below the target's top the tool was when the gripper closed, m.
    pub grasp_below_top_m: f64,
    /// Centre of the target in training, m.
    pub target_m: [f64; 3],
    /// Where the tool was when the gripper closed, m.
    pub grasp_m: [f64; 3],
    /// Height from which the tool went down, m.
    pub hover_z_m: f64,
    /// Height at which it carried, m.
    pub carry_z_m: f64,
    /// Centre of the destination in training, m.
    pub destination_m: [f64; 3],
    /// Where the tool was when the gripper opened, m.
    pub release_m: [f64; 3],
}

impl Demonstration {
    /// What a good demonstration of a task in its nominal layout leaves behind.
    ///
    /// # Errors
    /// If the task's names do not resolve.
    pub fn of(suite: &Suite, task: &Task) -> Result<Self, SimError> {
        let scene = suite.nominal_scene(task)?;
        let target = scene.by_name(&task.target)?;
        let destination = scene.by_name(&task.destination)?;
        let offset = grasp_offset_m(&target.kind, freer_side(&scene, target));
        let grasp_m: [f64; 3] = std::array::from_fn(|i| target.pose.position_m[i] + offset[i]);
        let above = top_m(destination) + carried_depth_m(target);
        let release_z = match task.relation {
            Relation::On => {
                let surface = destination
                    .kind
                    .region_m()
                    .map_or(top_m(destination), |(c, _)| {
                        destination.pose.position_m[2] + c[2]
                    });
                surface + RELEASE_CLEARANCE_M + carried_depth_m(target)
            }
            Relation::In => above,
        };
        let [dx, dy, _] = destination.pose.position_m;
        let landmark = |o: &PlacedObject| Landmark {
            label: o.kind.label.clone(),
            xy_m: [o.pose.position_m[0], o.pose.position_m[1]],
        };
        Ok(Self {
            task: task.name.clone(),
            instruction: task.instruction.clone(),
            target_label: target.kind.label.clone(),
            target_colour: target.kind.colour,
            target_half_m: target.kind.half_extent_m(),
            destination_label: destination.kind.label.clone(),
            surface_m: scene.arena.surface_m,
            grasp_below_top_m: top_m(target) - grasp_m[2],
            landmarks: scene.objects().iter().map(landmark).collect(),
            target_m: target.pose.position_m,
            grasp_m,
            hover_z_m: top_m(target) + HOVER_M,
            carry_z_m: (above + CARRY_CLEARANCE_M)
                .max(scene.arena.surface_m + CARRY_ABOVE_SURFACE_M + carried_depth_m(target))
                .max(grasp_m[2] + LIFT_M),
            destination_m: destination.pose.position_m,
            release_m: [
                dx + HELD_SHARE * offset[0],
                dy + HELD_SHARE * offset[1],
                release_z,
            ],
        })
    }

    /// How little a scene resembles the remembered one: the mean distance from each remembered
    /// place to the nearest thing of the same look, m.
    #[must_use]
    pub fn strangeness_m(&self, seen: &[SeenObject]) -> f64 {
        let missing = |landmark: &Landmark| {
            let place = [landmark.xy_m[0], landmark.xy_m[1], 0.0];
            seen.iter()
                .filter(|o| o.label == landmark.label)
                .map(|o| distance_xy_m(o.pose.position_m, place))
                .fold(MISPLACED_M, f64::min)
        };
        let total: f64 = self.landmarks.iter().map(missing).sum();
        total / self.landmarks.len().max(1) as f64
    }

    /// Whether a text is the one of training, to the letter.
    #[must_use]
    pub fn says(&self, prompt: &str) -> bool {
        self.instruction == prompt
    }

    /// Whether the target looks as in training, if it is near its place.
    #[must_use]
    pub fn looks_as_trained(&self, seen: &[SeenObject]) -> bool {
        let Some(target) = self.nearest_like_target(seen) else {
            return true;
        };
        if distance_xy_m(target.pose.position_m, self.target_m) > MISPLACED_M {
            return true;
        }
        let colour = |i: usize| (target.colour[i] - self.target_colour[i]).abs() < 0.05;
        let size = |i: usize| (target.half_extent_m[i] / self.target_half_m[i] - 1.0).abs() < 0.02;
        (0..3).all(|i| colour(i) && size(i))
    }

    /// The object of the target's name nearest to where the target was in training.
    #[must_use]
    pub fn nearest_like_target<'a>(&self, seen: &'a [SeenObject]) -> Option<&'a SeenObject> {
        self.by_distance(seen, &self.target_label)
            .into_iter()
            .next()
    }

    /// The destination, wherever it is.
    #[must_use]
    pub fn destination_among<'a>(&self, seen: &'a [SeenObject]) -> Option<&'a SeenObject> {
        seen.iter().find(|o| o.label == self.destination_label)
    }

    /// The object that a text names, read as a model would that knows the objects' names: the one
    /// whose name comes first; of several of that name the one of training, or another one if the
    /// text says "not".
    #[must_use]
    pub fn named_by<'a>(&self, prompt: &str, seen: &'a [SeenObject]) -> Option<&'a SeenObject> {
        let named = seen
            .iter()
            .filter_map(|o| prompt.find(&o.label).map(|at| (at, o)))
            .min_by_key(|(at, _)| *at)?
            .1;
        let alike = self.by_distance(seen, &named.label);
        let index = usize::from(prompt.contains(" not ") && alike.len() > 1);
        alike.get(index).copied()
    }

    fn by_distance<'a>(&self, seen: &'a [SeenObject], label: &str) -> Vec<&'a SeenObject> {
        let away = |o: &SeenObject| distance_xy_m(o.pose.position_m, self.target_m);
        let mut alike: Vec<_> = seen.iter().filter(|o| o.label == label).collect();
        alike.sort_by(|a, b| away(a).total_cmp(&away(b)));
        alike
    }
}

fn top_m(object: &PlacedObject) -> f64 {
    object.pose.position_m[2] + object.kind.half_extent_m()[2]
}

/// From the tool centre point down to the bottom of the held object, m.
fn carried_depth_m(object: &PlacedObject) -> f64 {
    grasp_offset_m(&object.kind, Side::Left)[2] + object.kind.half_extent_m()[2]
}

/// All that was learnt.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    suite: String,
    demonstrations: Vec<Demonstration>,
}

impl Memory {
    /// A policy that was trained on the tasks of a suite.
    ///
    /// # Errors
    /// If a task's names do not resolve, or the suite has no task.
    pub fn of(suite: &Suite) -> Result<Self, SimError> {
        let demonstrations = suite
            .tasks
            .iter()
            .map(|task| Demonstration::of(suite, task))
            .collect::<Result<Vec<_>, _>>()?;
        if demonstrations.is_empty() {
            return Err(SimError::invalid(
                format!("suite `{}`", suite.name),
                "it has no task",
            ));
        }
        Ok(Self {
            suite: suite.name.clone(),
            demonstrations,
        })
    }

    /// The suite that it was trained on.
    #[must_use]
    pub fn suite(&self) -> &str {
        &self.suite
    }

    /// The demonstration whose scene resembles the observed one most; ties go to the first.
    #[must_use]
    pub fn recall(&self, observation: &Observation) -> &Demonstration {
        let mut best = &self.demonstrations[0];
        let mut least = best.strangeness_m(&observation.objects);
        for candidate in &self.demonstrations[1..] {
            let strangeness = candidate.strangeness_m(&observation.objects);
            if strangeness < least {
                (best, least) = (candidate, strangeness);
            }
        }
        best
    }
}
