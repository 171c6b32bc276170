//! The active subtask's lock: found, held, reported.

use fitmac_core::wire::Provenance;

use super::{AgentService, Event};
use crate::bind::{self, RecordHeader};
use crate::grounder::{self, Context, Grounding, Verdict};
use crate::planner::Subtask;
use crate::prompt::policy_prompt;
use crate::track::TrackId;

/// The lock of the active subtask.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lock {
    pub(super) track: TrackId,
    pub(super) provenance: Provenance,
    /// The model's confidence, where it chose.
    pub(super) chosen: Option<f64>,
}

impl AgentService {
    /// Grounds the active subtask and reports it. The lock stays unless there
    /// is none; a new lock or a `fresh` look has a new epoch.
    pub(super) fn ground(&mut self, now_ns: u64, provenance: Provenance, fresh: bool) {
        let Some(step) = self
            .plan
            .as_ref()
            .and_then(|plan| plan.subtasks.get(self.subtask))
        else {
            return;
        };
        let prompt = policy_prompt(step, self.params.backbone);
        let step = step.clone();
        if self.prompt.1 != prompt {
            self.prompt = (self.prompt.0 + 1, prompt);
            let (id, text) = self.prompt.clone();
            self.events.push(Event::Prompt { id, text });
        }
        if self.seen.scene.objects.is_empty() || step.target.is_empty() {
            return;
        }
        let mut grounding = self.look(&step);
        let had_lock = self.lock.is_some();
        match self.lock {
            Some(lock) => self.hold(lock, &mut grounding),
            None => self.lock = self.locked(&grounding, provenance),
        }
        if fresh || (!had_lock && self.lock.is_some()) {
            self.epoch += 1;
        }
        self.report(&grounding);
        if !had_lock && grounding.verdict.needs_resolver() {
            self.ask_resolver(now_ns, &grounding);
        }
    }

    /// What the rules make of a step in the newest scene, without what earlier
    /// subtasks have placed.
    pub(super) fn look(&self, step: &Subtask) -> Grounding {
        let excluded: Vec<usize> = self
            .placed
            .iter()
            .filter_map(|track| self.seen.index_of(*track))
            .collect();
        let context = Context {
            viewpoint: self.params.viewpoint,
            excluded: &excluded,
        };
        grounder::ground(step, &self.seen.scene, &context)
    }

    fn locked(&self, grounding: &Grounding, provenance: Provenance) -> Option<Lock> {
        let index = grounding.selected()?.seen.index;
        let track = *self.seen.tracks.get(index)?;
        Some(Lock {
            track,
            provenance,
            chosen: None,
        })
    }

    /// Keeps the lock in a new grounding, with the confidence that is left of
    /// it: none if the object is gone, less if another one now fits better.
    fn hold(&self, lock: Lock, grounding: &mut Grounding) {
        let index = self.seen.index_of(lock.track);
        let at = grounding
            .candidates
            .iter()
            .position(|c| Some(c.seen.index) == index);
        let best = grounding
            .candidates
            .iter()
            .map(|c| c.weight)
            .fold(0.0, f64::max);
        let Some((at, candidate)) = at.and_then(|at| Some((at, grounding.candidates.get(at)?)))
        else {
            grounding.selected_index = None;
            grounding.confidence = 0.0;
            return;
        };
        let share = if best > 0.0 {
            candidate.weight / best
        } else {
            0.0
        };
        grounding.confidence = match lock.chosen {
            Some(chosen) if grounding.verdict != Verdict::Resolved => chosen * share,
            _ => grounding.confidence * share,
        };
        grounding.selected_index = Some(at);
    }

    pub(super) fn report(&mut self, grounding: &Grounding) {
        self.sequence += 1;
        let header = RecordHeader {
            sequence: self.sequence,
            session: self.params.session,
            stamp_ns: self.seen.scene.stamp_ns,
            epoch: self.epoch,
            subtask: u32::try_from(self.subtask).unwrap_or(u32::MAX),
            prompt_id: self.prompt.0,
            provenance: self.lock.map_or(Provenance::Rules, |lock| lock.provenance),
        };
        self.events
            .push(Event::Grounding(Box::new(bind::record(&header, grounding))));
    }
}
