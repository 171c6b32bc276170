//! Perturbations: what is changed of a task, by stated rules and from a seed.
//!
//! The kinds are those of LIBERO-PRO. The scene's starts are drawn from the same seed whatever the
//! perturbation, so that cells can be compared episode by episode.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::error::SimError;
use crate::pose::distance_xy_m;
use crate::predicate::Goal;
use crate::scene::{Arena, Scene};
use crate::suite::{Alteration, Suite, Task, Variant};

/// The arenas of the Env perturbation.
const ARENAS: &str = include_str!("../assets/arenas.toml");
/// Where a displaced object may go, base frame, m: what the arm reaches over the table.
const REACH_X_M: [f64; 2] = [0.33, 0.70];
/// The same across.
const REACH_Y_M: [f64; 2] = [-0.32, 0.32];
/// Least gap between a displaced object and its neighbours, m.
const GAP_M: f64 = 0.02;
/// Where a distance has no free place, it is varied in such steps, m, both ways.
const DISTANCE_STEP_M: f64 = 0.01;
/// So many of them at most.
const DISTANCE_STEPS: u32 = 5;

/// What is perturbed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Perturbation {
    /// Nothing: the nominal scene.
    None,
    /// Another object is named, the scene stays.
    Task,
    /// Things change places.
    Pos,
    /// The target looks different, its name stays.
    Obj,
    /// The instruction is paraphrased.
    Sem,
    /// Other surroundings.
    Env,
}

impl Perturbation {
    /// All of them, nominal first.
    pub const ALL: [Self; 6] = [
        Self::None,
        Self::Task,
        Self::Pos,
        Self::Obj,
        Self::Sem,
        Self::Env,
    ];

    /// The name that tables and command lines use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Task => "task",
            Self::Pos => "pos",
            Self::Obj => "obj",
            Self::Sem => "sem",
            Self::Env => "env",
        }
    }

    /// The perturbation of that name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn by_name(name: &str) -> Result<Self, SimError> {
        Self::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| {
                SimError::unknown("perturbation", name, Self::ALL.iter().map(|p| p.name()))
            })
    }
}

/// How strongly something is perturbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// As the suite's data say; what is left open is drawn from the seed.
    Standard,
    /// Pos: the thing that moves is displaced by this distance in a drawn direction, m.
    DisplacedM(f64),
    /// Obj: the target has this size, as a multiple of the usual one, and its usual colour.
    Scaled(f64),
}

impl Level {
    /// The level as it stands in results.
    #[must_use]
    pub fn label(self) -> String {
        match self {
            Self::Standard => "standard".to_owned(),
            Self::DisplacedM(distance) => format!("displaced {distance:.3} m"),
            Self::Scaled(factor) => format!("scaled {factor:.2}"),
        }
    }
}

/// An episode's world and words.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The scene.
    pub scene: Scene,
    /// What is asked, as the judge reads it.
    pub goal: Goal,
    /// What is asked, as the robot is told.
    pub instruction: String,
    /// What was drawn, in words.
    pub drawn: String,
}

