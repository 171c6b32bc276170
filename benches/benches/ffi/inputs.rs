//! Recorded inputs as messages in memory, so that only ticks are timed.

use std::ops::Range;

use anyhow::ensure;
use fitmac_core::message::{
    ActionChunk, CriticReport, GroundingRecord, Input, Plan, StateSample, VerifierReport,
};

/// What the core is told in one tick.
pub(crate) struct Step {
    pub(crate) now_ns: u64,
    pub(crate) request: u8,
    pub(crate) state: Option<Box<StateSample>>,
    pub(crate) chunk: Option<Box<ActionChunk>>,
    pub(crate) grounding: Option<Box<GroundingRecord>>,
    pub(crate) plan: Option<Box<Plan>>,
    pub(crate) verifier: Option<Box<VerifierReport>>,
    pub(crate) critic: Option<Box<CriticReport>>,
}

impl Step {
    /// As the core takes it.
    pub(crate) fn input(&self) -> Input<'_> {
        Input {
            state: self.state.as_deref(),
            chunk: self.chunk.as_deref(),
            grounding: self.grounding.as_deref(),
            plan: self.plan.as_deref(),
            verifier: self.verifier.as_deref(),
            critic: self.critic.as_deref(),
            request: self.request,
        }
    }
}

/// The records of an episode in which the policy goes for another object.
pub(crate) fn episode() -> Vec<u8> {
    let mut all = fitmac_tests::link::recordings();
    all.swap_remove(0).inputs
}

/// The steps of a recording.
pub(crate) fn parse(mut bytes: &[u8]) -> anyhow::Result<Vec<Step>> {
    let mut steps = Vec::new();
    while !bytes.is_empty() {
        let [now_ns, request, contents] = read::<[u64; 3]>(&mut bytes)?;
        steps.push(Step {
            now_ns,
            request: u8::try_from(request)?,
            state: message(contents, 0, &mut bytes)?,
            chunk: message(contents, 1, &mut bytes)?,
            grounding: message(contents, 2, &mut bytes)?,
            plan: message(contents, 3, &mut bytes)?,
            verifier: message(contents, 4, &mut bytes)?,
            critic: message(contents, 5, &mut bytes)?,
        });
    }
    Ok(steps)
}

fn message<T: Copy>(contents: u64, bit: u32, bytes: &mut &[u8]) -> anyhow::Result<Option<Box<T>>> {
    match contents >> bit & 1 {
        0 => Ok(None),
        _ => Ok(Some(Box::new(read(bytes)?))),
    }
}

/// Takes a value of plain numbers.
fn read<T: Copy>(bytes: &mut &[u8]) -> anyhow::Result<T> {
    ensure!(bytes.len() >= size_of::<T>(), "the recording is cut short");
    let (head, rest) = bytes.split_at(size_of::<T>());
    *bytes = rest;
    // SAFETY: there are so many bytes, and messages are numbers without padding.
    Ok(unsafe { head.as_ptr().cast::<T>().read_unaligned() })
}

/// Ticks of a batch: few, so that most batches are not interrupted on a busy machine and the
/// messages of one stay in the cache.
const BATCH: usize = 50;

/// Batch after batch of an episode, over and over.
pub(crate) struct Batches {
    steps: usize,
    at: usize,
}

impl Batches {
    pub(crate) const fn of(steps: usize) -> Self {
        Self {
            steps: steps - steps % BATCH,
            at: 0,
        }
    }

    /// Ticks of a batch.
    pub(crate) const fn ticks() -> usize {
        BATCH
    }

    /// Batches of the episode.
    pub(crate) const fn count(&self) -> usize {
        self.steps / BATCH
    }

    /// The next batch.
    pub(crate) const fn next(&mut self) -> Range<usize> {
        let start = self.at;
        self.at = (start + BATCH) % self.steps;
        start..start + BATCH
    }
}
