//! Intake of action chunks, and the question that they answer.
//!
//! One question is open at a time. The answer must repeat its number, epoch
//! and subtask. How many of its actions are out of date is counted, never
//! estimated: it is the number of the policy's actions that were executed since
//! the question was asked. Steps of standing still make no action out of date.

use super::{Refusal, age_ns, is_newer, ms_to_ns};
use crate::{
    message::{ACTION_DIM, ActionChunk, CHUNK_CAPACITY, PolicyQuery},
    params::{OutOfRange, Params},
    wire::{ActionFrame, ActionSpace, GripperConvention},
};

/// What became of a chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Ready to be played; `frozen` if too many equal ones came in a row.
    Accepted {
        /// The policy repeats itself.
        frozen: bool,
    },
    /// Refused.
    Refused(Refusal),
}

/// A question that awaits its answer.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Question {
    query: PolicyQuery,
    played: u64,
    first_asked_ns: u64,
    last_asked_ns: u64,
}

/// Whether a chunk is at hand.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Answer {
    None,
    /// `latest` answers a question that was asked after so many of the policy's
    /// actions.
    Ready {
        played: u64,
    },
}

/// The question to the policy and its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct ChunkIntake {
    session: Option<u64>,
    last_sequence: u64,
    /// Session and sequence of the last chunk, whatever became of it.
    heard: Option<(u64, u64)>,
    question: Option<Question>,
    answer: Answer,
    latest: ActionChunk,
    accepted: u64,
    refused_in_a_row: u32,
    equal_in_a_row: u32,
    next_query_id: u64,
}

impl ChunkIntake {
    pub(crate) fn new() -> Self {
        Self {
            session: None,
            last_sequence: 0,
            heard: None,
            question: None,
            answer: Answer::None,
            latest: ActionChunk::default(),
            accepted: 0,
            refused_in_a_row: 0,
            equal_in_a_row: 0,
            next_query_id: 1,
        }
    }

    /// Chunks accepted so far.
    #[must_use]
    pub const fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Chunks refused for a broken sender since the last accepted one.
    #[must_use]
    pub const fn refused_in_a_row(&self) -> u32 {
        self.refused_in_a_row
    }

    /// Since when the policy owes an answer.
    #[must_use]
    pub fn waiting_since_ns(&self) -> Option<u64> {
        self.question.map(|q| q.first_asked_ns)
    }

    /// Forgets the open question and the chunk at hand: what they were asked
    /// for no longer holds.
    pub(crate) fn discard(&mut self) {
        self.question = None;
        self.answer = Answer::None;
    }

    /// A new episode: what was asked is void, what was refused before is no
    /// longer held against the policy, and its numbers may begin anew. (An old
    /// chunk is still refused: it answers another question.)
    pub(crate) fn start_afresh(&mut self) {
        self.discard();
        self.session = None;
        self.refused_in_a_row = 0;
        self.equal_in_a_row = 0;
    }

    /// Asks, unless a question is open or answered. An unanswered one is
    /// repeated, under its number, after `chunk.hold_after_ms`.
    pub(crate) fn ask(
        &mut self,
        params: &Params,
        now_ns: u64,
        wanted: Wanted,
    ) -> Option<PolicyQuery> {
        if let Some(question) = &mut self.question {
            if age_ns(now_ns, question.last_asked_ns) < ms_to_ns(params.chunk.hold_after_ms) {
                return None;
            }
            question.last_asked_ns = now_ns;
            return Some(question.query);
        }
        if matches!(self.answer, Answer::Ready { .. }) {
            return None;
        }
        let query = PolicyQuery {
            query_id: self.next_query_id,
            stamp_ns: now_ns,
            state_sequence: wanted.state_sequence,
            policy_step: wanted.policy_step,
            epoch: wanted.epoch,
            subtask: wanted.subtask,
            prompt_id: wanted.prompt_id,
        };
        self.next_query_id = self.next_query_id.wrapping_add(1);
        self.question = Some(Question {
            query,
            played: wanted.played,
            first_asked_ns: now_ns,
            last_asked_ns: now_ns,
        });
        Some(query)
    }

    /// The chunk at hand and the number of its actions that are out of date
    /// after `played` actions of the policy; it is handed out once.
    pub(crate) fn take(&mut self, played: u64) -> Option<(&ActionChunk, usize)> {
        let Answer::Ready { played: before } = self.answer else {
            return None;
        };
        self.answer = Answer::None;
        let consumed = played.saturating_sub(before).min(CHUNK_CAPACITY as u64);
        Some((&self.latest, consumed as usize))
    }

