//! Plays a trained network alone, as evaluations play a policy alone.

use rayon::prelude::*;
use sim_harness::SimError;
use sim_harness::alone::{Alone, AloneSetup, SETTLE_STEPS};
use sim_harness::backbone::bc::{CHUNK_STEPS, Cloned, Network};
use sim_harness::lockstep::Outcome;
use sim_harness::perturb::{Level, Perturbation, instance};
use sim_harness::sim::Sim;
use sim_harness::suite::{Suite, Task};

/// First seed of the trials: among those for choosing, never among those of a report.
const FIRST_SEED: u64 = 9_000;

/// How many of how many episodes succeed.
///
/// # Errors
/// If a scene can't be built or the physics fails.
pub(crate) fn cell(
    suite: &Suite,
    perturbation: Perturbation,
    network: &Network,
    episodes: u32,
) -> Result<(usize, usize), SimError> {
    let jobs: Vec<(&Task, u64)> = suite
        .tasks
        .iter()
        .flat_map(|t| (0..u64::from(episodes)).map(move |e| (t, FIRST_SEED + e)))
        .collect();
    let outcomes = jobs
        .par_iter()
        .map(|(task, seed)| play(suite, task, perturbation, network, *seed))
        .collect::<Result<Vec<bool>, _>>()?;
    Ok((outcomes.iter().filter(|won| **won).count(), outcomes.len()))
}

fn play(
    suite: &Suite,
    task: &Task,
    perturbation: Perturbation,
    network: &Network,
    seed: u64,
) -> Result<bool, SimError> {
    let made = instance(suite, task, perturbation, Level::Standard, seed)?;
    let mut alone = Alone::new(AloneSetup {
        sim: Sim::new(made.scene)?,
        goal: made.goal,
        instruction: made.instruction,
        backbone: Box::new(Cloned::new(network.clone())),
        open_loop: CHUNK_STEPS as u32,
        seed,
        max_steps: u64::from(suite.max_steps) + SETTLE_STEPS,
    });
    while alone.outcome().is_none() {
        alone.step()?;
    }
    Ok(alone.outcome() == Some(Outcome::Success))
}
