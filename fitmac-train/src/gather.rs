//! Episodes from which the network learns: the expert's own, and later the network's.
//!
//! In the first round the expert plays, disturbed by noise on what is executed but not on what is
//! written down (DART, Laskey et al. 2017). In the rounds after it the network plays, and the
//! expert says what it would have done (DAgger, Ross et al. 2011): the network then learns in the
//! states that it gets into. All scenes are nominal ones.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use indicatif::ProgressBar;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;
use sim_harness::SimError;
use sim_harness::alone::{Alone, AloneSetup, SETTLE_STEPS};
use sim_harness::backbone::bc::{CHUNK_STEPS, Cloned, LATENCY_S, Network, features};
use sim_harness::backbone::{Backbone, Chunk, Observation};
use sim_harness::lockstep::Outcome;
use sim_harness::sim::Sim;
use sim_harness::suite::{Suite, Task};

use crate::dataset::Sample;
use crate::expert::Expert;

/// Standard deviations of the noise on the executed actions; each episode draws one.
const NOISE: [f64; 4] = [0.0, 0.05, 0.1, 0.2];
/// The same where the network plays: its own mistakes are noise enough.
const LITTLE_NOISE: [f64; 4] = [0.0, 0.0, 0.0, 0.1];
/// How much of the noise of a step is that of the step before.
const PERSISTENCE: f64 = 0.8;
/// Share of the episodes in which answers are played to the end, as in a trial.
const WHOLE: f64 = 0.5;
/// Between queries every so-many-th policy step is written down, too.
const STRIDE: u64 = 3;

/// A round of episodes.
pub(crate) struct Round<'a> {
    /// Where they play.
    pub(crate) suite: &'a Suite,
    /// Who plays; nobody but the expert in the first round.
    pub(crate) network: Option<&'a Network>,
    /// Share of the answers that are the expert's nevertheless.
    pub(crate) expert_share: f64,
    /// Episodes a task.
    pub(crate) episodes: u32,
    /// Seed of the first episode.
    pub(crate) seed: u64,
}

/// What a round gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Gathered {
    /// What was seen, and the expert's answers.
    pub(crate) samples: Vec<Sample>,
    /// Episodes.
    pub(crate) played: usize,
    /// Episodes that succeeded.
    pub(crate) succeeded: usize,
}

impl Round<'_> {
    /// Plays the round.
    ///
    /// # Errors
    /// If a scene can't be built or the physics fails.
    pub(crate) fn play(&self, bar: &ProgressBar) -> Result<Gathered, SimError> {
        let jobs: Vec<(&Task, u64)> = self
            .suite
            .tasks
            .iter()
            .enumerate()
            .flat_map(|(i, task)| {
                let first = self.seed + 1000 * i as u64;
                (0..u64::from(self.episodes)).map(move |e| (task, first + e))
            })
            .collect();
        let played: Vec<(Vec<Sample>, bool)> = jobs
            .par_iter()
            .map(|(task, seed)| {
                let one = self.one(task, *seed);
                bar.inc(1);
                one
            })
            .collect::<Result<_, _>>()?;
        Ok(Gathered {
            played: played.len(),
            succeeded: played.iter().filter(|(_, won)| *won).count(),
            samples: played.into_iter().flat_map(|(s, _)| s).collect(),
        })
    }

    /// One episode: what was seen, and whether it succeeded.
    fn one(&self, task: &Task, seed: u64) -> Result<(Vec<Sample>, bool), SimError> {
        let scene = self.suite.sample_scene(task, seed)?;
        let goal = task.goal(&scene)?;
        let sim = Sim::new(scene)?;
        let expert = Expert::new(self.suite, task, &sim)?;
        let samples = Arc::new(Mutex::new(Vec::new()));
        let player = Player {
            expert: expert.clone(),
            network: self.network.cloned().map(Cloned::new),
            expert_share: self.expert_share,
            samples: samples.clone(),
            luck: Luck::draw(seed, self.network.is_some()),
        };
        let mut alone = Alone::new(AloneSetup {
            sim,
            goal,
            instruction: task.instruction.clone(),
            backbone: Box::new(player),
            open_loop: CHUNK_STEPS as u32,
            seed,
            max_steps: u64::from(self.suite.max_steps) + SETTLE_STEPS,
        });
        while alone.outcome().is_none() {
            let acted = alone.step()?.is_some();
            let step = alone.policy_step();
            if acted && step > SETTLE_STEPS && (step + seed).is_multiple_of(STRIDE) {
                let seen = Observation::of(alone.sim(), &task.instruction, step);
                note(&expert, &seen, &samples);
            }
        }
        let samples = std::mem::take(&mut *locked(&samples));
        Ok((samples, alone.outcome() == Some(Outcome::Success)))
    }
}

