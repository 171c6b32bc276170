//! S4: a policy that was learned by behaviour cloning.
//!
//! A small network a suite, trained on what a scripted expert does in this simulator (`cargo xtask
//! train-bc`): ten tasks, one layout and one sentence each, starts jittered as the suite says. In
//! such data the words and the places of things are constant but for the jitter, so that it fails
//! when they change, for the reason for which large policies do. It stands for none of them.
//!
//! It sees the robot's own state, up to eight objects by place, colour and size, what is near the
//! hand relative to the hand, and the words of the instruction; it answers with eight actions,
//! which are played open loop. Two choices narrow what it can make of that. An object's place is
//! cut off at the range in which the object started in training: farther away it is seen at the
//! edge of that range, and truly only when it is near the hand. And in training colours and words
//! are replaced at random in a part of the samples, as image and text augmentation do it: that is
//! why another look or wording does not disturb it, and it learns to ignore the text.

mod features;
mod network;

pub use features::{
    CHUNK_STEPS, COLOURS, INPUTS, NEAR_AT, NEAR_WIDTH, OUTPUTS, PLACES, PROPRIO, SLOT_WIDTH, SLOTS,
    WORDS, WORDS_AT, features,
};
pub use network::{Layer, Network};

use sha2::{Digest as _, Sha256};

use super::{Backbone, Chunk, Observation};
use crate::action::Action;
use crate::error::SimError;

/// The committed weights by suite.
const WEIGHTS: [(&str, &[u8]); 2] = [
    ("object", include_bytes!("../../../assets/bc/object.bin")),
    ("spatial", include_bytes!("../../../assets/bc/spatial.bin")),
];
/// The policy's name in tables.
pub const NAME: &str = "bc";
/// How long an inference takes, s: the median that the other surrogates have.
pub const LATENCY_S: f64 = 0.086;

/// A policy that plays what its network says.
#[derive(Clone, Debug)]
pub struct Cloned {
    network: Network,
}

impl Cloned {
    /// The policy that was trained on a suite.
    ///
    /// # Errors
    /// [`SimError::Unknown`] if there are no weights for the suite, [`SimError::Data`] if they
    /// are broken, which a test rules out.
    pub fn trained_on(suite: &str) -> Result<Self, SimError> {
        let file = format!("bc/{suite}.bin");
        let network = Network::from_bytes(&file, weights(suite)?)?;
        let fits = network.inputs() == INPUTS && network.outputs() == OUTPUTS;
        if !fits {
            return Err(SimError::Data {
                file,
                message: format!(
                    "it takes {} numbers and gives {}, but {INPUTS} are seen and {OUTPUTS} played; \
                     make it anew with `cargo xtask train-bc`",
                    network.inputs(),
                    network.outputs()
                ),
            });
        }
        Ok(Self::new(network))
    }

    /// A policy with a network of one's own, which takes [`INPUTS`] numbers and gives [`OUTPUTS`].
    #[must_use]
    pub fn new(network: Network) -> Self {
        Self { network }
    }
}

/// SHA-256 of the committed weights of all suites, in hexadecimal.
#[must_use]
pub fn weights_sha256() -> String {
    let mut digest = Sha256::new();
    for (_, bytes) in WEIGHTS {
        digest.update(bytes);
    }
    let digest = digest.finalize();
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn weights(suite: &str) -> Result<&'static [u8], SimError> {
    WEIGHTS
        .iter()
        .find(|(name, _)| *name == suite)
        .map(|(_, bytes)| *bytes)
        .ok_or_else(|| {
            SimError::unknown(
                "suite of the learned policy",
                suite,
                WEIGHTS.map(|(name, _)| name),
            )
        })
}

impl Backbone for Cloned {
    fn name(&self) -> &str {
        NAME
    }

    /// The network has neither memory nor noise.
    fn reset(&mut self, _seed: u64) {}

    fn infer(&mut self, observation: &Observation) -> Chunk {
        let answer = self.network.answer(&features(observation));
        let actions = answer
            .chunks_exact(OUTPUTS / CHUNK_STEPS)
            .map(|step| {
                let mut action: Action =
                    std::array::from_fn(|i| f64::from(step[i]).clamp(-1.0, 1.0));
                // The log-odds of closing; a gripper is told to open or to close, nothing between.
                action[6] = if action[6] > 0.0 { 1.0 } else { -1.0 };
                action
            })
            .collect();
        Chunk {
            actions,
            latency_s: LATENCY_S,
            copies: 1,
        }
    }
}
