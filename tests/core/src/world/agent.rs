//! Scripted agents: what a grounder and a model would answer.

use std::collections::VecDeque;

use fitmac_core::{
    message::{Candidate, GroundingRecord, ObjectId, RebindRequest},
    wire::{DestinationKind, GraspClass, Provenance},
};

use super::Scene;

/// What the agents will say to one request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// This target.
    Target {
        /// The object; 0 for none.
        id: ObjectId,
        /// Confidence.
        kappa: f64,
        /// Who chose.
        provenance: Provenance,
    },
    /// Nothing: the agents are dead, or too slow.
    Silence,
}

/// Scripted agents.
#[derive(Clone, Debug)]
pub struct Agent {
    /// Answers, first to be given first; the last one is repeated.
    pub answers: VecDeque<Answer>,
    /// Time to answer, ns.
    pub delay_ns: u64,
    /// What the destination is said to be.
    pub destination: DestinationKind,
    sequence: u64,
    due: Option<(u64, GroundingRecord)>,
    last: Option<GroundingRecord>,
}

impl Agent {
    /// Agents that give `answers` in turn, each after 200 ms.
    #[must_use]
    pub fn new(answers: impl IntoIterator<Item = Answer>) -> Self {
        Self {
            answers: answers.into_iter().collect(),
            delay_ns: 200_000_000,
            destination: DestinationKind::Direct,
            sequence: 0,
            due: None,
            last: None,
        }
    }

    /// Agents that name the right target, and are sure of it.
    #[must_use]
    pub fn knowing(scene: &Scene) -> Self {
        Self::new([Answer::Target {
            id: scene.target,
            kappa: 0.95,
            provenance: Provenance::Resolver,
        }])
    }

    /// Hears a request.
    pub fn ask(&mut self, now_ns: u64, request: &RebindRequest, scene: &Scene) {
        let answer = match self.answers.len() {
            0 | 1 => self.answers.front().copied(),
            _ => self.answers.pop_front(),
        };
        if let Some(Answer::Target {
            id,
            kappa,
            provenance,
        }) = answer
        {
            let record = self.record(now_ns, request, scene, id, kappa, provenance);
            self.due = Some((now_ns + self.delay_ns, record));
        }
    }

    /// An answer that is due by now.
    pub fn poll(&mut self, now_ns: u64) -> Option<GroundingRecord> {
        match self.due {
            Some((due_ns, record)) if due_ns <= now_ns => {
                self.due = None;
                self.last = Some(record);
                Some(record)
            }
            _ => None,
        }
    }

    /// The last record again, with another confidence: fresh evidence on the
    /// same binding.
    pub fn observe_again(&mut self, now_ns: u64, kappa: f64) {
        if let Some(mut record) = self.last {
            self.sequence += 1;
            record.sequence = self.sequence;
            record.stamp_ns = now_ns;
            record.confidence = kappa;
            self.due = Some((now_ns, record));
        }
    }

    /// Names a target without being asked.
    pub fn volunteer(&mut self, now_ns: u64, id: ObjectId, scene: &Scene) {
        let epoch = self.last.map_or(0, |r| r.epoch);
        let request = RebindRequest {
            request_id: 0,
            stamp_ns: now_ns,
            epoch,
            subtask: 0,
            suspect: 0,
            reserved: 0,
            reasons: 0,
        };
        let record = self.record(now_ns, &request, scene, id, 0.9, Provenance::Resolver);
        self.due = Some((now_ns, record));
    }

    fn record(
        &mut self,
        now_ns: u64,
        request: &RebindRequest,
        scene: &Scene,
        id: ObjectId,
        kappa: f64,
        provenance: Provenance,
    ) -> GroundingRecord {
        self.sequence += 1;
        let mut record = GroundingRecord {
            sequence: self.sequence,
            session: 1,
            stamp_ns: now_ns,
            epoch: request.epoch.wrapping_add(1),
            subtask: request.subtask,
            prompt_id: u32::from(id),
            target: id,
            destination: scene.destination,
            destination_kind: self.destination.code(),
            relation: scene.relation.code(),
            provenance: provenance.code(),
            confidence: kappa,
            region_offset_m: scene.region_offset_m(),
            region_half_extent_m: scene.region_m,
            ..GroundingRecord::default()
        };
        let things = scene
            .world
            .bodies
            .iter()
            .filter(|b| b.class != GraspClass::Fixture);
        for (slot, body) in record.candidates.iter_mut().zip(things) {
            *slot = Candidate {
                id: body.id,
                compatible: 1,
                confidence: kappa,
                ..Candidate::default()
            };
            record.candidate_count += 1;
        }
        record
    }
}
