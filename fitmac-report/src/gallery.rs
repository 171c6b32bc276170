//! Pictures of episodes: each is played again, which gives the same episode, before a camera.

use std::collections::{BTreeMap, HashMap};

use fitmac_core::wire::{Phase, Route};
use sim_harness::SimError;
use sim_harness::evaluation::{
    Config, EpisodeRecord, EpisodeSpec, Knowledge, Moment, Profile, Vision, Watch, play_watched,
};
use sim_harness::lockstep::Ticked;
use sim_harness::perturb::{Level, Perturbation};
use sim_harness::picture::png_bytes;
use sim_harness::raster::{Camera, picture};
use sim_harness::sim::Sim;

use crate::select::{BASE, FULL, MAIN};

/// Size of a frame, px.
const FRAME_PX: [usize; 2] = [320, 240];
/// Rays a pixel along each axis.
const SAMPLES: usize = 2;
/// Policy steps between frames: a second and a half.
const EVERY_STEPS: u64 = 30;

/// A picture of an episode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// What it shows and when.
    pub caption: String,
    /// The picture, PNG.
    pub png: Vec<u8>,
}

/// Pictures by the key of their episode.
pub type Gallery = BTreeMap<String, Vec<Frame>>;

/// Which episodes are worth pictures, the most telling first, `most` of them: what the whole
/// controller in its own profile harmed, what else failed with it, and one of each cell that it
/// saved; then the same of other settings. Of each, one of every kind comes before the second of
/// any, and the main surrogate before others.
#[must_use]
pub fn choose(records: &[EpisodeRecord], most: usize) -> Vec<&EpisodeRecord> {
    let alone: HashMap<String, bool> = records
        .iter()
        .filter(|r| r.config == BASE)
        .map(|r| (r.pair_key(), r.success))
        .collect();
    let mut seen: HashMap<_, usize> = HashMap::new();
    let mut ranked = Vec::new();
    for record in records.iter().filter(|r| r.config != BASE) {
        let own = record.config == FULL && record.profile == Profile::Guarded.name();
        let tier = match (record.success, alone.get(&record.pair_key())) {
            (false, Some(true)) => 0,
            (false, _) => 1,
            (true, Some(false)) => 2,
            (true, _) => continue,
        };
        let task = (tier < 2).then_some(&record.task);
        let kind = (
            own,
            tier,
            (&record.suite, &record.perturbation, &record.backbone),
            task,
            record.failure,
        );
        let nth = seen.entry(kind).or_default();
        *nth += 1;
        if tier < 2 || *nth == 1 {
            ranked.push(((!own, tier, *nth, record.backbone != MAIN), record));
        }
    }
    // Stable: what ranks alike keeps its order.
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().map(|(_, r)| r).take(most).collect()
}

/// Plays an episode again and takes pictures of it.
///
/// # Errors
/// If the record's names do not resolve, the physics fails, or the episode does not end as
/// recorded, which says that the record is of another version.
pub fn film(record: &EpisodeRecord) -> Result<Vec<Frame>, SimError> {
    let mut film = Film::default();
    // Another build may play alike: what counts is the episode.
    let again = EpisodeRecord {
        core: record.core.clone(),
        ..play_watched(&spec_of(record)?, &mut film)?
    };
    if again != *record {
        return Err(SimError::Invalid {
            what: record.key(),
            problem: "played again it ends otherwise: these are results of another version; \
                      evaluate into a new folder"
                .to_owned(),
        });
    }
    if let Some(error) = film.error {
        return Err(error);
    }
    Ok(film.frames)
}

/// The description of a recorded episode.
///
/// # Errors
/// [`SimError::Unknown`] or [`SimError::Invalid`] if a name or level is not known.
pub fn spec_of(record: &EpisodeRecord) -> Result<EpisodeSpec, SimError> {
    Ok(EpisodeSpec {
        suite: record.suite.clone(),
        task: record.task.clone(),
        perturbation: Perturbation::by_name(&record.perturbation)?,
        level: level_of(record)?,
        backbone: record.backbone.clone(),
        config: Config::parse(&record.config)?,
        profile: Profile::by_name(&record.profile)?,
        vision: Vision::by_name(&record.perception)?,
        knowledge: Knowledge::by_name(&record.knowledge)?,
        seed: record.seed,
        episode: record.episode,
    })
}

fn level_of(record: &EpisodeRecord) -> Result<Level, SimError> {
    let number = |text: &str| text.parse::<f64>().ok();
    let text = record.level.as_str();
    let level = if text == Level::Standard.label() {
        Some(Level::Standard)
    } else if let Some(rest) = text.strip_prefix("displaced ") {
        rest.strip_suffix(" m")
            .and_then(number)
            .map(Level::DisplacedM)
    } else {
        text.strip_prefix("scaled ")
            .and_then(number)
            .map(Level::Scaled)
    };
    level.ok_or_else(|| SimError::Invalid {
        what: record.key(),
        problem: format!("there is no level `{text}`"),
    })
}

#[derive(Default)]
struct Film {
    frames: Vec<Frame>,
    error: Option<SimError>,
    /// What acts, for captions.
    acting: String,
    step: u64,
    shown_step: Option<u64>,
    recoveries: u32,
}

impl Film {
    fn shoot(&mut self, world: &mut Sim, what: &str) {
        if self.error.is_some() || self.shown_step == Some(self.step) {
            return;
        }
        self.shown_step = Some(self.step);
        let camera = Camera::agent_view(world.scene().arena.surface_m);
        let [width, height] = FRAME_PX;
        let raster = picture(world, &camera, width, height, SAMPLES);
        match png_bytes(&raster) {
            Ok(png) => self.frames.push(Frame {
                caption: format!(
                    "{what}step {}, {:.1} s{}",
                    self.step,
                    world.time_s(),
                    self.acting
                ),
                png,
            }),
            Err(error) => self.error = Some(error),
        }
    }
}

impl Watch for Film {
    fn tick(&mut self, world: &mut Sim, ticked: &Ticked) {
        if !ticked.acted {
            return;
        }
        self.step += 1;
        if let Some(command) = ticked.command {
            self.step = command.policy_step;
            let phase =
                Phase::try_from(command.phase).map_or_else(|_| String::new(), |p| p.to_string());
            let route =
                Route::try_from(command.route).map_or_else(|_| String::new(), |r| r.to_string());
            self.acting = format!(": {phase}, {route}");
        }
        if self.step.is_multiple_of(EVERY_STEPS) {
            self.shoot(world, "");
        }
    }

    fn moment(&mut self, world: &mut Sim, step: u64, moment: Moment) {
        self.step = step;
        match moment {
            Moment::Before => self.shoot(world, "before: "),
            Moment::Failure => self.shoot(world, "onset or first correction: "),
            Moment::Recovery => {
                self.recoveries += 1;
                // One at every second of a correction.
                if self.recoveries % 2 == 1 {
                    self.shoot(world, "correction: ");
                }
            }
            Moment::End => self.shoot(world, "end: "),
        }
    }
}
