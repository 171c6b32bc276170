//! Surrogate policies: they stand where a vision-language-action model would stand.
//!
//! A surrogate sees what such a model sees, the scene, the robot's own state and the instruction,
//! and answers with a chunk of actions. It is never told which perturbation made the scene. Every
//! table that comes of one says "surrogate".

pub mod bc;
mod chaos;
mod control;
mod memory;
mod motion;
mod registry;
mod replay;

pub use chaos::{Chaos, Fault};
pub use control::{Hold, Random};
pub use memory::{Demonstration, Memory};
pub use motion::PointMass;
pub use registry::{Registry, Spec};
pub use replay::{BySuite, EndWeights, Latency, Replay, ReplayParams};

use crate::action::Action;
use crate::object::ObjectClass;
use crate::pose::Pose;
use crate::sim::{RobotState, Sim};

/// An object as a policy sees it: where it is and what it looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenObject {
    /// What it is recognised as.
    pub label: String,
    /// How a thing of this look is grasped.
    pub class: ObjectClass,
    /// Red, green, blue, 0 to 1.
    pub colour: [f32; 3],
    /// Half the bounding box along the object's own axes, m.
    pub half_extent_m: [f64; 3],
    /// Centre of the bounding box, base frame.
    pub pose: Pose,
}

/// What a policy is given at a query.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// The instruction or the grounded prompt.
    pub prompt: String,
    /// Policy steps executed so far in the episode.
    pub policy_step: u64,
    /// The robot's own state.
    pub robot: RobotState,
    /// Height of the working surface, base frame, m.
    pub surface_m: f64,
    /// Colour of the working surface: red, green, blue, 0 to 1.
    pub surface_colour: [f32; 3],
    /// The objects in view, in no particular order.
    pub objects: Vec<SeenObject>,
}

impl Observation {
    /// What a policy with a clear view sees of a simulator.
    #[must_use]
    pub fn of(sim: &Sim, prompt: &str, policy_step: u64) -> Self {
        let scene = sim.scene();
        let objects = scene
            .objects()
            .iter()
            .zip(sim.objects())
            .map(|(placed, state)| SeenObject {
                label: placed.kind.label.clone(),
                class: placed.kind.class,
                colour: placed.kind.colour,
                half_extent_m: placed.kind.half_extent_m(),
                pose: state.pose,
            })
            .collect();
        Self {
            prompt: prompt.to_owned(),
            policy_step,
            robot: sim.robot(),
            surface_m: scene.arena.surface_m,
            surface_colour: scene.arena.surface_colour,
            objects,
        }
    }
}

/// The answer to a query.
#[derive(Clone, Debug, PartialEq)]
pub struct Chunk {
    /// Actions, one a policy step.
    pub actions: Vec<Action>,
    /// How long the inference took, s. Simulated: nothing waits for it here.
    pub latency_s: f64,
    /// How often the answer is sent: once, unless the transport is made to fail.
    pub copies: u32,
}

/// A policy that answers observations with chunks of actions.
pub trait Backbone: Send {
    /// Its name, as tables give it.
    fn name(&self) -> &str;

    /// Forgets the episode; the next one draws its noise from `seed`.
    fn reset(&mut self, seed: u64);

    /// Answers a query. The same observations after the same seed give the same chunks.
    fn infer(&mut self, observation: &Observation) -> Chunk;
}
