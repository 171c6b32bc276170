//! From language to the controller's numbers.

use fitmac_core::message::{self, GroundingRecord};
use fitmac_core::wire::{CriticLabel, DestinationKind, PlaceRelation, Provenance};

use crate::critic::FailureType;
use crate::grounder::{Destination, Grounding};
use crate::planner::{Relation, TaskPlan};

/// Numbers that a grounding doesn't know by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordHeader {
    /// Rises with each record.
    pub sequence: u64,
    /// Names the run of the publisher.
    pub session: u64,
    /// When the scene was seen, ns.
    pub stamp_ns: u64,
    /// The epoch.
    pub epoch: u64,
    /// The subtask.
    pub subtask: u32,
    /// The prompt.
    pub prompt_id: u32,
    /// Where the choice comes from.
    pub provenance: Provenance,
}

/// The controller's view of a plan.
#[must_use]
pub fn plan(id: u64, plan: &TaskPlan) -> message::Plan {
    let count = plan.subtasks.len().clamp(1, message::SUBTASK_CAPACITY);
    message::Plan {
        id,
        subtask_count: u32::try_from(count).unwrap_or(1),
        confidence_permille: (plan.confidence.clamp(0.0, 1.0) * 1000.0).round() as u32,
    }
}

/// The controller's view of a grounding. Objects without a number in the pose
/// source can't be named to the controller: they read 0, no object.
#[must_use]
pub fn record(header: &RecordHeader, grounding: &Grounding) -> GroundingRecord {
    let selected = grounding.selected();
    let mut record = GroundingRecord {
        sequence: header.sequence,
        session: header.session,
        stamp_ns: header.stamp_ns,
        epoch: header.epoch,
        subtask: header.subtask,
        prompt_id: header.prompt_id,
        target: selected.map_or(0, |candidate| candidate.seen.id),
        provenance: header.provenance.code(),
        confidence: grounding.confidence.clamp(0.0, 1.0),
        ..GroundingRecord::default()
    };
    if record.target == 0 {
        record.confidence = 0.0;
    }
    if let Some(pixels) = selected.and_then(|candidate| candidate.seen.box_px) {
        record.image_box_px = pixels.map(|value| value as f32);
    }
    let named = grounding
        .candidates
        .iter()
        .filter(|candidate| candidate.seen.id != 0);
    for (slot, candidate) in record.candidates.iter_mut().zip(named) {
        // What was chosen is what the instruction is taken to mean, however
        // badly it fits.
        let fits = candidate.seen.id == record.target || candidate.fits();
        *slot = message::Candidate {
            id: candidate.seen.id,
            compatible: u8::from(fits),
            reserved: [0; 5],
            confidence: candidate.weight.clamp(0.0, 1.0),
        };
        record.candidate_count += 1;
    }
    destination(&mut record, &grounding.destination);
    record
}

fn destination(record: &mut GroundingRecord, destination: &Destination) {
    // A relation must be named even where none is used.
    record.relation = PlaceRelation::On.code();
    match destination {
        Destination::Direct(anchor) if anchor.id != 0 => {
            record.destination_kind = DestinationKind::Direct.code();
            record.destination = anchor.id;
            if anchor.relation == Relation::In {
                record.relation = PlaceRelation::In.code();
            }
            record.region_offset_m = anchor.region_offset_m;
            record.region_half_extent_m = anchor.region_half_extent_m;
        }
        Destination::Direct(_) | Destination::Relational { .. } => {
            record.destination_kind = DestinationKind::Relational.code();
        }
        Destination::None => record.destination_kind = DestinationKind::Unresolved.code(),
    }
}

/// The controller's label for a diagnosis.
#[must_use]
pub fn critic_label(label: FailureType) -> CriticLabel {
    match label {
        FailureType::None => CriticLabel::None,
        FailureType::TargetFailure => CriticLabel::TargetFailure,
        FailureType::ExecutionFailure => CriticLabel::ExecutionFailure,
        FailureType::Success => CriticLabel::Success,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grounder::{Candidate, Seen, Verdict};

    #[test]
    fn the_chosen_one_fits_the_instruction_however_unsure_the_detector_is() {
        let candidate = |id: u16, name_score, relation_score| Candidate {
            seen: Seen {
                index: usize::from(id) - 1,
                id,
                label: "bowl".to_owned(),
                box_px: None,
            },
            name_score,
            relation_score,
            weight: 0.1 * name_score * relation_score,
        };
        let grounding = Grounding {
            candidates: vec![
                candidate(1, 1.0, 0.2),
                candidate(2, 1.0, 0.3),
                candidate(3, 1.0, 0.9),
            ],
            references: Vec::new(),
            context: Vec::new(),
            selected_index: Some(0),
            confidence: 0.4,
            reason: String::new(),
            verdict: Verdict::Unsatisfied,
            destination: Destination::None,
        };
        let header = RecordHeader {
            sequence: 1,
            session: 1,
            stamp_ns: 0,
            epoch: 1,
            subtask: 0,
            prompt_id: 1,
            provenance: Provenance::Rules,
        };
        let record = record(&header, &grounding);
        let fits: Vec<(u16, u8)> = record.candidates[..3]
            .iter()
            .map(|c| (c.id, c.compatible))
            .collect();
        assert_eq!(record.target, 1);
        assert_eq!(fits, [(1, 1), (2, 0), (3, 1)]);
    }
}