type Samples = Arc<Mutex<Vec<Sample>>>;

/// Writes down what the expert would do.
fn note(expert: &Expert, seen: &Observation, samples: &Samples) {
    if !expert.can_teach(seen) {
        return;
    }
    let mut samples = locked(samples);
    let start = samples.is_empty();
    samples.push(Sample::new(features(seen), &expert.chunk(seen), start));
}

/// Nobody else holds it: each episode has its own.
fn locked(samples: &Mutex<Vec<Sample>>) -> MutexGuard<'_, Vec<Sample>> {
    samples.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What disturbs an episode.
struct Luck {
    rng: ChaCha8Rng,
    scale: f64,
    whole: bool,
    noise: [f64; 6],
}

impl Luck {
    fn draw(seed: u64, little: bool) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(!seed);
        let scales = if little { LITTLE_NOISE } else { NOISE };
        Self {
            scale: scales[rng.random_range(0..scales.len())],
            whole: rng.random_bool(WHOLE),
            noise: [0.0; 6],
            rng,
        }
    }

    fn disturb(&mut self, chunk: &mut Chunk) {
        let steps = self.rng.random_range(1..=CHUNK_STEPS);
        if !self.whole {
            chunk.actions.truncate(steps);
        }
        for action in &mut chunk.actions {
            for (part, action) in self.noise.iter_mut().zip(action) {
                let unit: f64 = StandardNormal.sample(&mut self.rng);
                let fresh = (1.0 - PERSISTENCE * PERSISTENCE).sqrt() * self.scale * unit;
                *part = PERSISTENCE * *part + fresh;
                *action = (*action + *part).clamp(-1.0, 1.0);
            }
        }
    }
}

/// Who plays an episode.
struct Player {
    expert: Expert,
    network: Option<Cloned>,
    expert_share: f64,
    samples: Samples,
    luck: Luck,
}

impl Backbone for Player {
    fn name(&self) -> &str {
        "player"
    }

    /// All draws are made when the episode is set up.
    fn reset(&mut self, _seed: u64) {}

    fn infer(&mut self, seen: &Observation) -> Chunk {
        note(&self.expert, seen, &self.samples);
        let by_expert = self.luck.rng.random_bool(self.expert_share);
        let mut chunk = match &mut self.network {
            Some(network) if !by_expert => network.infer(seen),
            _ => Chunk {
                actions: self.expert.chunk(seen).to_vec(),
                latency_s: LATENCY_S,
                copies: 1,
            },
        };
        self.luck.disturb(&mut chunk);
        chunk
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_expert_succeeds_and_repeats() {
        let suite = Suite::embedded("object").unwrap();
        let round = Round {
            suite: &suite,
            network: None,
            expert_share: 1.0,
            episodes: 1,
            seed: 500_001,
        };
        let task = suite.task("alphabet_soup").unwrap();
        let (samples, won) = round.one(task, 500_001).unwrap();
        assert!(won);
        assert!(samples.len() > 50, "{}", samples.len());
        assert!(samples[0].start && !samples[1].start);
        let closes = |s: &Sample| s.output[6] > 0.0;
        assert!(samples.iter().any(closes) && !samples.iter().all(closes));
        assert!(round.one(task, 500_001).unwrap().0 == samples);
    }
}
