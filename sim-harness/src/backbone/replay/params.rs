//! What makes one replaying policy differ from another.

use serde::Deserialize;

/// A probability that differs between the suites.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BySuite {
    /// On suites that mirror LIBERO-Object.
    pub object: f64,
    /// On suites that mirror LIBERO-Spatial.
    pub spatial: f64,
}

impl BySuite {
    /// The value for a suite by name; an unknown suite counts as `object`.
    #[must_use]
    pub fn of(&self, suite: &str) -> f64 {
        if suite == "spatial" {
            self.spatial
        } else {
            self.object
        }
    }
}

/// What a policy does when its motion is over: weights.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndWeights {
    /// Stands still.
    pub hold: f64,
    /// Trembles by a few millimetres at 2 to 4 Hz.
    pub dither: f64,
    /// Keeps pushing in one direction.
    pub push: f64,
}

/// How long an inference takes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Latency {
    /// Median of the log-normal distribution, s.
    pub median_s: f64,
    /// Its 99th percentile, s.
    pub p99_s: f64,
    /// Probability of a hang of three seconds.
    pub hang: f64,
}

/// Parameters of a replaying policy.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReplayParams {
    /// Name in tables.
    pub name: String,
    /// Actions of a chunk.
    pub horizon: usize,
    /// Actions that are executed before the next query.
    pub open_loop: u32,
    /// Radius of the local visual correction, m; 0 replays blindly.
    pub servo_radius_m: f64,
    /// Standard deviation of the noise on each component but the gripper, in action units.
    pub noise: f64,
    /// Speed of free motion, in action units.
    pub speed: f64,
    /// Spread of the moment at which the gripper closes, policy steps either way.
    pub close_jitter_steps: u32,
    /// Probability that the gripper closes on the way down.
    pub premature: f64,
    /// Probability that the text selects the target.
    pub language: f64,
    /// Probability that looks are followed beyond the servo radius.
    pub follow: BySuite,
    /// Probability of going wrong when the target looks otherwise than in training.
    pub break_look: BySuite,
    /// Probability of going wrong when the text reads otherwise than in training.
    pub break_text: BySuite,
    /// Probability that heights are remembered in absolute terms.
    pub absolute_height: BySuite,
    /// What happens when the motion is over.
    pub end: EndWeights,
    /// How long an inference takes.
    pub latency: Latency,
}

impl ReplayParams {
    /// Names the first value that is out of range.
    pub(crate) fn problem(&self) -> Option<String> {
        let pairs = [
            ("follow", self.follow),
            ("break_look", self.break_look),
            ("break_text", self.break_text),
            ("absolute_height", self.absolute_height),
        ];
        let mut shares = vec![
            ("premature", self.premature),
            ("language", self.language),
            ("latency.hang", self.latency.hang),
        ];
        shares.extend(
            pairs
                .iter()
                .flat_map(|(name, p)| [(*name, p.object), (*name, p.spatial)]),
        );
        if let Some((name, value)) = shares.iter().find(|(_, p)| !(0.0..=1.0).contains(p)) {
            return Some(format!("{name} is {value}; a probability lies in 0 to 1"));
        }
        let EndWeights { hold, dither, push } = self.end;
        let weights = [hold, dither, push];
        if weights.iter().any(|w| !w.is_finite() || *w < 0.0) || hold + dither + push <= 0.0 {
            return Some("end: weights must not be negative, and one must be positive".to_owned());
        }
        let Latency {
            median_s, p99_s, ..
        } = self.latency;
        if !(median_s > 0.0 && p99_s >= median_s && p99_s.is_finite()) {
            return Some("latency: 0 < median_s <= p99_s must hold".to_owned());
        }
        let positive = [("speed", self.speed), ("horizon", self.horizon as f64)];
        if let Some((name, value)) = positive.iter().find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
            return Some(format!("{name} is {value}; it must be positive"));
        }
        let sizes = [
            ("noise", self.noise),
            ("servo_radius_m", self.servo_radius_m),
        ];
        if let Some((name, value)) = sizes.iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0)) {
            return Some(format!("{name} is {value}; it must not be negative"));
        }
        None
    }
}