/// Makes an episode's world: starts drawn from `seed`, then the perturbation.
///
/// # Errors
/// [`SimError::Invalid`] if the level does not belong to the perturbation or cannot be realised.
pub fn instance(
    suite: &Suite,
    task: &Task,
    perturbation: Perturbation,
    level: Level,
    seed: u64,
) -> Result<Instance, SimError> {
    // Draws of the perturbation must not shift those of the starts.
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5045_5254_5552_4221);
    let nominal = || suite.sample_scene(task, seed);
    let plain = |scene: Scene, drawn: String| {
        let goal = task.goal(&scene)?;
        Ok(Instance {
            scene,
            goal,
            instruction: task.instruction.clone(),
            drawn,
        })
    };
    match (perturbation, level) {
        (Perturbation::None, Level::Standard) => plain(nominal()?, "nominal".to_owned()),
        (Perturbation::Task, Level::Standard) => {
            let scene = nominal()?;
            let goal = task.goal_for(&task.other.object, &scene)?;
            let drawn = format!("{} instead of {}", task.other.object, task.target);
            Ok(Instance {
                scene,
                goal,
                instruction: task.other.instruction.clone(),
                drawn,
            })
        }
        (Perturbation::Pos, Level::Standard) => {
            let mut scene = nominal()?;
            let moved = &task.pos.object;
            let drawn = match (&task.pos.with, &task.pos.onto) {
                (Some(with), _) => {
                    scene.swap_places(moved, with)?;
                    format!("{moved} exchanged with {with}")
                }
                (None, Some(onto)) => {
                    scene.move_onto(moved, onto)?;
                    format!("{moved} on top of {onto}")
                }
                (None, None) => String::new(),
            };
            plain(scene, drawn)
        }
        (Perturbation::Pos, Level::DisplacedM(distance_m)) => {
            let mut scene = nominal()?;
            let to = displace(&mut scene, &task.pos.object, distance_m, &mut rng)?;
            plain(
                scene,
                format!("{} to {:.3}, {:.3}", task.pos.object, to[0], to[1]),
            )
        }
        (Perturbation::Obj, Level::Standard) => {
            let scene = altered(suite, task, seed, task.variant.clone())?;
            plain(scene, format!("{:?}", task.variant))
        }
        (Perturbation::Obj, Level::Scaled(scale)) => {
            let colour = nominal()?.by_name(&task.target)?.kind.colour;
            plain(
                altered(suite, task, seed, Variant { colour, scale })?,
                level.label(),
            )
        }
        (Perturbation::Sem, Level::Standard) => {
            let index = rng.random_range(0..task.paraphrases.len());
            let scene = nominal()?;
            let goal = task.goal(&scene)?;
            let instruction = task.paraphrases[index].clone();
            Ok(Instance {
                scene,
                goal,
                instruction,
                drawn: format!("paraphrase {}", index + 1),
            })
        }
        (Perturbation::Env, Level::Standard) => {
            let arenas = arenas()?;
            let arena = arenas[rng.random_range(0..arenas.len())].clone();
            let drawn = arena.name.clone();
            let alteration = Alteration {
                arena: Some(arena),
                variant: None,
            };
            plain(suite.sample_altered(task, seed, &alteration)?, drawn)
        }
        _ => Err(SimError::invalid(
            format!("perturbation `{}`", perturbation.name()),
            format!("it has no level `{}`", level.label()),
        )),
    }
}

fn altered(suite: &Suite, task: &Task, seed: u64, variant: Variant) -> Result<Scene, SimError> {
    let alteration = Alteration {
        arena: None,
        variant: Some(variant),
    };
    suite.sample_altered(task, seed, &alteration)
}

/// Moves an object by a distance in a drawn direction, to where it fits. On a full table that is
/// the nearest distance at which there is a place.
fn displace(
    scene: &mut Scene,
    name: &str,
    distance_m: f64,
    rng: &mut ChaCha8Rng,
) -> Result<[f64; 2], SimError> {
    let first: f64 = rng.random_range(0.0..core::f64::consts::TAU);
    for step in 0..=DISTANCE_STEPS {
        let off = f64::from(step) * DISTANCE_STEP_M;
        for distance in [distance_m + off, distance_m - off] {
            if let Some(to) = free_place(scene, name, distance, first)? {
                scene.place_at(name, to)?;
                return Ok(to);
            }
        }
    }
    let problem = format!("there is no free place {distance_m} m away, nor nearly so");
    Err(SimError::invalid(format!("object `{name}`"), problem))
}

/// A place at this distance where an object fits, in directions on a golden-angle spiral from the
/// first.
fn free_place(
    scene: &Scene,
    name: &str,
    distance_m: f64,
    first: f64,
) -> Result<Option<[f64; 2]>, SimError> {
    let object = scene.by_name(name)?;
    let [x, y, _] = object.pose.position_m;
    let radius = |half: [f64; 3]| half[0].max(half[1]);
    let reach = radius(object.kind.half_extent_m());
    Ok((0..64).find_map(|turn| {
        let (sin, cos) = libm::sincos(first + 2.399_963 * f64::from(turn));
        let to = [x + distance_m * cos, y + distance_m * sin];
        let inside = (REACH_X_M[0]..=REACH_X_M[1]).contains(&to[0])
            && (REACH_Y_M[0]..=REACH_Y_M[1]).contains(&to[1]);
        let free = scene
            .objects()
            .iter()
            .filter(|o| o.id != object.id)
            .all(|o| {
                let gap = distance_xy_m(o.pose.position_m, [to[0], to[1], 0.0]);
                gap > reach + radius(o.kind.half_extent_m()) + GAP_M
            });
        (inside && free).then_some(to)
    }))
}

/// The arenas of the Env perturbation.
///
/// # Errors
/// [`SimError::Data`] if the embedded file is broken, which a test rules out.
pub fn arenas() -> Result<Vec<Arena>, SimError> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        arena: Vec<Arena>,
    }
    let file = "arenas.toml";
    let read: File = toml::from_str(ARENAS).map_err(|e| SimError::Data {
        file: file.to_owned(),
        message: e.to_string(),
    })?;
    if read.arena.is_empty() {
        return Err(SimError::invalid(file, "it has no arena"));
    }
    Ok(read.arena)
}
