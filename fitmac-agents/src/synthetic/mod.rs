//! Generated scenes with known truth, seen through a modelled detector.
//!
//! For measuring the grounder: what a relation means here is written apart
//! from the grounder's scores, crisp and with margins, so that one can be
//! wrong without the other.

mod catalogue;
mod detector;
mod layout;
mod placing;
mod reliability;
mod truth;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::grounder::{self, Context, Grounding, Verdict, kappa::Evidence};
use crate::planner::plan;
use crate::scene::Scene;
use crate::track::{TrackParams, Tracker};

pub use detector::DetectorModel;
pub use layout::Layout;
pub use reliability::{Bin, calibration_error, reliability};
pub use truth::Truth;

/// Scenes that the detector reports before the grounder is asked.
const FRAMES: u64 = 5;

/// Time between two of them, ns.
const FRAME_NS: u64 = 200_000_000;

/// An instruction, what is true of it, and what a detector reported.
#[derive(Clone, Debug)]
pub struct Case {
    /// The instruction.
    pub instruction: String,
    /// Kind of scene, for tables, as in "next to".
    pub kind: &'static str,
    /// Which object is meant.
    pub truth: Truth,
    /// True positions of the objects, m.
    pub positions_m: Vec<[f64; 3]>,
    /// What the detector reported, in order.
    pub frames: Vec<Scene>,
}

/// Draws a case from a seed and a number.
#[must_use]
pub fn case(seed: u64, number: u64, model: &DetectorModel) -> Case {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    let layout = Layout::draw(&mut rng);
    let mut view = detector::View::new(model, &layout, &mut rng);
    let frames = (0..FRAMES)
        .map(|frame| view.frame(&layout, frame * FRAME_NS, &mut rng))
        .collect();
    Case {
        instruction: layout.instruction(),
        kind: layout.kind(),
        truth: layout.truth(rng.random_range(0..usize::MAX)),
        positions_m: layout
            .things
            .iter()
            .map(|thing| thing.detection.position_m)
            .collect(),
        frames,
    }
}

/// What the grounder made of a case.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Kind of scene.
    pub kind: &'static str,
    /// True if exactly one object is meant.
    pub clear: bool,
    /// True if the selected object is the one that is meant.
    pub right: bool,
    /// Distance of the selected object's reported position from its true one, m.
    pub error_m: Option<f64>,
    /// How the grounding ended.
    pub verdict: Verdict,
    /// Its confidence.
    pub kappa: f64,
    /// What the confidence was computed from.
    pub evidence: Option<Evidence>,
}

/// Plans, tracks and grounds a case.
///
/// # Panics
/// If the planner doesn't understand the generated instruction.
#[must_use]
pub fn run(case: &Case) -> (Grounding, Outcome) {
    let plan = plan(&case.instruction).expect("a sentence");
    assert!(plan.understood(), "not understood: {}", case.instruction);
    let mut tracker = Tracker::new(TrackParams::default());
    let mut scene = Scene::default();
    for frame in &case.frames {
        scene = tracker.update(frame).scene;
    }
    let subtask = &plan.subtasks[0];
    let grounding = grounder::ground(subtask, &scene, &Context::default());
    let selected = grounding
        .selected()
        .and_then(|candidate| scene.objects.get(candidate.seen.index))
        .and_then(|object| nearest(&object.position_m, &case.positions_m));
    let error_m = selected.map(|(_, error_m)| error_m);
    let selected = selected.map(|(object, _)| object);
    let outcome = Outcome {
        kind: case.kind,
        clear: matches!(case.truth, Truth::One(_)),
        right: match case.truth {
            Truth::One(object) | Truth::OneOfSeveral(object) => selected == Some(object),
            Truth::None => false,
        },
        error_m,
        verdict: grounding.verdict,
        kappa: grounding.confidence,
        evidence: grounder::evidence(subtask, &scene, &Context::default()),
    };
    (grounding, outcome)
}

/// The true object that a reported position belongs to, and how far off it is,
/// m: the nearest within the tracker's gate. Which instance is meant is one
/// question, where exactly it stands another.
fn nearest(position: &[f64; 3], all: &[[f64; 3]]) -> Option<(usize, f64)> {
    let distance = |other: &[f64; 3]| -> f64 {
        position
            .iter()
            .zip(other)
            .map(|(a, b)| (a - b) * (a - b))
            .sum::<f64>()
            .sqrt()
    };
    let (index, best) = all
        .iter()
        .map(distance)
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best < TrackParams::default().gate_m).then_some((index, best))
}
