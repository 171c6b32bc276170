//! Suites of tasks, as data: what stands where, what is asked, when it is done.

use std::collections::BTreeMap;
use std::sync::Arc;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use sha2::{Digest as _, Sha256};

use crate::error::SimError;
use crate::object::{Library, ObjectKind};
use crate::predicate::Goal;
use crate::scene::{Arena, Scene};

/// The embedded suites by name.
const EMBEDDED: [(&str, &str); 2] = [
    ("object", include_str!("../assets/suites/object.toml")),
    ("spatial", include_str!("../assets/suites/spatial.toml")),
];

/// A box in which an object's centre starts.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Centre, m: in the base frame, or from the centre of the object in `on`.
    pub centre_m: [f64; 2],
    /// Half extent, m.
    pub half_m: [f64; 2],
    /// Height above the working surface, m: for furniture.
    #[serde(default)]
    pub height_m: f64,
    /// The object on or in which it stands, if that is not the working surface.
    #[serde(default)]
    pub on: Option<String>,
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

/// Another look of the target: its name stays.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    /// Red, green, blue, 0 to 1.
    pub colour: [f32; 3],
    /// Size, as a multiple of the usual one.
    pub scale: f64,
}

/// Where the Pos perturbation moves something.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Displacement {
    /// What moves.
    #[serde(rename = "move")]
    pub object: String,
    /// What it changes places with.
    #[serde(default)]
    pub with: Option<String>,
    /// What it is put on top of instead.
    #[serde(default)]
    pub onto: Option<String>,
}

/// What the Task perturbation asks for instead.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherTarget {
    /// The object that is meant then.
    pub object: String,
    /// What the robot is told then.
    pub instruction: String,
}

/// A task: what stands where, what is asked, and how it can be perturbed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name within the suite.
    pub name: String,
    /// What the robot is told.
    pub instruction: String,
    /// The same in other words.
    pub paraphrases: Vec<String>,
    /// The object that the instruction means.
    pub target: String,
    /// How it stands to the destination in the end.
    pub relation: Relation,
    /// Where it goes.
    pub destination: String,
    /// Another look of the target.
    pub variant: Variant,
    /// What moves when positions are perturbed.
    pub pos: Displacement,
    /// What is asked for when the task is perturbed.
    pub other: OtherTarget,
    /// The objects, supports before what stands on them.
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
    /// Of a suite from a file: the first digits of the file's SHA-256.
    #[serde(skip)]
    fingerprint: Option<String>,
}

/// What differs from the suite's own scene when one is built.
#[derive(Clone, Debug, Default)]
pub struct Alteration {
    /// Other surroundings.
    pub arena: Option<Arena>,
    /// Another look of the target.
    pub variant: Option<Variant>,
}

impl Suite {
    /// An embedded suite by name: `object` or `spatial`.
    ///
    /// # Errors
    /// [`SimError::Unknown`] for another name.
    pub fn embedded(name: &str) -> Result<Self, SimError> {
        let names = EMBEDDED.map(|(known, _)| known);
        let (known, text) = EMBEDDED
            .iter()
            .find(|(known, _)| *known == name)
            .ok_or_else(|| SimError::unknown("suite", name, names))?;
        Self::parse(&format!("suites/{known}.toml"), text)
    }

    /// An embedded suite by name, or the suite of a file, whose name ends in `.toml`.
    ///
    /// # Errors
    /// As for [`Suite::embedded`] and [`Suite::parse`], and [`SimError::Io`] if the file can't be
    /// read.
    pub fn open(name: &str) -> Result<Self, SimError> {
        if !name.ends_with(".toml") {
            return Self::embedded(name);
        }
        let text = std::fs::read_to_string(name)
            .map_err(|e| SimError::io(std::path::Path::new(name), e))?;
        let digest = Sha256::digest(text.as_bytes());
        let digits = digest.iter().take(4).map(|byte| format!("{byte:02x}"));
        Ok(Self {
            fingerprint: Some(digits.collect()),
            ..Self::parse(name, &text)?
        })
    }

    /// Of a suite from a file: the first eight hexadecimal digits of the file's SHA-256.
    #[must_use]
    pub fn fingerprint(&self) -> Option<&str> {
        self.fingerprint.as_deref()
    }

    /// Reads a suite and checks that all names in it resolve. `file` is the name that errors give.
    ///
    /// # Errors
    /// [`SimError::Data`], or [`SimError::Unknown`] or [`SimError::Invalid`] within the file, task
    /// and key.
    pub fn parse(file: &str, text: &str) -> Result<Self, SimError> {
        let suite: Self = toml::from_str(text).map_err(|e| SimError::Data {
            file: file.to_owned(),
            message: e.to_string(),
        })?;
        suite.check_all().map_err(|error| error.within(file))?;
        Ok(suite)
    }

    fn check_all(&self) -> Result<(), SimError> {
        let wrong = |problem: &str| Err(SimError::invalid("the suite", problem));
        if self.tasks.is_empty() {
            return wrong("it has no task: add a [[task]]");
        }
        if self.max_steps == 0 {
            return wrong("max_steps is 0; it must be positive");
        }
        for (name, region) in &self.regions {
            let Region {
                centre_m, half_m, ..
            } = region;
            let finite = centre_m.iter().chain(half_m).all(|m| m.is_finite());
            if !finite || half_m.iter().any(|half| *half < 0.0) {
                let problem = "centre_m and half_m must be finite, and half_m not negative";
                return Err(SimError::invalid(format!("region `{name}`"), problem));
            }
        }
        for task in &self.tasks {
            self.check(task)
                .map_err(|error| error.within(format!("task `{}`", task.name)))?;
        }
        Ok(())
    }

