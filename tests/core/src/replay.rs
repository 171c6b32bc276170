//! What the core was told and what it answered, as two hashes: builds that
//! decide alike give the same line.

use std::{
    fmt::{self, Display, Write},
    ops::Range,
};

use fitmac_core::Controller;

use crate::swarm::Swarm;

/// Ticks of each seed.
const TICKS: usize = 1500;
/// The whole state is hashed every so many ticks; the answer in every tick.
const STATE_EVERY: usize = 50;

/// Hashes of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fingerprint {
    /// Ticks.
    pub ticks: usize,
    /// What the core was told.
    pub inputs: u64,
    /// What it answered, and its state now and then.
    pub answers: u64,
}

impl Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            ticks,
            inputs,
            answers,
        } = self;
        write!(
            f,
            "ticks {ticks} inputs {inputs:016x} answers {answers:016x}"
        )
    }
}

/// FNV-1a over text. Rust writes every float with the digits that tell it from
/// all others.
struct Hash(u64);

impl Hash {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        Ok(())
    }
}

/// Runs with faults of all kinds.
///
/// # Errors
/// None that is known: writing into a hash does not fail.
pub fn fingerprint(seeds: Range<u64>) -> Result<Fingerprint, fmt::Error> {
    let (mut inputs, mut answers) = (Hash::new(), Hash::new());
    let mut ticks = 0;
    for seed in seeds {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for n in 1..=TICKS {
            let told = swarm.tick();
            write!(inputs, "{told:?}")?;
            let output = controller.tick(told.now_ns, &told.input());
            write!(answers, "{output:?}")?;
            if n % STATE_EVERY == 0 {
                write!(answers, "{:?}", controller.state())?;
            }
            swarm.hear(&output);
        }
        ticks += TICKS;
    }
    Ok(Fingerprint {
        ticks,
        inputs: inputs.0,
        answers: answers.0,
    })
}
