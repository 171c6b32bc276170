//! The grid of episodes and its shares.

use std::collections::HashMap;

use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::config::{Config, Knowledge, Profile, Vision};
use super::record::build_of;
use crate::backbone::Registry;
use crate::error::SimError;
use crate::perturb::{Level, Perturbation};
use crate::suite::Suite;

/// One episode, described completely.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeSpec {
    /// Suite: an embedded one by name, or a file.
    pub suite: String,
    /// Task within it.
    pub task: String,
    /// What is perturbed.
    pub perturbation: Perturbation,
    /// How strongly.
    pub level: Level,
    /// Surrogate.
    pub backbone: String,
    /// What of the controller is on.
    pub config: Config,
    /// The controller's parameters.
    pub profile: Profile,
    /// What it sees.
    pub vision: Vision,
    /// Who grounds the instruction for it.
    pub knowledge: Knowledge,
    /// The seed of the experiment.
    pub seed: u64,
    /// Number within task and seed, from 0.
    pub episode: u32,
}

impl EpisodeSpec {
    /// A text that names the episode among all others.
    #[must_use]
    pub fn key(&self) -> String {
        let Self {
            suite,
            task,
            backbone,
            seed,
            episode,
            ..
        } = self;
        format!(
            "{suite}/{task}/{}/{}/{backbone}/{seed}/{episode}/{}/{}/{}/{}",
            self.perturbation.name(),
            self.level.label(),
            self.config.name(),
            self.profile.name(),
            self.vision.name(),
            self.knowledge.name(),
        )
    }

    /// What all draws of the episode start from. Perturbation, backbone and configuration do not
    /// enter: paired episodes share their starts and their luck.
    #[must_use]
    pub fn draw_seed(&self) -> u64 {
        let text = format!(
            "{}/{}/{}/{}",
            self.suite, self.task, self.seed, self.episode
        );
        let digest = Sha256::digest(text.as_bytes());
        let mut first = [0; 8];
        first.copy_from_slice(&digest[..8]);
        u64::from_le_bytes(first)
    }
}

/// Which share of the grid to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Shard {
    /// Which one, from 0.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

impl Shard {
    /// Everything.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Reads `i/n`, from 0.
    ///
    /// # Errors
    /// [`SimError::Invalid`] unless 0 <= i < n.
    pub fn parse(text: &str) -> Result<Self, SimError> {
        let wrong = || {
            let problem = "a shard reads i/n with i from 0 to n - 1, as in 0/4";
            SimError::invalid(format!("shard `{text}`"), problem)
        };
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let shard = Self {
            index: index.parse().map_err(|_| wrong())?,
            count: count.parse().map_err(|_| wrong())?,
        };
        if shard.index < shard.count {
            Ok(shard)
        } else {
            Err(wrong())
        }
    }
}

/// The values that a grid is the product of.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Suites: embedded ones by name, or files whose names end in `.toml`.
    pub suites: Vec<String>,
    /// Tasks by name; empty for all.
    pub tasks: Vec<String>,
    /// Perturbations and levels.
    pub perturbations: Vec<(Perturbation, Level)>,
    /// Surrogates.
    pub backbones: Vec<String>,
    /// Configurations.
    pub configs: Vec<Config>,
    /// Profiles.
    pub profiles: Vec<Profile>,
    /// Perceptions.
    pub visions: Vec<Vision>,
    /// Who grounds.
    pub knowledges: Vec<Knowledge>,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Episodes a task and seed.
    pub episodes: u32,
}

impl Grid {
    /// All episodes, in a fixed order. The policy alone is played once whatever the profiles,
    /// perceptions and knowledge are: those are the controller's, and there is none.
    ///
    /// # Errors
    /// [`SimError::Unknown`] for a name that does not exist.
    pub fn episodes(&self) -> Result<Vec<EpisodeSpec>, SimError> {
        let registry = Registry::embedded()?;
        for name in &self.backbones {
            registry.get(name)?;
        }
        let mut specs = Vec::new();
        for suite_name in &self.suites {
            let suite = Suite::open(suite_name)?;
            for task in self.tasks_of(&suite)? {
                self.add_task(suite_name, &task, &mut specs);
            }
        }
        Ok(specs)
    }

    /// What plays the episodes now, by suite: the program's build, and the version of a suite that
    /// comes from a file.
    ///
    /// # Errors
    /// As for [`Suite::open`].
    pub fn builds(&self) -> Result<HashMap<String, String>, SimError> {
        self.suites
            .iter()
            .map(|name| Ok((name.clone(), build_of(&Suite::open(name)?))))
            .collect()
    }

    fn tasks_of(&self, suite: &Suite) -> Result<Vec<String>, SimError> {
        let all = || suite.tasks.iter().map(|t| t.name.clone()).collect();
        if self.tasks.is_empty() {
            return Ok(all());
        }
        // With several suites a task belongs to one of them.
        let own: Vec<String> = self
            .tasks
            .iter()
            .filter(|t| suite.task(t).is_ok())
            .cloned()
            .collect();
        if own.is_empty() && self.suites.len() == 1 {
            suite.task(&self.tasks[0])?;
        }
        Ok(own)
    }

    fn add_task(&self, suite: &str, task: &str, specs: &mut Vec<EpisodeSpec>) {
        for &(perturbation, level) in &self.perturbations {
            for backbone in &self.backbones {
                for controller in self.controllers() {
                    let (config, profile, vision, knowledge) = controller;
                    for &seed in &self.seeds {
                        specs.extend((0..self.episodes).map(|episode| EpisodeSpec {
                            suite: suite.to_owned(),
                            task: task.to_owned(),
                            perturbation,
                            level,
                            backbone: backbone.clone(),
                            config: config.clone(),
                            profile,
                            vision,
                            knowledge,
                            seed,
                            episode,
                        }));
                    }
                }
            }
        }
    }

    fn controllers(&self) -> Vec<(&Config, Profile, Vision, Knowledge)> {
        let mut all = Vec::new();
        for config in &self.configs {
            let mut ways = self.profiles.iter().flat_map(|&profile| {
                self.visions.iter().flat_map(move |&vision| {
                    self.knowledges
                        .iter()
                        .map(move |&knowledge| (config, profile, vision, knowledge))
                })
            });
            if config.is_base() {
                all.extend(ways.next());
            } else {
                all.extend(ways);
            }
        }
        all
    }
}
