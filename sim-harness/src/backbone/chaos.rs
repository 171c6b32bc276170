//! S5: any policy, with faults. For safety properties, never for success rates.

use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::{Backbone, Chunk, Observation};

/// What goes wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// It comes after seconds.
    Late,
    /// It never comes.
    Lost,
    /// It comes twice.
    Duplicated,
    /// It has no action.
    Empty,
    /// It has more actions than a message holds.
    TooLong,
    /// A number is not a number.
    NotANumber,
    /// A number is infinite.
    Infinite,
    /// All increments are ten times as large.
    TenTimes,
    /// The gripper's sign is the other one.
    GripperFlipped,
    /// x and y are exchanged, as in another frame.
    WrongFrame,
    /// It is the last answer again.
    Frozen,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Late,
        Self::Lost,
        Self::Duplicated,
        Self::Empty,
        Self::TooLong,
        Self::NotANumber,
        Self::Infinite,
        Self::TenTimes,
        Self::GripperFlipped,
        Self::WrongFrame,
        Self::Frozen,
    ];
}

/// How late a late answer is, s.
const LATE_S: f64 = 2.5;
/// More actions than a message holds.
const TOO_LONG: usize = 100;

/// Wraps a policy; each answer is spoilt with a probability, by one of the faults that the
/// episode's seed enables.
pub struct Chaos {
    inner: Box<dyn Backbone>,
    rate: f64,
    rng: ChaCha8Rng,
    enabled: Vec<Fault>,
    last: Option<Chunk>,
    name: String,
}

impl Chaos {
    /// Spoils a share `rate` of the answers of `inner`; `name` is what tables call it.
    #[must_use]
    pub fn new(name: &str, inner: Box<dyn Backbone>, rate: f64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(0);
        Self {
            inner,
            rate,
            rng,
            enabled: Fault::ALL.to_vec(),
            last: None,
            name: name.to_owned(),
        }
    }

    /// The faults of this episode.
    #[must_use]
    pub fn enabled(&self) -> &[Fault] {
        &self.enabled
    }

    fn spoil(&mut self, fault: Fault, mut chunk: Chunk) -> Chunk {
        let index = self.rng.random_range(0..chunk.actions.len().max(1));
        let lane = self.rng.random_range(0..7);
        match fault {
            Fault::Late => chunk.latency_s += LATE_S,
            Fault::Lost => chunk.copies = 0,
            Fault::Duplicated => chunk.copies = 2,
            Fault::Empty => chunk.actions.clear(),
            Fault::TooLong => {
                let action = chunk.actions.first().copied().unwrap_or([0.0; 7]);
                chunk.actions.resize(TOO_LONG, action);
            }
            Fault::NotANumber | Fault::Infinite => {
                if let Some(action) = chunk.actions.get_mut(index) {
                    action[lane] = if fault == Fault::NotANumber {
                        f64::NAN
                    } else {
                        f64::INFINITY
                    };
                }
            }
            Fault::TenTimes => {
                chunk
                    .actions
                    .iter_mut()
                    .for_each(|a| a[..6].iter_mut().for_each(|v| *v *= 10.0));
            }
            Fault::GripperFlipped => chunk.actions.iter_mut().for_each(|a| a[6] = -a[6]),
            Fault::WrongFrame => chunk.actions.iter_mut().for_each(|a| a.swap(0, 1)),
            Fault::Frozen => {
                if let Some(last) = &self.last {
                    chunk.actions.clone_from(&last.actions);
                }
            }
        }
        chunk
    }
}

impl Backbone for Chaos {
    fn name(&self) -> &str {
        &self.name
    }

    fn reset(&mut self, seed: u64) {
        self.inner.reset(seed);
        self.rng = ChaCha8Rng::seed_from_u64(!seed);
        // A swarm: each episode enables a random subset, so that rare combinations occur.
        let rng = &mut self.rng;
        self.enabled = Fault::ALL
            .into_iter()
            .filter(|_| rng.random_bool(0.5))
            .collect();
        self.last = None;
    }

    fn infer(&mut self, observation: &Observation) -> Chunk {
        let chunk = self.inner.infer(observation);
        let hit = self.rng.random_bool(self.rate.clamp(0.0, 1.0));
        let fault = self.enabled.choose(&mut self.rng).copied().filter(|_| hit);
        let answer = match fault {
            Some(fault) => self.spoil(fault, chunk.clone()),
            None => chunk.clone(),
        };
        self.last = Some(chunk);
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backbone::Hold;
    use crate::scene::{Arena, Scene};
    use crate::sim::Sim;

    #[test]
    fn every_fault_spoils_an_answer_in_its_way() {
        let sim = Sim::new(Scene::new(Arena::default())).unwrap();
        let seen = Observation::of(&sim, "", 0);
        let mut chaos = Chaos::new("chaos", Box::new(Hold::new(8)), 1.0);
        chaos.reset(3);
        assert!(!chaos.enabled().is_empty() && chaos.enabled().len() < Fault::ALL.len());
        let good = chaos.inner.infer(&seen);
        let mut other = good.clone();
        other.actions[0][0] = 0.5;
        chaos.last = Some(other);
        for fault in Fault::ALL {
            let spoilt = chaos.spoil(fault, good.clone());
            // Standing still has nothing to scale or to turn.
            let harmless = matches!(fault, Fault::TenTimes | Fault::WrongFrame);
            // NaN differs from itself, so a spoilt answer is never equal to the good one.
            assert_eq!(spoilt == good, harmless, "{fault:?}");
        }
        assert_eq!(chaos.spoil(Fault::TooLong, good).actions.len(), TOO_LONG);
    }
}
