//! Intake of grounding records: what the agents propose.
//!
//! A record never moves the lock by itself. It updates the evidence on the
//! locked instance, or waits as a proposal until a query whose route is
//! target correction commits it.

use super::{Refusal, confidence, is_newer, ms_to_ns};
use crate::{
    message::{CANDIDATE_CAPACITY, Candidate, GroundingRecord},
    params::StateIntake as StateParams,
    wire::{DestinationKind, PlaceRelation, Provenance},
};

/// What became of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Of the committed epoch: fresh evidence on the lock.
    Evidence,
    /// Of a later epoch: a proposal.
    Proposal,
    /// Refused.
    Refused(Refusal),
}

/// The newest proposal.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundingIntake {
    session: Option<u64>,
    last_sequence: u64,
    proposal: Option<GroundingRecord>,
}

impl GroundingIntake {
    pub(crate) const fn new() -> Self {
        Self {
            session: None,
            last_sequence: 0,
            proposal: None,
        }
    }

    /// The proposal that awaits a commit.
    #[must_use]
    pub const fn proposal(&self) -> Option<&GroundingRecord> {
        self.proposal.as_ref()
    }

    /// Hands the proposal over to be committed.
    pub(crate) fn take(&mut self) -> Option<GroundingRecord> {
        self.proposal.take()
    }

    /// A new episode: a proposal stays if it is for the first subtask, and the
    /// agents' numbers may begin anew.
    pub(crate) fn start_afresh(&mut self) {
        self.keep_only(0);
        self.session = None;
    }

    /// Drops a proposal that is not for `subtask`.
    pub(crate) fn keep_only(&mut self, subtask: u32) {
        if self.proposal.is_some_and(|p| p.subtask != subtask) {
            self.proposal = None;
        }
    }

    /// `epoch` is the committed one, `subtask` the active one.
    pub(crate) fn step(
        &mut self,
        params: &StateParams,
        now_ns: u64,
        record: &GroundingRecord,
        epoch: u64,
        subtask: u32,
    ) -> Outcome {
        match self.session {
            Some(session) if session == record.session => {
                if record.sequence == self.last_sequence {
                    return Outcome::Refused(Refusal::Repeated);
                }
                if !is_newer(record.sequence, self.last_sequence) {
                    return Outcome::Refused(Refusal::Sequence);
                }
            }
            _ => self.session = Some(record.session),
        }
        if let Err(refusal) = validate(params, now_ns, record) {
            return Outcome::Refused(refusal);
        }
        // As with chunks: the number of a broken record counts for nothing.
        self.last_sequence = record.sequence;
        if record.subtask != subtask {
            return Outcome::Refused(Refusal::Subtask);
        }
        if record.epoch == epoch {
            return Outcome::Evidence;
        }
        // Wrapping, as with sequence numbers: a corrupt epoch just below zero
        // must not shut out every later one.
        let overtaken = self
            .proposal
            .is_some_and(|p| is_newer(p.epoch, record.epoch));
        if overtaken || !is_newer(record.epoch, epoch) {
            return Outcome::Refused(Refusal::Epoch);
        }
        self.proposal = Some(cleaned(record));
        Outcome::Proposal
    }
}

/// The record with its confidences in [0, 1] and without what it may hold in
/// places that do not count: a snapshot must equal itself.
fn cleaned(record: &GroundingRecord) -> GroundingRecord {
    let mut clean = *record;
    clean.confidence = confidence(record.confidence);
    let count = usize::from(record.candidate_count);
    for (i, candidate) in clean.candidates.iter_mut().enumerate() {
        *candidate = if i < count {
            Candidate {
                confidence: confidence(candidate.confidence),
                ..*candidate
            }
        } else {
            Candidate::default()
        };
    }
    if clean.destination_kind != DestinationKind::Direct.code() {
        clean.region_offset_m = [0.0; 3];
        clean.region_half_extent_m = [0.0; 3];
    }
    clean.image_box_px = [0.0; 4];
    clean
}

fn validate(params: &StateParams, now_ns: u64, record: &GroundingRecord) -> Result<(), Refusal> {
    let count = usize::from(record.candidate_count);
    if count > CANDIDATE_CAPACITY {
        return Err(Refusal::TooLong);
    }
    if record.stamp_ns.saturating_sub(now_ns) > ms_to_ns(params.future_skew_ms) {
        return Err(Refusal::FromFuture);
    }
    let kind =
        DestinationKind::try_from(record.destination_kind).map_err(|_| Refusal::UnknownCode)?;
    Provenance::try_from(record.provenance).map_err(|_| Refusal::UnknownCode)?;
    if kind == DestinationKind::Direct {
        PlaceRelation::try_from(record.relation).map_err(|_| Refusal::UnknownCode)?;
        let limit = params.plausible_position_m;
        let offset_ok = record.region_offset_m.iter().all(|x| x.abs() <= limit);
        let extent_ok = record
            .region_half_extent_m
            .iter()
            .all(|&x| x >= 0.0 && x <= limit);
        if !offset_ok || !extent_ok {
            return Err(Refusal::NotFinite);
        }
    }
    let chosen = record
        .candidates
        .iter()
        .take(count)
        .any(|c| c.id == record.target);
    if record.target != 0 && !chosen {
        return Err(Refusal::NotACandidate);
    }
    Ok(())
}
