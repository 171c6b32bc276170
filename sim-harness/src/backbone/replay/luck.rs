//! What an episode draws: the same for the same seed, whatever happens in it.

use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::params::ReplayParams;

/// Duration of a hang, s.
const HANG_S: f64 = 3.0;
/// The 99th percentile of the standard normal distribution.
const Z_99: f64 = 2.326_347_9;

/// How an episode goes wrong that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Break {
    /// The grasp misses by this much, m.
    NearMiss(Vector3<f64>),
    /// It stops above the target.
    Stall,
    /// It lets go on the way.
    DropEarly,
}

/// What happens when the motion is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    Hold,
    Dither { rate_hz: f64 },
    Push(Vector3<f64>),
}

/// Draws of an episode. Each is made whether it matters or not, so that what one parameter says
/// does not shift the draws of another.
#[derive(Clone, Debug)]
pub(super) struct Luck {
    rng: ChaCha8Rng,
    pub(super) language: f64,
    pub(super) follow: f64,
    pub(super) look: f64,
    pub(super) text: f64,
    pub(super) height: f64,
    pub(super) premature: f64,
    pub(super) premature_height_m: f64,
    pub(super) breaks: Break,
    pub(super) end: End,
    pub(super) close_wait: u32,
}

impl Luck {
    pub(super) fn draw(params: &ReplayParams, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = || -> f64 { rng.random() };
        let [language, follow, look, text, height, premature] = std::array::from_fn(|_| uniform());
        let premature_height_m = 0.03 + 0.03 * uniform();
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * uniform());
        let miss_m = 0.045 + 0.03 * uniform();
        let breaks = match (3.0 * uniform()) as u32 {
            0 => Break::NearMiss(Vector3::new(miss_m * cos, miss_m * sin, 0.0)),
            1 => Break::Stall,
            _ => Break::DropEarly,
        };
        let weights = params.end;
        let pick = uniform() * (weights.hold + weights.dither + weights.push);
        let rate_hz = 2.0 + 2.0 * uniform();
        let end = if pick < weights.hold {
            End::Hold
        } else if pick < weights.hold + weights.dither {
            End::Dither { rate_hz }
        } else {
            End::Push(Vector3::new(0.3 * cos, 0.3 * sin, -0.2))
        };
        let close_wait = rng.random_range(0..=2 * params.close_jitter_steps);
        Self {
            rng,
            language,
            follow,
            look,
            text,
            height,
            premature,
            premature_height_m,
            breaks,
            end,
            close_wait,
        }
    }

    /// Noise of one component of an action.
    pub(super) fn noise(&mut self, params: &ReplayParams) -> f64 {
        let unit: f64 = StandardNormal.sample(&mut self.rng);
        params.noise * unit
    }

    /// How long this inference takes, s.
    pub(super) fn latency_s(&mut self, params: &ReplayParams) -> f64 {
        let unit: f64 = StandardNormal.sample(&mut self.rng);
        let hangs = self.rng.random_bool(params.latency.hang);
        let spread = libm::log(params.latency.p99_s / params.latency.median_s) / Z_99;
        let usual = params.latency.median_s * libm::exp(spread * unit);
        if hangs { HANG_S } else { usual }
    }
}
