//! The scene card: what the things of a scene look like and what is asked.
//!
//! It stands in for the camera image and the operator's words. The simulator
//! writes it; the policy and the agents read it. It does not say what was
//! changed in the scene.

use std::{
    fs,
    io::ErrorKind,
    path::Path,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use sim_harness::{object::Shape, scene::Scene};

use crate::timeline::Names;

/// How long readers wait for the simulator to write it.
const WAIT_MAX: Duration = Duration::from_secs(10);
const WAIT_STEP: Duration = Duration::from_millis(20);
/// Largest card.
const SIZE_MAX: u64 = 1 << 20;

/// What the things of a scene look like and what is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Card {
    /// What the robot is told.
    pub(crate) instruction: String,
    /// Height of the working surface, base frame, m.
    pub(crate) surface_m: f64,
    /// Its colour: red, green, blue, 0 to 1.
    pub(crate) surface_colour: [f32; 3],
    /// The things, in the order of their ids.
    pub(crate) objects: Vec<Look>,
}

/// What a thing looks like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Look {
    /// The id that state samples carry.
    pub(crate) id: u16,
    /// Its name within the scene: unique.
    pub(crate) name: String,
    /// What people call such a thing.
    pub(crate) label: String,
    /// Red, green, blue, 0 to 1.
    pub(crate) colour: [f32; 3],
    /// Form and size, for pictures.
    pub(crate) shape: Shape,
}

impl Card {
    /// The card of a scene.
    pub(crate) fn of(scene: &Scene, instruction: &str) -> Self {
        let look = |object: &sim_harness::scene::PlacedObject| Look {
            id: object.id,
            name: object.name.clone(),
            label: object.kind.label.clone(),
            colour: object.kind.colour,
            shape: object.kind.shape.clone(),
        };
        Self {
            instruction: instruction.to_owned(),
            surface_m: scene.arena.surface_m,
            surface_colour: scene.arena.surface_colour,
            objects: scene.objects().iter().map(look).collect(),
        }
    }

    /// What the things are called.
    pub(crate) fn names(&self) -> Names {
        self.objects
            .iter()
            .map(|object| (object.id, object.name.clone()))
            .collect()
    }

    /// A thing by its id.
    pub(crate) fn look(&self, id: u16) -> Option<&Look> {
        self.objects.iter().find(|object| object.id == id)
    }

    /// Writes the card whole: a reader sees all of it or nothing.
    pub(crate) fn write(&self, path: &Path) -> anyhow::Result<()> {
        let partial = path.with_extension("partial");
        let text = serde_json::to_string_pretty(self)?;
        fs::write(&partial, text)
            .and_then(|()| fs::rename(&partial, path))
            .with_context(|| format!("the scene card {} cannot be written", path.display()))
    }

    /// Reads a card.
    pub(crate) fn read(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        let size = fs::metadata(path)
            .with_context(|| format!("{shown} cannot be read"))?
            .len();
        if size > SIZE_MAX {
            bail!("{shown} is larger than 1 MiB: it is no scene card");
        }
        let text = fs::read_to_string(path).with_context(|| format!("{shown} cannot be read"))?;
        serde_json::from_str(&text).with_context(|| format!("{shown} is no scene card"))
    }

    /// Reads a card that the simulator may not have written yet.
    pub(crate) fn wait_for(path: &Path) -> anyhow::Result<Self> {
        let give_up = Instant::now() + WAIT_MAX;
        loop {
            match fs::metadata(path) {
                Ok(_) => return Self::read(path),
                Err(error) if error.kind() == ErrorKind::NotFound && Instant::now() < give_up => {
                    std::thread::sleep(WAIT_STEP);
                }
                Err(error) => bail!(
                    "the scene card {} cannot be read ({error}): start `fitmac sim` with the \
                     same --card",
                    path.display()
                ),
            }
        }
    }
}
