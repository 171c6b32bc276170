//! An episode: a task of a suite, a scene drawn by a seed, what was changed.

use anyhow::bail;
use sim_harness::{
    predicate::Goal,
    scene::Scene,
    suite::{Displacement, Suite, Task},
};

use crate::exit::BadInput;

/// How the scene differs from what the policy was trained on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, clap::ValueEnum)]
pub(crate) enum Perturbation {
    /// Not at all.
    None,
    /// The object that the instruction names has changed places with a
    /// distractor.
    #[default]
    Pos,
}

/// Which episode: reproducible from these alone.
#[derive(Clone, Debug, clap::Args)]
#[group(id = "episode")]
pub(crate) struct Args {
    /// The suite of tasks.
    #[arg(long, default_value = "object")]
    pub(crate) suite: String,
    /// The task, instead of the one that the seed draws.
    #[arg(long)]
    pub(crate) task: Option<String>,
    /// How the scene differs from training.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) perturbation: Perturbation,
    /// Draws the task, the places of things and the policy's noise.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

/// An episode before its first step.
#[derive(Clone, Debug)]
pub(crate) struct Episode {
    pub(crate) suite: Suite,
    pub(crate) task: Task,
    pub(crate) scene: Scene,
    pub(crate) goal: Goal,
}

impl Args {
    /// Draws the episode.
    ///
    /// # Errors
    /// [`BadInput`] for a name that does not exist, listing those that do.
    pub(crate) fn draw(&self) -> anyhow::Result<Episode> {
        let unknown = |error: sim_harness::SimError| BadInput(error.to_string());
        let suite = Suite::embedded(&self.suite).map_err(unknown)?;
        let task = match &self.task {
            Some(name) => suite.task(name).map_err(unknown)?.clone(),
            None => drawn_task(&suite, self.seed)?,
        };
        let mut scene = suite.sample_scene(&task, self.seed)?;
        match self.perturbation {
            Perturbation::None => {}
            Perturbation::Pos => displace(&task.pos, &mut scene)?,
        }
        let goal = task.goal(&scene)?;
        Ok(Episode {
            suite,
            task,
            scene,
            goal,
        })
    }
}

/// Moves a thing as the task's Pos perturbation says.
fn displace(pos: &Displacement, scene: &mut Scene) -> anyhow::Result<()> {
    match &pos.with {
        Some(other) => Ok(scene.swap_places(&pos.object, other)?),
        None => bail!("the task's Pos perturbation is no exchange of places"),
    }
}

/// Successive seeds go through the tasks in turn.
fn drawn_task(suite: &Suite, seed: u64) -> anyhow::Result<Task> {
    let count = suite.tasks.len() as u64;
    let index = seed
        .checked_rem(count)
        .and_then(|index| usize::try_from(index).ok());
    let task = index.and_then(|index| suite.tasks.get(index));
    Ok(task
        .ok_or_else(|| BadInput(format!("suite {} has no task", suite.name)))?
        .clone())
}
