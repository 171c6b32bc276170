//! Pose sources: what the controller is told of the objects.
//!
//! Evaluations report both: the truth, and a model of a perception system with two cameras, one
//! in front of the robot and one at its wrist. The model sees what a ray from a camera reaches; it
//! answers late, adds noise and a bias to each object, now and then misses an object, gives its
//! pose to another one or calls it by another name. It tracks: poses of things at rest are
//! smoothed, and a jump is believed only when a second frame confirms it.

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;

use crate::action::PHYSICS_STEP_S;
use crate::error::SimError;
use crate::pose::{Pose, distance_m};
use crate::raster::{Camera, first_hits};
use crate::scene::PlacedObject;
use crate::sim::{Owner, Sim};

/// Where poses come from.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseSource {
    /// The simulator's own poses, at once.
    Truth,
    /// A modelled perception.
    Modelled(PerceptionParams),
}

/// The embedded parameters, with their sources.
const PERCEPTION: &str = include_str!("../assets/perception.toml");

/// How good a modelled perception is.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerceptionParams {
    /// Frames a second.
    pub rate_hz: f64,
    /// From a frame to the poses that come of it, s.
    pub latency_s: f64,
    /// Standard deviation of each coordinate's slowly drifting error, m.
    pub bias_m: f64,
    /// Time over which that error drifts, s.
    pub bias_time_s: f64,
    /// Standard deviation of each coordinate in each frame, m.
    pub noise_m: f64,
    /// Standard deviation of the orientation in each frame, rad.
    pub noise_rad: f64,
    /// Probability that a visible object is missed in a frame.
    pub dropout: f64,
    /// Probability that an object's pose is given to another one in a frame.
    pub misdetection: f64,
    /// Probability that an object is called by another one's name in a frame.
    pub mislabel: f64,
    /// Share of an object's sample points that a camera must see.
    pub min_visible: f64,
}

impl PerceptionParams {
    /// The embedded parameters: an RGB-D tracker of a good laboratory.
    ///
    /// # Errors
    /// Only if the embedded file is broken, which a test rules out.
    pub fn embedded() -> Result<Self, SimError> {
        Self::parse("perception.toml", PERCEPTION)
    }

    /// Reads parameters. `file` is the name that errors give.
    ///
    /// # Errors
    /// [`SimError::Data`] for text of the wrong form, [`SimError::Invalid`] for a wrong value.
    pub fn parse(file: &str, text: &str) -> Result<Self, SimError> {
        let read: Self = toml::from_str(text).map_err(|e| SimError::Data {
            file: file.to_owned(),
            message: e.to_string(),
        })?;
        read.problem()
            .map_or(Ok(read), |problem| Err(SimError::invalid(file, problem)))
    }

    /// Names the first value that is out of range.
    fn problem(&self) -> Option<String> {
        let shares = [
            ("dropout", self.dropout),
            ("misdetection", self.misdetection),
            ("mislabel", self.mislabel),
            ("min_visible", self.min_visible),
        ];
        if let Some((name, value)) = shares.iter().find(|(_, p)| !(0.0..=1.0).contains(p)) {
            return Some(format!("{name} is {value}; a share lies in 0 to 1"));
        }
        let sizes = [
            ("latency_s", self.latency_s),
            ("bias_m", self.bias_m),
            ("noise_m", self.noise_m),
            ("noise_rad", self.noise_rad),
        ];
        if let Some((name, value)) = sizes.iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0)) {
            return Some(format!("{name} is {value}; it must not be negative"));
        }
        if !(self.bias_time_s.is_finite() && self.bias_time_s > 0.0) {
            return Some(format!(
                "bias_time_s is {}; it must be positive",
                self.bias_time_s
            ));
        }
        let steps = 1.0 / (self.rate_hz * PHYSICS_STEP_S);
        let whole = steps.is_finite() && steps >= 1.0 && (steps - steps.round()).abs() < 1e-6;
        (!whole).then(|| format!("rate_hz is {}; it must divide 500", self.rate_hz))
    }

    /// Physics steps between frames.
    fn frame_steps(&self) -> u64 {
        (1.0 / (self.rate_hz * PHYSICS_STEP_S)).round() as u64
    }

    /// How much of the drifting error is left a frame later.
    fn bias_kept(&self) -> f64 {
        libm::exp(-1.0 / (self.rate_hz * self.bias_time_s))
    }
}

/// Weight of a new position against the smoothed one, for things at rest.
const SMOOTHING: f64 = 0.4;
/// Farther than this from the smoothed position a thing has moved, m.
const MOVED_M: f64 = 0.010;
/// Farther than this in one frame is a jump, m: beyond what an arm does in 50 ms.
const JUMP_M: f64 = 0.06;
/// Two frames confirm each other's jump within this distance, m.
const CONFIRMED_M: f64 = 0.03;
/// Points of an object that rays are cast at, as multiples of its half extent.
const SAMPLE_POINTS: [[f64; 3]; 13] = [
    [0.0, 0.0, 0.9],
    [0.7, 0.0, 0.9],
    [-0.7, 0.0, 0.9],
    [0.0, 0.7, 0.9],
    [0.0, -0.7, 0.9],
    [0.9, 0.0, 0.0],
    [-0.9, 0.0, 0.0],
    [0.0, 0.9, 0.0],
    [0.0, -0.9, 0.0],
    [0.9, 0.9, 0.0],
    [0.9, -0.9, 0.0],
    [-0.9, 0.9, 0.0],
    [-0.9, -0.9, 0.0],
];