    /// A task by name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn task(&self, name: &str) -> Result<&Task, SimError> {
        Ok(&self.tasks[self.task_index(name)?])
    }

    /// The number of a task, from 0.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn task_index(&self, name: &str) -> Result<usize, SimError> {
        let names = self.tasks.iter().map(|t| &*t.name);
        self.tasks
            .iter()
            .position(|t| t.name == name)
            .ok_or_else(|| SimError::unknown("task", name, names))
    }

    /// The scene of a task with every object in the middle of its region.
    ///
    /// # Errors
    /// If a name does not resolve, which [`Suite::parse`] rules out.
    pub fn nominal_scene(&self, task: &Task) -> Result<Scene, SimError> {
        self.build(task, &Alteration::default(), |region| region.centre_m)
    }

    /// The scene of a task with starts drawn from the regions by `seed`.
    ///
    /// # Errors
    /// If a name does not resolve, which [`Suite::parse`] rules out.
    pub fn sample_scene(&self, task: &Task, seed: u64) -> Result<Scene, SimError> {
        self.sample_altered(task, seed, &Alteration::default())
    }

    /// The same starts as [`Suite::sample_scene`], in an altered scene.
    ///
    /// # Errors
    /// As for [`Suite::sample_scene`], and [`SimError::Invalid`] for an impossible alteration.
    pub fn sample_altered(
        &self,
        task: &Task,
        seed: u64,
        alteration: &Alteration,
    ) -> Result<Scene, SimError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.build(task, alteration, |region| {
            std::array::from_fn(|i| {
                region.centre_m[i] + region.half_m[i] * rng.random_range(-1.0..=1.0)
            })
        })
    }

    fn build(
        &self,
        task: &Task,
        alteration: &Alteration,
        mut place: impl FnMut(&Region) -> [f64; 2],
    ) -> Result<Scene, SimError> {
        let library = Library::embedded()?;
        let arena = alteration
            .arena
            .clone()
            .unwrap_or_else(|| self.arena.clone());
        let mut scene = Scene::new(arena);
        for object in &task.objects {
            let field = |error: SimError, field: &str| {
                error.within(format!("object `{}`, field `{field}`", object.name))
            };
            let mut kind = library
                .get(&object.kind)
                .map_err(|e| field(e, "kind"))?
                .clone();
            if let Some(variant) = &alteration.variant
                && object.name == task.target
            {
                kind = altered(&kind, variant)?;
            }
            let kind = Arc::new(kind);
            let region = self
                .region(&object.region)
                .map_err(|e| field(e, "region"))?;
            let xy_m = place(region);
            match &region.on {
                Some(support) => scene.put_on(&object.name, kind, support, xy_m, object.yaw_rad)?,
                None => scene.put_at_height(
                    &object.name,
                    kind,
                    xy_m,
                    region.height_m,
                    object.yaw_rad,
                )?,
            };
        }
        Ok(scene)
    }

    fn region(&self, name: &str) -> Result<&Region, SimError> {
        let known = self.regions.keys().map(String::as_str);
        self.regions
            .get(name)
            .ok_or_else(|| SimError::unknown("region", name, known))
    }

    fn check(&self, task: &Task) -> Result<(), SimError> {
        let scene = self.nominal_scene(task)?;
        let named = [
            ("target", Some(&task.target)),
            ("destination", Some(&task.destination)),
            ("pos.move", Some(&task.pos.object)),
            ("pos.with", task.pos.with.as_ref()),
            ("pos.onto", task.pos.onto.as_ref()),
            ("other.object", Some(&task.other.object)),
        ];
        for (field, name) in named {
            let Some(name) = name else { continue };
            scene
                .by_name(name)
                .map_err(|error| error.within(format!("field `{field}`")))?;
        }
        let wrong = |problem: &str| SimError::invalid("the task", problem);
        let twice = task
            .objects
            .iter()
            .enumerate()
            .any(|(i, o)| task.objects[..i].iter().any(|p| p.name == o.name));
        if twice {
            return Err(wrong("two of its objects have the same name"));
        }
        if task.target == task.other.object || task.target == task.destination {
            return Err(wrong(
                "target, other and destination must be different objects",
            ));
        }
        if task.pos.with.is_some() == task.pos.onto.is_some() {
            return Err(wrong("pos needs either `with` or `onto`"));
        }
        if task.paraphrases.is_empty() {
            return Err(wrong(
                "it has no paraphrase: `paraphrases` needs one for sem",
            ));
        }
        if !(0.2..=3.0).contains(&task.variant.scale) {
            return Err(wrong("the variant's scale must lie in 0.2 to 3"));
        }
        Ok(())
    }
}

/// The kind with another look.
fn altered(kind: &ObjectKind, variant: &Variant) -> Result<ObjectKind, SimError> {
    if !(0.2..=3.0).contains(&variant.scale) {
        let problem = format!("a scale of {} is outside 0.2 to 3", variant.scale);
        return Err(SimError::invalid(
            format!("object `{}`", kind.label),
            problem,
        ));
    }
    Ok(ObjectKind {
        colour: variant.colour,
        ..kind.scaled(variant.scale)
    })
}

impl Task {
    /// What the task asks for, in a scene that was made from it; `object` is what is to be moved.
    ///
    /// # Errors
    /// [`SimError::Unknown`] if the scene lacks the object or the destination.
    pub fn goal_for(&self, object: &str, scene: &Scene) -> Result<Goal, SimError> {
        let object = scene.by_name(object)?.id;
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

    /// What the unperturbed task asks for.
    ///
    /// # Errors
    /// As for [`Task::goal_for`].
    pub fn goal(&self, scene: &Scene) -> Result<Goal, SimError> {
        self.goal_for(&self.target, scene)
    }
}
