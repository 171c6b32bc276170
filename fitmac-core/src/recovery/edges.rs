//! The steps of a correction and how they follow each other.

use crate::wire::SubPhase;

/// The legal changes of step. From every step a correction may also end
/// ([`SubPhase::Idle`]); a query may take several edges at once.
pub const EDGES: &[(SubPhase, SubPhase)] = &[
    (SubPhase::Idle, SubPhase::SetDown),
    (SubPhase::Idle, SubPhase::ApproachHover),
    (SubPhase::Idle, SubPhase::LiftTest),
    (SubPhase::Idle, SubPhase::LiftCarry),
    (SubPhase::SetDown, SubPhase::ApproachHover),
    (SubPhase::ApproachHover, SubPhase::Descend),
    (SubPhase::Descend, SubPhase::ApproachHover),
    (SubPhase::Descend, SubPhase::Close),
    (SubPhase::Close, SubPhase::LiftTest),
    (SubPhase::Close, SubPhase::Reopen),
    (SubPhase::LiftTest, SubPhase::Reopen),
    (SubPhase::LiftTest, SubPhase::LiftCarry),
    (SubPhase::Reopen, SubPhase::ApproachHover),
    (SubPhase::LiftCarry, SubPhase::MoveAbove),
    (SubPhase::MoveAbove, SubPhase::Lower),
    (SubPhase::Lower, SubPhase::MoveAbove),
    (SubPhase::Lower, SubPhase::ReleaseReady),
    (SubPhase::ReleaseReady, SubPhase::ReleaseHold),
    (SubPhase::ReleaseHold, SubPhase::Retreat),
    (SubPhase::Retreat, SubPhase::Settle),
    // The object slipped: it is picked up again.
    (SubPhase::LiftCarry, SubPhase::SetDown),
    (SubPhase::LiftCarry, SubPhase::ApproachHover),
    (SubPhase::LiftCarry, SubPhase::LiftTest),
    (SubPhase::MoveAbove, SubPhase::SetDown),
    (SubPhase::MoveAbove, SubPhase::ApproachHover),
    (SubPhase::MoveAbove, SubPhase::LiftTest),
    (SubPhase::Lower, SubPhase::SetDown),
    (SubPhase::Lower, SubPhase::ApproachHover),
    (SubPhase::Lower, SubPhase::LiftTest),
];

/// True if a step may be followed by another in one change.
#[must_use]
pub fn is_legal(from: SubPhase, to: SubPhase) -> bool {
    EDGES.contains(&(from, to))
}
