//! Evaluation: a grid of episodes, each reproducible from its own description alone.
//!
//! An episode is named by suite, task, perturbation, level, backbone, configuration, profile,
//! perception, knowledge, seed and number. Its starts and its noise are drawn from suite, task,
//! seed and number only, so that everything else can be compared episode by episode.

mod config;
mod corrections;
mod episode;
mod grid;
mod preset;
mod record;
mod runner;
mod store;
mod witness;

pub use config::{Config, Knowledge, Profile, Vision, params_for};
pub use episode::{Moment, Watch, play, play_watched};
pub use grid::{EpisodeSpec, Grid, Shard};
pub use preset::{PAPER_SEEDS, Preset, TUNING_SEEDS};
pub use record::{Activation, CORE_VERSION, Ending, EpisodeRecord, Failure, Routine, SCHEMA};
pub use runner::{Progress, Summary, run};
pub use store::{Destination, Store};
