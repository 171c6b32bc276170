//! Tables, plots and a page of evaluation results.
//!
//! [`load`](load::load) reads what `fitmac eval` wrote, [`Report::of`] makes tables and plots of
//! it, [`render`] writes them as Markdown, JSON and one HTML page. Every policy here is a surrogate
//! that stands for a model; no figure of ours is of the model itself, and the report says so
//! wherever one stands.
//!
//! A crate of its own: it needs the records of an evaluation and nothing of the physics, so that
//! work on tables does not rebuild the simulator.

pub mod error;
pub mod gallery;
pub mod load;
pub mod pairs;
pub mod paper;
mod plots;
pub mod render;
pub mod select;
pub mod stats;
pub mod table;
pub mod tables;

use serde::Serialize;
use sim_harness::evaluation::EpisodeRecord;

pub use error::ReportError;
use gallery::Gallery;
use load::{Loaded, Problem};
use pairs::Pairs;
use paper::Paper;
use select::{Episodes, SeedClass, Setting};
use table::Table;
use tables::Source;

/// Version of the report's JSON.
pub const REPORT_SCHEMA: u32 = 1;

/// What the report is about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct About {
    /// Episodes in the tables.
    pub episodes: usize,
    /// Episodes of other classes of seeds, which are left out.
    pub left_out: usize,
    /// Lines that repeated an episode.
    pub repeated: usize,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// What they are for.
    pub seed_class: SeedClass,
    /// The policies: surrogates, all of them.
    pub surrogates: Vec<Surrogate>,
    /// Versions of the controller.
    pub versions: Vec<String>,
    /// Files that were read.
    pub files: Vec<String>,
    /// What a reader has to know before believing a figure.
    pub warnings: Vec<String>,
}

/// A policy that stands for a model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Surrogate {
    /// Its name.
    pub name: String,
    /// The paper's model that it is named after, if any.
    pub stands_for: Option<&'static str>,
    /// First digits of the SHA-256 of its parameters.
    pub hashes: Vec<String>,
}

/// What the controller does to all surrogates under a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The setting.
    pub setting: Setting,
    /// Its heading.
    pub label: String,
    /// With and without the controller.
    pub pairs: Pairs,
}

/// A plot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Plot {
    /// Identifier, unique within the report.
    pub id: String,
    /// Heading.
    pub title: String,
    /// What it shows.
    pub caption: String,
    /// The drawing, SVG.
    #[serde(skip)]
    pub svg: String,
}

/// A report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// [`REPORT_SCHEMA`].
    pub schema: u32,
    /// What it is about.
    pub about: About,
    /// What could not be used.
    pub problems: Vec<Problem>,
    /// What FIT-MAC does, in short.
    pub verdicts: Vec<Verdict>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Plots.
    pub plots: Vec<Plot>,
    /// Pictures for the page, by the key of their episode.
    #[serde(skip)]
    pub pictures: Gallery,
    /// The episodes, for the page's timelines.
    #[serde(skip)]
    pub episodes: Vec<EpisodeRecord>,
}

impl Report {
    /// Makes a report.
    ///
    /// # Errors
    /// [`ReportError::Nothing`] if there is no episode.
    pub fn of(loaded: &Loaded) -> Result<Self, ReportError> {
        if loaded.records.is_empty() {
            return Err(ReportError::Nothing);
        }
        let paper = Paper::embedded()?;
        let episodes = Episodes::of(&loaded.records);
        let source = Source {
            episodes: &episodes,
            paper: &paper,
        };
        let verdicts = episodes.settings().into_iter().filter_map(|setting| {
            Some(Verdict {
                pairs: tables::pairs_of(source, None, &setting)?,
                label: setting.label(),
                setting,
            })
        });
        Ok(Self {
            schema: REPORT_SCHEMA,
            about: About::of(loaded, &episodes),
            problems: loaded.problems.clone(),
            verdicts: verdicts.collect(),
            tables: tables::all(source),
            plots: plots::all(source),
            pictures: Gallery::new(),
            episodes: episodes.all().iter().map(|r| (*r).clone()).collect(),
        })
    }
}

impl About {
    fn of(loaded: &Loaded, episodes: &Episodes<'_>) -> Self {
        let mut seeds: Vec<u64> = episodes.all().iter().map(|r| r.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        let surrogates: Vec<Surrogate> = episodes
            .backbones()
            .into_iter()
            .map(|name| Surrogate {
                name: name.to_owned(),
                stands_for: paper::model_of(name),
                hashes: hashes(episodes, name),
            })
            .collect();
        let versions: Vec<String> = episodes
            .values(|r| &r.core)
            .into_iter()
            .map(str::to_owned)
            .collect();
        let mut about = Self {
            episodes: episodes.all().len(),
            left_out: episodes.left_out,
            repeated: loaded.repeated,
            seeds,
            seed_class: episodes.class,
            surrogates,
            versions,
            files: loaded.files.clone(),
            warnings: Vec::new(),
        };
        about.warnings = about.warn(loaded.problems.len());
        about
    }

    fn warn(&self, problems: usize) -> Vec<String> {
        let mut warnings = Vec::new();
        match self.seed_class {
            SeedClass::Paper => {}
            SeedClass::Tuning => warnings.push(
                "These are tuning seeds: the figures say how choosing parameters went, and are no \
                 result."
                    .to_owned(),
            ),
            SeedClass::Other => warnings.push(
                "These seeds are neither the paper's nor tuning seeds: say so where a figure is \
                 quoted."
                    .to_owned(),
            ),
        }
        if self.left_out > 0 {
            warnings.push(format!(
                "{} episodes of other kinds of seeds are left out: kinds are never pooled.",
                self.left_out
            ));
        }
        for surrogate in self.surrogates.iter().filter(|s| s.hashes.len() > 1) {
            warnings.push(format!(
                "Results of {} versions of the {} surrogate are mixed ({}): report on them \
                 separately.",
                surrogate.hashes.len(),
                surrogate.name,
                surrogate.hashes.join(", ")
            ));
        }
        if self.versions.len() > 1 {
            warnings.push(format!(
                "Results of several versions of the controller are mixed: {}.",
                self.versions.join(", ")
            ));
        }
        if problems > 0 {
            warnings.push(format!(
                "{problems} lines could not be used; they are listed below."
            ));
        }
        warnings
    }
}

fn hashes(episodes: &Episodes<'_>, backbone: &str) -> Vec<String> {
    let own = episodes.all().iter().filter(|r| r.backbone == backbone);
    let mut hashes: Vec<String> = own.map(|r| r.backbone_hash.clone()).collect();
    hashes.sort();
    hashes.dedup();
    hashes
}
