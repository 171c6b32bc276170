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

/// Least weight at which a candidate counts as compatible.
const COMPATIBLE_WEIGHT: f64 = 0.35;

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
        *slot = message::Candidate {
            id: candidate.seen.id,
            compatible: u8::from(candidate.weight >= COMPATIBLE_WEIGHT),
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
