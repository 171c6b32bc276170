//! The slow side of the loop, as the lockstep runs it: who plans and grounds.

use fitmac_core::message::{Candidate, GroundingRecord, Plan};
use fitmac_core::wire::{DestinationKind, PlaceRelation, Provenance};

use crate::perception::Sighting;
use crate::predicate::Goal;
use crate::scene::Scene;

/// What the agents look at.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Simulated time, ns.
    pub now_ns: u64,
    /// The scene's static knowledge: what kinds of things there are.
    pub scene: &'a Scene,
    /// What the pose source knows.
    pub sightings: &'a [Sighting],
}

/// Why the agents look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occasion {
    /// A subtask starts.
    First,
    /// Nothing special: fresh evidence on the lock.
    Again,
    /// The controller asked for another look.
    Rebind {
        /// The instance in doubt; 0 if none was locked.
        suspect: u16,
    },
}

/// Plans and grounds.
pub trait Agents: Send {
    /// Reads the instruction at the start of an episode.
    fn plan(&mut self, instruction: &str) -> Plan;

    /// Grounds a subtask. `epoch` is the one that a new binding gets; fresh evidence keeps the
    /// committed one. The sequence number, session and stamp are filled in by the caller.
    fn ground(
        &mut self,
        view: &View<'_>,
        subtask: u32,
        epoch: u64,
        occasion: Occasion,
    ) -> Option<GroundingRecord>;

    /// The text of a prompt that a grounding named; `None` stands for the instruction itself.
    fn prompt(&self, prompt_id: u32) -> Option<&str>;
}

/// Agents that know the answer: the upper bound of grounding, for tests and as a control.
#[derive(Clone, Copy, Debug)]
pub struct OracleAgents {
    goal: Goal,
}

impl OracleAgents {
    /// Agents that ground the given goal.
    #[must_use]
    pub fn new(goal: Goal) -> Self {
        Self { goal }
    }
}

impl Agents for OracleAgents {
    fn plan(&mut self, _instruction: &str) -> Plan {
        Plan {
            id: 1,
            subtask_count: 1,
            confidence_permille: 1000,
        }
    }

    fn ground(
        &mut self,
        view: &View<'_>,
        subtask: u32,
        epoch: u64,
        _occasion: Occasion,
    ) -> Option<GroundingRecord> {
        let anchor = view.scene.by_id(self.goal.destination())?;
        let (offset_m, half_m) = anchor.kind.region_m()?;
        let inside = matches!(self.goal, Goal::In { .. });
        let rim_m = if inside { half_m[2] } else { 0.0 };
        let mut record = GroundingRecord {
            epoch,
            subtask,
            target: self.goal.object(),
            destination: self.goal.destination(),
            destination_kind: DestinationKind::Direct.code(),
            relation: if inside {
                PlaceRelation::In
            } else {
                PlaceRelation::On
            }
            .code(),
            provenance: Provenance::Rules.code(),
            candidate_count: 1,
            confidence: 1.0,
            region_offset_m: [offset_m[0], offset_m[1], offset_m[2] + rim_m],
            region_half_extent_m: [half_m[0], half_m[1], 2.0 * rim_m],
            ..GroundingRecord::default()
        };
        record.candidates[0] = Candidate {
            id: self.goal.object(),
            compatible: 1,
            confidence: 1.0,
            ..Candidate::default()
        };
        Some(record)
    }

    fn prompt(&self, _prompt_id: u32) -> Option<&str> {
        None
    }
}
