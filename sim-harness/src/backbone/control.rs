//! S0: controls that show what a number means. One stands still, one moves at random.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::{Backbone, Chunk, Observation};
use crate::action::{Action, WAIT};

/// Stands still with an open gripper: a pure stall.
#[derive(Clone, Debug)]
pub struct Hold {
    horizon: usize,
}

impl Hold {
    /// Chunks of `horizon` actions.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self { horizon }
    }
}

impl Backbone for Hold {
    fn name(&self) -> &str {
        "hold"
    }

    fn reset(&mut self, _seed: u64) {}

    fn infer(&mut self, _observation: &Observation) -> Chunk {
        Chunk {
            actions: vec![WAIT; self.horizon],
            latency_s: 0.0,
            copies: 1,
        }
    }
}

/// Moves at random within the action box; its gripper changes its mind once a chunk.
#[derive(Clone, Debug)]
pub struct Random {
    horizon: usize,
    rng: ChaCha8Rng,
}

impl Random {
    /// Chunks of `horizon` actions.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self {
            horizon,
            rng: ChaCha8Rng::seed_from_u64(0),
        }
    }
}

impl Backbone for Random {
    fn name(&self) -> &str {
        "random"
    }

    fn reset(&mut self, seed: u64) {
        self.rng = ChaCha8Rng::seed_from_u64(seed);
    }

    fn infer(&mut self, _observation: &Observation) -> Chunk {
        let gripper = if self.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let mut draw = || -> Action {
            let mut action = [0.0; 7];
            for component in &mut action[..3] {
                *component = self.rng.random_range(-1.0..=1.0);
            }
            action[6] = gripper;
            action
        };
        let actions = (0..self.horizon).map(|_| draw()).collect();
        Chunk {
            actions,
            latency_s: 0.0,
            copies: 1,
        }
    }
}