/// Frames over which an object's name is voted.
const VOTES: usize = 9;

/// What is known of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Identity within the scene.
    pub id: u16,
    /// Whose name it gets by a vote over the newest frames: its own id, if all goes well.
    pub named_as: u16,
    /// Where it was.
    pub pose: Pose,
    /// When the frame was taken, ns of simulated time.
    pub stamp_ns: u64,
    /// Whether the newest frame showed it.
    pub visible: bool,
    /// How sure the source is, 0 to 1.
    pub confidence: f64,
}

/// A frame that is still being worked on.
#[derive(Clone, Debug)]
struct Frame {
    ready_ns: u64,
    stamp_ns: u64,
    seen: Vec<Option<Measured>>,
}

#[derive(Clone, Copy, Debug)]
struct Measured {
    pose: Pose,
    named_as: u16,
    confidence: f64,
}

/// A running pose source.
#[derive(Clone, Debug)]
pub struct Perception {
    source: PoseSource,
    rng: ChaCha8Rng,
    bias_m: Vec<Vector3<f64>>,
    frames: VecDeque<Frame>,
    tracks: Vec<Option<Sighting>>,
    unconfirmed: Vec<Option<Pose>>,
    votes: Vec<VecDeque<u16>>,
}

impl Perception {
    /// A source for the objects of a simulator, with noise drawn from `seed`.
    #[must_use]
    pub fn new(source: PoseSource, sim: &Sim, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let count = sim.scene().objects().len();
        let bias = match &source {
            PoseSource::Truth => 0.0,
            PoseSource::Modelled(p) => p.bias_m,
        };
        let bias_m = (0..count).map(|_| bias * unit_noise(&mut rng)).collect();
        Self {
            source,
            rng,
            bias_m,
            frames: VecDeque::new(),
            tracks: vec![None; count],
            unconfirmed: vec![None; count],
            votes: vec![VecDeque::with_capacity(VOTES); count],
        }
    }

    /// Takes a frame if one is due at this physics step.
    pub fn capture(&mut self, step: u64, now_ns: u64, sim: &mut Sim) {
        let PoseSource::Modelled(params) = &self.source else {
            return;
        };
        if step.is_multiple_of(params.frame_steps()) {
            let params = params.clone();
            let frame = self.measure(now_ns, sim, &params);
            self.frames.push_back(frame);
        }
    }

    /// Brings what is known up to date, to be read by [`Perception::sightings`].
    pub fn update(&mut self, now_ns: u64, sim: &Sim) {
        if self.source == PoseSource::Truth {
            for (slot, object) in self.tracks.iter_mut().zip(sim.objects()) {
                *slot = Some(Sighting {
                    id: object.id,
                    named_as: object.id,
                    pose: object.pose,
                    stamp_ns: now_ns,
                    visible: true,
                    confidence: 1.0,
                });
            }
        }
        while self.frames.front().is_some_and(|f| f.ready_ns <= now_ns) {
            if let Some(frame) = self.frames.pop_front() {
                self.take(&frame);
            }
        }
    }

    /// What is known, by ascending id; objects that were never seen are missing.
    pub fn sightings(&self) -> impl Iterator<Item = &Sighting> {
        self.tracks.iter().flatten()
    }

    fn measure(&mut self, now_ns: u64, sim: &mut Sim, params: &PerceptionParams) -> Frame {
        let shares = visible_shares(sim);
        let kept = params.bias_kept();
        let objects = sim.objects();
        let rng = &mut self.rng;
        let mut seen: Vec<Option<Measured>> = Vec::with_capacity(objects.len());
        for (i, object) in objects.iter().enumerate() {
            // Every draw is made for every object, so that one object's luck is not another's.
            let drift = params.bias_m * libm::sqrt(1.0 - kept * kept) * unit_noise(rng);
            self.bias_m[i] = kept * self.bias_m[i] + drift;
            let noise = params.noise_m * unit_noise(rng) + self.bias_m[i];
            let turn = params.noise_rad * unit_noise(rng);
            let missed = rng.random_bool(params.dropout);
            let misnamed = rng.random_bool(params.mislabel);
            let name = rng.random_range(0..objects.len());
            let doubt: f64 = rng.random_range(0.0..0.1);
            let hidden = shares[i] < params.min_visible;
            seen.push((!missed && !hidden).then(|| Measured {
                pose: moved(&object.pose, noise, turn),
                named_as: objects[if misnamed { name } else { i }].id,
                confidence: (0.85 + 0.2 * shares[i] - doubt).clamp(0.0, 1.0),
            }));
        }
        for i in 0..seen.len() {
            if rng.random_bool(params.misdetection) {
                let other = rng.random_range(0..seen.len());
                let stolen = seen[other].as_ref().map(|m| m.pose);
                if let (Some(measured), Some(pose)) = (&mut seen[i], stolen) {
                    measured.pose = pose;
                }
            }
        }
        let late = std::time::Duration::from_secs_f64(params.latency_s).as_nanos() as u64;
        Frame {
            ready_ns: now_ns.saturating_add(late),
            stamp_ns: now_ns,
            seen,
        }
    }

