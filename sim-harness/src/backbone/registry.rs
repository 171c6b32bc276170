//! Surrogates by name, from frozen data.

use serde::Deserialize;
use sha2::{Digest as _, Sha256};

use super::control::{Hold, Random};
use super::replay::ReplayParams;
use super::{Backbone, Memory, Replay};
use crate::error::SimError;
use crate::suite::Suite;

/// The embedded parameter sets.
const BACKBONES: &str = include_str!("../../assets/backbones.toml");

/// A surrogate as the data describe it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "family", rename_all = "snake_case", deny_unknown_fields)]
pub enum Spec {
    /// Replays what it memorised.
    Replay(ReplayParams),
    /// Stands still.
    Hold {
        /// Name in tables.
        name: String,
        /// Actions of a chunk.
        horizon: usize,
        /// Actions that are executed before the next query.
        open_loop: u32,
    },
    /// Moves at random.
    Random {
        /// Name in tables.
        name: String,
        /// Actions of a chunk.
        horizon: usize,
        /// Actions that are executed before the next query.
        open_loop: u32,
    },
}

impl Spec {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Replay(params) => &params.name,
            Self::Hold { name, .. } | Self::Random { name, .. } => name,
        }
    }

    /// Actions that are executed before the next query.
    #[must_use]
    pub fn open_loop(&self) -> u32 {
        match self {
            Self::Replay(params) => params.open_loop,
            Self::Hold { open_loop, .. } | Self::Random { open_loop, .. } => *open_loop,
        }
    }

    /// A policy that was trained on a suite.
    ///
    /// # Errors
    /// If the suite's names do not resolve.
    pub fn build(&self, suite: &Suite) -> Result<Box<dyn Backbone>, SimError> {
        Ok(match self {
            Self::Replay(params) => Box::new(Replay::new(params.clone(), Memory::of(suite)?)),
            Self::Hold { horizon, .. } => Box::new(Hold::new(*horizon)),
            Self::Random { horizon, .. } => Box::new(Random::new(*horizon)),
        })
    }
}

/// All surrogates that the data describe.
#[derive(Clone, Debug, PartialEq)]
pub struct Registry {
    specs: Vec<Spec>,
    sha256: String,
}

impl Registry {
    /// The embedded, frozen parameter sets.
    ///
    /// # Errors
    /// Only if the embedded file is broken, which a test rules out.
    pub fn embedded() -> Result<Self, SimError> {
        Self::parse("backbones.toml", BACKBONES)
    }

    /// Reads parameter sets. `file` is the name that errors give.
    ///
    /// # Errors
    /// [`SimError::Data`] for text of the wrong form, [`SimError::Invalid`] for a wrong value.
    pub fn parse(file: &str, text: &str) -> Result<Self, SimError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            backbone: Vec<Spec>,
        }
        let read: File = toml::from_str(text).map_err(|e| SimError::Data {
            file: file.to_owned(),
            message: e.to_string(),
        })?;
        for spec in &read.backbone {
            let problem = match spec {
                Spec::Replay(params) => params.problem(),
                Spec::Hold { horizon: 0, .. } | Spec::Random { horizon: 0, .. } => {
                    Some("horizon is 0; it must be positive".to_owned())
                }
                Spec::Hold { .. } | Spec::Random { .. } => None,
            };
            if let Some(problem) = problem {
                return Err(SimError::invalid(
                    format!("backbone `{}`", spec.name()),
                    problem,
                ));
            }
        }
        let digest = Sha256::digest(text.as_bytes());
        let sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self {
            specs: read.backbone,
            sha256,
        })
    }

    /// A surrogate by name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn get(&self, name: &str) -> Result<&Spec, SimError> {
        self.specs
            .iter()
            .find(|s| s.name() == name)
            .ok_or_else(|| SimError::unknown("backbone", name, self.names()))
    }

    /// The names of all surrogates, in the order of the data.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.specs.iter().map(Spec::name)
    }

    /// SHA-256 of the parameter file, in hexadecimal: it stands in every result.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }
}
