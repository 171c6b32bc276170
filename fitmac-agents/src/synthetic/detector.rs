//! A detector with the faults of a real one.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use crate::scene::{Detection, Scene};

use super::catalogue::TABLE;
use super::layout::Layout;

/// Rates and magnitudes of a modelled detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorModel {
    /// Standard deviation of a position's coordinate, a fresh draw each scene, m.
    pub noise_m: f64,
    /// Standard deviation of an object's bias, one draw for all scenes, m.
    pub bias_m: f64,
    /// Standard deviation of an extent, as a share of it.
    pub size_noise: f64,
    /// Probability that an object is missed in a scene.
    pub miss: f64,
    /// Probability that it gets another object's label in a scene.
    pub confusion: f64,
    /// Probability that it is reported twice in a scene.
    pub double: f64,
    /// Probability that something is reported where nothing is, a scene.
    pub phantom: f64,
    /// Mean and standard deviation of the confidence of a detection.
    pub confidence: (f64, f64),
}

impl Default for DetectorModel {
    /// An open-vocabulary detector with a depth camera at 1 m: a default of
    /// ours, not a measurement.
    fn default() -> Self {
        Self {
            noise_m: 0.008,
            bias_m: 0.004,
            size_noise: 0.05,
            miss: 0.05,
            confusion: 0.02,
            double: 0.03,
            phantom: 0.02,
            confidence: (0.75, 0.12),
        }
    }
}

impl DetectorModel {
    /// A bad day: a distant camera, clutter, labels that the detector doesn't
    /// know well.
    #[must_use]
    pub fn harsh() -> Self {
        Self {
            noise_m: 0.025,
            bias_m: 0.012,
            size_noise: 0.15,
            miss: 0.25,
            confusion: 0.10,
            double: 0.10,
            phantom: 0.15,
            confidence: (0.55, 0.18),
        }
    }
}

/// A detector that looks at one layout.
pub(super) struct View<'m> {
    model: &'m DetectorModel,
    biases: Vec<[f64; 3]>,
}

fn normal(rng: &mut ChaCha8Rng, mean: f64, deviation: f64) -> f64 {
    Normal::new(mean, deviation).map_or(mean, |normal| normal.sample(rng))
}

impl<'m> View<'m> {
    pub(super) fn new(model: &'m DetectorModel, layout: &Layout, rng: &mut ChaCha8Rng) -> Self {
        let bias = |_: &super::layout::Thing| [0; 3].map(|_| normal(rng, 0.0, model.bias_m));
        Self {
            model,
            biases: layout.things.iter().map(bias).collect(),
        }
    }

    pub(super) fn frame(&mut self, layout: &Layout, stamp_ns: u64, rng: &mut ChaCha8Rng) -> Scene {
        let mut objects = Vec::with_capacity(layout.things.len() + 2);
        for (thing, bias) in layout.things.iter().zip(&self.biases) {
            if rng.random_bool(self.model.miss) {
                continue;
            }
            objects.push(self.seen(&thing.detection, bias, layout, rng));
            if rng.random_bool(self.model.double) {
                objects.push(self.seen(&thing.detection, bias, layout, rng));
            }
        }
        if rng.random_bool(self.model.phantom) {
            let random = rng.random_range(0..layout.things.len());
            let mut phantom = layout.things[random].detection.clone();
            phantom.position_m[0] = TABLE.centre_m[0] + rng.random_range(-0.25..0.25);
            phantom.position_m[1] = TABLE.centre_m[1] + rng.random_range(-0.35..0.35);
            phantom.confidence = normal(rng, 0.4, 0.1).clamp(0.05, 1.0);
            objects.push(phantom);
        }
        Scene {
            stamp_ns,
            camera: layout.camera.clone(),
            table: Some(TABLE),
            objects,
            fixtures: layout.fixtures.clone(),
        }
    }

    fn seen(
        &self,
        truth: &Detection,
        bias: &[f64; 3],
        layout: &Layout,
        rng: &mut ChaCha8Rng,
    ) -> Detection {
        let mut seen = truth.clone();
        for (axis, bias) in bias.iter().enumerate() {
            // Depth is as uncertain as the rest; the table holds z better.
            let share = if axis == 2 { 0.6 } else { 1.0 };
            seen.position_m[axis] += share * (bias + normal(rng, 0.0, self.model.noise_m));
            seen.size_m[axis] *= normal(rng, 1.0, self.model.size_noise).clamp(0.5, 1.5);
        }
        let (mean, deviation) = self.model.confidence;
        seen.confidence = normal(rng, mean, deviation).clamp(0.05, 1.0);
        if rng.random_bool(self.model.confusion) {
            let other = rng.random_range(0..layout.things.len());
            seen.label.clone_from(&layout.things[other].detection.label);
        }
        seen
    }
}
