//! Surrogates by name, from frozen data.

use serde::Deserialize;
use sha2::{Digest as _, Sha256};

use super::bc::{self, Cloned};
use super::chaos::Chaos;
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
    /// Another one of the data, whose answers are spoilt on the way. For safety, never for success
    /// rates.
    Chaos {
        /// Name in tables.
        name: String,
        /// Whose answers are spoilt.
        of: String,
        /// Share of the answers that are.
        rate: f64,
    },
    /// Plays what a network learnt from demonstrations; its weights are its parameters.
    #[serde(skip)]
    Cloned {
        /// Name in tables.
        name: String,
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
            Self::Hold { name, .. }
            | Self::Random { name, .. }
            | Self::Chaos { name, .. }
            | Self::Cloned { name } => name,
        }
    }

    /// What is wrong with it, if something is; `earlier` are the surrogates before it.
    fn problem(&self, earlier: &[Self]) -> Option<String> {
        match self {
            Self::Replay(params) => params.problem(),
            Self::Hold { horizon: 0, .. } | Self::Random { horizon: 0, .. } => {
                Some("horizon is 0; it must be positive".to_owned())
            }
            Self::Hold { .. } | Self::Random { .. } | Self::Cloned { .. } => None,
            Self::Chaos { rate, .. } if !(0.0..=1.0).contains(rate) => {
                Some(format!("rate is {rate}; a share lies in 0 to 1"))
            }
            Self::Chaos { of, .. } => {
                let known = |spec: &Self| spec.name() == of && !matches!(spec, Self::Chaos { .. });
                let problem =
                    format!("of is `{of}`; it must name an earlier set of another family");
                (!earlier.iter().any(known)).then_some(problem)
            }
        }
    }
}

/// All surrogates that the data describe.
#[derive(Clone, Debug, PartialEq)]
pub struct Registry {
    specs: Vec<Spec>,
    sha256: String,
}

impl Registry {
    /// The embedded, frozen parameter sets, and the policy that was learnt from demonstrations.
    ///
    /// # Errors
    /// Only if the embedded file is broken, which a test rules out.
    pub fn embedded() -> Result<Self, SimError> {
        let mut registry = Self::parse("backbones.toml", BACKBONES)?;
        registry.specs.push(Spec::Cloned {
            name: bc::NAME.to_owned(),
        });
        Ok(registry)
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
        for (i, spec) in read.backbone.iter().enumerate() {
            if let Some(problem) = spec.problem(&read.backbone[..i]) {
                let what = format!("backbone `{}`", spec.name());
                return Err(SimError::invalid(what, problem));
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

    /// Actions of a chunk that are executed before the next query.
    ///
    /// # Errors
    /// As for [`Registry::get`].
    pub fn open_loop(&self, name: &str) -> Result<u32, SimError> {
        match self.get(name)? {
            Spec::Replay(params) => Ok(params.open_loop),
            Spec::Hold { open_loop, .. } | Spec::Random { open_loop, .. } => Ok(*open_loop),
            Spec::Chaos { of, .. } => self.open_loop(of),
            Spec::Cloned { .. } => Ok(bc::CHUNK_STEPS as u32),
        }
    }

    /// A policy that was trained on a suite.
    ///
    /// # Errors
    /// As for [`Registry::get`], and if the suite's names do not resolve.
    pub fn build(&self, name: &str, suite: &Suite) -> Result<Box<dyn Backbone>, SimError> {
        Ok(match self.get(name)? {
            Spec::Replay(params) => Box::new(Replay::new(params.clone(), Memory::of(suite)?)),
            Spec::Cloned { .. } => Box::new(Cloned::trained_on(&suite.name)?),
            Spec::Hold { horizon, .. } => Box::new(Hold::new(*horizon)),
            Spec::Random { horizon, .. } => Box::new(Random::new(*horizon)),
            Spec::Chaos { of, rate, .. } => {
                Box::new(Chaos::new(name, self.build(of, suite)?, *rate))
            }
        })
    }

    /// The names of all surrogates, in the order of the data.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.specs.iter().map(Spec::name)
    }

    /// The first twelve hexadecimal digits of the SHA-256 of what defines a surrogate, its
    /// parameters or weights: they stand in every result.
    ///
    /// # Errors
    /// As for [`Registry::get`].
    pub fn fingerprint(&self, name: &str) -> Result<String, SimError> {
        let digits = match self.get(name)? {
            Spec::Cloned { .. } => bc::weights_sha256(),
            _ => self.sha256.clone(),
        };
        Ok(digits.chars().take(12).collect())
    }

    /// SHA-256 of the parameter file, in hexadecimal.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.sha256
    }
}