    pub(crate) fn step(&mut self, params: &Params, now_ns: u64, chunk: &ActionChunk) -> Outcome {
        match self.examine(params, now_ns, chunk) {
            Ok(played) => {
                let n = chunk.horizon as usize;
                let equal = self.accepted > 0
                    && self.latest.horizon == chunk.horizon
                    && self
                        .latest
                        .actions
                        .iter()
                        .take(n)
                        .eq(chunk.actions.iter().take(n));
                self.equal_in_a_row = if equal {
                    self.equal_in_a_row.saturating_add(1)
                } else {
                    1
                };
                self.latest = *chunk;
                // Unused slots may hold anything; a snapshot must equal itself.
                self.latest
                    .actions
                    .iter_mut()
                    .skip(n)
                    .for_each(|a| *a = [0.0; ACTION_DIM]);
                self.answer = Answer::Ready { played };
                self.question = None;
                self.accepted = self.accepted.saturating_add(1);
                self.refused_in_a_row = 0;
                Outcome::Accepted {
                    frozen: self.equal_in_a_row >= params.chunk.frozen_chunks,
                }
            }
            Err(refusal) => {
                if refusal.is_hard() {
                    self.refused_in_a_row = self.refused_in_a_row.saturating_add(1);
                    self.reopen(chunk.query_id);
                }
                Outcome::Refused(refusal)
            }
        }
    }

    /// A broken answer leaves its question unanswered: ask anew.
    fn reopen(&mut self, query_id: u64) {
        if self.question.is_some_and(|q| q.query.query_id == query_id) {
            self.question = None;
        }
    }

    fn examine(
        &mut self,
        params: &Params,
        now_ns: u64,
        chunk: &ActionChunk,
    ) -> Result<u64, Refusal> {
        let name = (chunk.session, chunk.sequence);
        if self.heard.replace(name) == Some(name) {
            return Err(Refusal::Repeated);
        }
        match self.session {
            Some(session) if session != chunk.session => {
                self.session = Some(chunk.session);
                self.last_sequence = chunk.sequence;
                self.discard();
                return Err(Refusal::SessionChanged);
            }
            Some(_) if !is_newer(chunk.sequence, self.last_sequence) => {
                return Err(Refusal::Sequence);
            }
            Some(_) => {}
            None => self.session = Some(chunk.session),
        }
        check_form(params, chunk)?;
        check_age(params, now_ns, chunk)?;
        // The number of a broken chunk counts for nothing: taken at its word,
        // a corrupt one would shut out every sound chunk that follows.
        self.last_sequence = chunk.sequence;
        let question = self.question.ok_or(Refusal::Query)?;
        if chunk.subtask != question.query.subtask {
            return Err(Refusal::Subtask);
        }
        if chunk.epoch != question.query.epoch {
            return Err(Refusal::Epoch);
        }
        if chunk.query_id != question.query.query_id {
            return Err(Refusal::Query);
        }
        Ok(question.played)
    }
}

/// What a question asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wanted {
    pub(crate) state_sequence: u64,
    pub(crate) policy_step: u64,
    pub(crate) played: u64,
    pub(crate) epoch: u64,
    pub(crate) subtask: u32,
    pub(crate) prompt_id: u32,
}

fn check_form(params: &Params, chunk: &ActionChunk) -> Result<(), Refusal> {
    let n = chunk.horizon as usize;
    let Some(actions) = chunk.actions.get(..n) else {
        return Err(Refusal::TooLong);
    };
    if n == 0 {
        return Err(Refusal::Empty);
    }
    let space = ActionSpace::try_from(chunk.action_space).map_err(|_| Refusal::UnknownCode)?;
    let frame = ActionFrame::try_from(chunk.frame).map_err(|_| Refusal::UnknownCode)?;
    let gripper = GripperConvention::try_from(chunk.gripper).map_err(|_| Refusal::UnknownCode)?;
    if space != ActionSpace::OscPoseDelta
        || frame != ActionFrame::Base
        || gripper != params.policy_gripper.convention()
    {
        return Err(Refusal::Convention);
    }
    let largest = largest(actions);
    if !largest.is_finite() {
        return Err(Refusal::NotFinite);
    }
    let limit = 1.0 + params.chunk.range_tolerance;
    let refuse = params.out_of_range == OutOfRange::Refuse;
    if refuse && f64::from(largest) > limit {
        return Err(Refusal::OutOfRange);
    }
    Ok(())
}

/// The largest magnitude; not finite if any number is not: the bits of
/// magnitudes are ordered as they are, infinity and NaN above all.
fn largest(actions: &[[f32; ACTION_DIM]]) -> f32 {
    let magnitudes = actions.as_flattened().iter().map(|x| x.abs().to_bits());
    f32::from_bits(magnitudes.fold(0, u32::max))
}

fn check_age(params: &Params, now_ns: u64, chunk: &ActionChunk) -> Result<(), Refusal> {
    let skew = ms_to_ns(params.chunk.future_skew_ms);
    if chunk.observation_ns.saturating_sub(now_ns) > skew
        || chunk.stamp_ns.saturating_sub(now_ns) > skew
    {
        return Err(Refusal::FromFuture);
    }
    if age_ns(now_ns, chunk.observation_ns) > ms_to_ns(params.chunk.max_age_ms) {
        return Err(Refusal::TooOld);
    }
    Ok(())
}
