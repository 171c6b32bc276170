//! Suites of tasks, as data: what stands where, what is asked, when it is done.

use std::collections::BTreeMap;
use std::sync::Arc;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::error::SimError;
use crate::object::Library;
use crate::predicate::Goal;
use crate::scene::{Arena, Scene};

/// The embedded suite that mirrors LIBERO-Object.
const OBJECT: &str = include_str!("../assets/suites/object.toml");

/// A box on the working surface in which an object's centre starts.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Centre, base frame, m.
    pub centre_m: [f64; 2],
    /// Half extent, m.
    pub half_m: [f64; 2],
}

/// How the object stands to the destination in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// Inside a container.
    In,
    /// On a surface.
    On,
}

/// An object of a task.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskObject {
    /// Name within the scene.
    pub name: String,
    /// Kind, by the name that the library gives it.
    pub kind: String,
    /// Region of the suite in which it starts.
    pub region: String,
    /// Turn about the vertical, rad.
    #[serde(default)]
    pub yaw_rad: f64,
}

/// A task: what stands where, what is asked.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name within the suite.
    pub name: String,
    /// What the robot is told.
    pub instruction: String,
    /// The object that the instruction means.
    pub target: String,
    /// How it stands to the destination in the end.
    pub relation: Relation,
    /// Where it goes.
    pub destination: String,
    /// The object that changes places with another one when positions are perturbed.
    pub swap: String,
    /// The object that a perturbed task names instead.
    pub other: String,
    /// The objects.
    pub objects: Vec<TaskObject>,
}

/// A suite of tasks over shared regions.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Its name.
    pub name: String,
    /// Policy steps of an episode after the first ten, in which the scene settles.
    pub max_steps: u32,
    /// The surroundings.
    #[serde(default)]
    pub arena: Arena,
    /// Where objects start.
    pub regions: BTreeMap<String, Region>,
    /// The tasks.
    #[serde(rename = "task")]
    pub tasks: Vec<Task>,
}

impl Suite {
    /// An embedded suite by name: `object`.
    ///
    /// # Errors
    /// [`SimError::Unknown`] for another name.
    pub fn embedded(name: &str) -> Result<Self, SimError> {
        match name {
            "object" => Self::parse("suites/object.toml", OBJECT),
            _ => Err(SimError::unknown("suite", name, ["object"])),
        }
    }

    /// Reads a suite and checks that all names in it resolve. `file` is the name that errors give.
    ///
    /// # Errors
    /// [`SimError::Data`], [`SimError::Unknown`] or [`SimError::Invalid`], naming the key.
    pub fn parse(file: &str, text: &str) -> Result<Self, SimError> {
        let suite: Self = toml::from_str(text).map_err(|e| SimError::Data {
            file: file.to_owned(),
            message: e.to_string(),
        })?;
        let library = Library::embedded()?;
        for task in &suite.tasks {
            suite.check(task, &library)?;
        }
        Ok(suite)
    }

    /// A task by name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn task(&self, name: &str) -> Result<&Task, SimError> {
        let names = self.tasks.iter().map(|t| &*t.name);
        self.tasks
            .iter()
            .find(|t| t.name == name)
            .ok_or_else(|| SimError::unknown("task", name, names))
    }

    /// The scene of a task with every object in the middle of its region.
    ///
    /// # Errors
    /// If a name does not resolve, which [`Suite::parse`] rules out.
    pub fn nominal_scene(&self, task: &Task) -> Result<Scene, SimError> {
        self.scene_with(task, |region| region.centre_m)
    }

    /// The scene of a task with starts drawn from the regions by `seed`.
    ///
    /// # Errors
    /// If a name does not resolve, which [`Suite::parse`] rules out.
    pub fn sample_scene(&self, task: &Task, seed: u64) -> Result<Scene, SimError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.scene_with(task, |region| {
            std::array::from_fn(|i| {
                region.centre_m[i] + region.half_m[i] * rng.random_range(-1.0..=1.0)
            })
        })
    }

    fn scene_with(
        &self,
        task: &Task,
        mut place: impl FnMut(&Region) -> [f64; 2],
    ) -> Result<Scene, SimError> {
        let library = Library::embedded()?;
        let mut scene = Scene::new(self.arena.clone());
        for object in &task.objects {
            let kind = Arc::new(library.get(&object.kind)?.clone());
            let xy_m = place(self.region(&object.region)?);
            scene.put(&object.name, kind, xy_m, object.yaw_rad)?;
        }
        Ok(scene)
    }

    fn region(&self, name: &str) -> Result<&Region, SimError> {
        let known = self.regions.keys().map(String::as_str);
        self.regions
            .get(name)
            .ok_or_else(|| SimError::unknown("region", name, known))
    }

    fn check(&self, task: &Task, library: &Library) -> Result<(), SimError> {
        let scene = self.nominal_scene(task)?;
        for name in [&task.target, &task.destination, &task.swap, &task.other] {
            scene.by_name(name)?;
        }
        for object in &task.objects {
            library.get(&object.kind)?;
        }
        if task.target == task.other || task.target == task.destination {
            let problem = "target, other and destination must be different objects";
            return Err(SimError::invalid(format!("task `{}`", task.name), problem));
        }
        Ok(())
    }
}

impl Task {
    /// What the task asks for, in a scene that was made from it.
    ///
    /// # Errors
    /// [`SimError::Unknown`] if the scene lacks the target or the destination.
    pub fn goal(&self, scene: &Scene) -> Result<Goal, SimError> {
        let object = scene.by_name(&self.target)?.id;
        let destination = scene.by_name(&self.destination)?.id;
        Ok(match self.relation {
            Relation::In => Goal::In {
                object,
                container: destination,
            },
            Relation::On => Goal::On {
                object,
                support: destination,
            },
        })
    }
}
