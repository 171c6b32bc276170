//! Pictures of an episode: snapshots while it runs, drawn when it is over, so
//! that drawing takes no time from the robot.

use std::{fs, path::PathBuf};

use anyhow::Context;
use sim_harness::{
    picture::{self, Frame},
    plot::{self, Sample},
    raster::{self, Camera},
    sim::Snapshot,
};

use super::plant::Plant;

/// Size of a frame, px.
const FRAME_PX: (usize, usize) = (400, 300);
/// Rays a pixel in each direction.
const RAYS: usize = 2;
/// Size of the plot, px.
const PLOT_PX: (usize, usize) = (1000, 520);
/// The target is on its way when it has risen this far, m.
const CARRIED_M: f64 = 0.08;

/// The moments that people want to see, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moment {
    Before,
    Failure,
    Recovery,
    End,
}

/// What was kept of an episode.
pub(super) struct Film {
    folder: Option<PathBuf>,
    shots: Vec<Shot>,
    samples: Vec<Sample>,
}

struct Shot {
    moment: Moment,
    snapshot: Snapshot,
    title: String,
    detail: String,
}

impl Film {
    /// A film that goes to a folder, or nowhere.
    pub(super) fn new(folder: Option<PathBuf>) -> Self {
        Self {
            folder,
            shots: Vec::new(),
            samples: Vec::new(),
        }
    }

    /// Looks at the plant, 20 times a second.
    pub(super) fn watch(&mut self, plant: &mut Plant) {
        if self.folder.is_none() || self.has(Moment::End) {
            return;
        }
        self.sample(plant);
        if let Some((moment, title)) = self.news(plant) {
            let progress = plant.progress();
            let time_s = plant.time_s();
            self.shots.push(Shot {
                moment,
                snapshot: plant.sim().snapshot(),
                title,
                detail: format!("{time_s:.1} s, {}, {}", progress.phase, progress.route),
            });
        }
    }

    fn has(&self, moment: Moment) -> bool {
        self.shots.iter().any(|shot| shot.moment == moment)
    }

    /// A moment that has come and was not taken yet, with its title.
    fn news(&self, plant: &mut Plant) -> Option<(Moment, String)> {
        let corrects = plant.corrects();
        let wrong = plant.lifted().filter(|&id| id != plant.target());
        let carried = plant.target_risen_m() > CARRIED_M;
        let (moment, title) = if !self.has(Moment::Before) {
            (Moment::Before, "before".to_owned())
        } else if let Some(success) = plant.verdict() {
            (
                Moment::End,
                if success {
                    "end: success"
                } else {
                    "end: failure"
                }
                .to_owned(),
            )
        } else if let Some(id) = wrong
            && !self.has(Moment::Failure)
        {
            let object = plant.sim().scene().by_id(id);
            let name = object.map_or("an object", |object| &object.kind.label);
            (Moment::Failure, format!("failure: lifts {name}"))
        } else if corrects && !self.has(Moment::Failure) {
            (Moment::Failure, "failure detected".to_owned())
        } else if carried && self.has(Moment::Failure) && wrong.is_none() {
            (Moment::Recovery, "recovery".to_owned())
        } else {
            return None;
        };
        (!self.has(moment)).then_some((moment, title))
    }

    fn sample(&mut self, plant: &Plant) {
        let progress = plant.progress();
        self.samples.push(Sample {
            time_s: plant.time_s(),
            target_distance_m: progress.target_distance_m,
            destination_distance_m: progress.destination_distance_m,
            gripper_width_m: plant.gripper_width_m(),
            phase: progress.phase,
            route: progress.route,
        });
    }

    /// Draws what was kept and returns the names of the files.
    pub(super) fn develop(self, plant: &mut Plant) -> anyhow::Result<Vec<String>> {
        let Some(folder) = &self.folder else {
            return Ok(Vec::new());
        };
        fs::create_dir_all(folder)
            .with_context(|| format!("{} cannot be written", folder.display()))?;
        let camera = Camera::agent_view(plant.sim().scene().arena.surface_m);
        let mut frames = Vec::new();
        for shot in &self.shots {
            plant.sim().restore(&shot.snapshot)?;
            let (width, height) = FRAME_PX;
            frames.push(Frame {
                raster: raster::picture(plant.sim(), &camera, width, height, RAYS),
                title: shot.title.clone(),
                detail: shot.detail.clone(),
            });
        }
        picture::write_png(&folder.join("strip.png"), &picture::strip(&frames)?)?;
        let (width, height) = PLOT_PX;
        let plot = plot::episode("distances, phase and route", &self.samples, width, height)?;
        picture::write_png(&folder.join("plot.png"), &plot)?;
        Ok(["strip.png", "plot.png"].map(str::to_owned).into())
    }
}