    fn take(&mut self, frame: &Frame) {
        for (i, measured) in frame.seen.iter().enumerate() {
            let id = u16::try_from(i + 1).unwrap_or(u16::MAX);
            let Some(measured) = measured else {
                if let Some(known) = &mut self.tracks[i] {
                    known.visible = false;
                }
                continue;
            };
            let named_as = vote(&mut self.votes[i], measured.named_as);
            let Some(known) = &mut self.tracks[i] else {
                self.tracks[i] = Some(Sighting {
                    id,
                    named_as,
                    pose: measured.pose,
                    stamp_ns: frame.stamp_ns,
                    visible: true,
                    confidence: measured.confidence,
                });
                continue;
            };
            let step = distance_m(known.pose.position_m, measured.pose.position_m);
            // A thing that was long unseen may be anywhere by now.
            let gap_s = frame.stamp_ns.saturating_sub(known.stamp_ns) as f64 * 1e-9;
            let reach = JUMP_M * (gap_s / 0.05).max(1.0);
            let doubtful = step > reach
                && !self.unconfirmed[i].is_some_and(|p| {
                    distance_m(p.position_m, measured.pose.position_m) < CONFIRMED_M
                });
            if doubtful {
                self.unconfirmed[i] = Some(measured.pose);
                known.visible = false;
                continue;
            }
            self.unconfirmed[i] = None;
            known.pose = if step < MOVED_M {
                blend(&known.pose, &measured.pose, SMOOTHING)
            } else {
                measured.pose
            };
            known.named_as = named_as;
            known.stamp_ns = frame.stamp_ns;
            known.visible = true;
            known.confidence = measured.confidence;
        }
    }
}

/// The name with the most votes; the newest wins a tie.
fn vote(votes: &mut VecDeque<u16>, newest: u16) -> u16 {
    if votes.len() == VOTES {
        votes.pop_front();
    }
    votes.push_back(newest);
    let count = |name: u16| votes.iter().filter(|&&v| v == name).count();
    votes
        .iter()
        .rev()
        .copied()
        .max_by_key(|&name| (count(name), name == newest))
        .unwrap_or(newest)
}

/// For each object, the larger share of its sample points that one of the cameras sees.
fn visible_shares(sim: &mut Sim) -> Vec<f64> {
    let surface_m = sim.scene().arena.surface_m;
    let cameras = [
        Camera::agent_view(surface_m).position_m,
        Camera::wrist(&sim.robot()).position_m,
    ];
    let points: Vec<(u16, [f64; 3])> = sim
        .scene()
        .objects()
        .iter()
        .zip(sim.objects())
        .flat_map(|(placed, object)| sample_points(placed, &object.pose))
        .collect();
    let targets: Vec<[f64; 3]> = points.iter().map(|(_, p)| *p).collect();
    let mut shares = vec![0.0; sim.scene().objects().len()];
    for camera in cameras {
        let mut seen = vec![0_u32; shares.len()];
        for ((id, _), hit) in points.iter().zip(first_hits(sim, camera, &targets)) {
            if hit == Some(Owner::Object(*id)) {
                seen[usize::from(*id) - 1] += 1;
            }
        }
        for (share, seen) in shares.iter_mut().zip(seen) {
            *share = f64::max(*share, f64::from(seen) / SAMPLE_POINTS.len() as f64);
        }
    }
    shares
}

fn sample_points(placed: &PlacedObject, pose: &Pose) -> Vec<(u16, [f64; 3])> {
    let half = placed.kind.half_extent_m();
    let iso = pose.isometry();
    SAMPLE_POINTS
        .iter()
        .map(|point| {
            let local =
                nalgebra::Point3::from(std::array::from_fn::<f64, 3, _>(|i| half[i] * point[i]));
            (placed.id, (iso * local).into())
        })
        .collect()
}

fn unit_noise(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    let mut draw = || -> f64 { StandardNormal.sample(&mut *rng) };
    Vector3::new(draw(), draw(), draw())
}

fn moved(pose: &Pose, by_m: Vector3<f64>, turn: Vector3<f64>) -> Pose {
    let mut iso = pose.isometry();
    iso.translation.vector += by_m;
    iso.rotation = UnitQuaternion::from_scaled_axis(turn) * iso.rotation;
    Pose::from_isometry(&iso)
}

fn blend(from: &Pose, to: &Pose, share: f64) -> Pose {
    Pose::from_isometry(&from.isometry().lerp_slerp(&to.isometry(), share))
}
