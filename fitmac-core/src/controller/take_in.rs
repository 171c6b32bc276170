//! What arrived since the last tick, through the doors of the intake.

use super::{Controller, Report};
use crate::{
    intake::{Refusal, chunk, grounding, robot},
    ladder::Ladder,
    message::{ActionChunk, GroundingRecord, Input, StateSample},
    reason,
    subtask::Subtask,
    trace::Decision,
    turn::Turn,
    wire::{EventKind, Request},
};

impl Controller {
    pub(super) fn take_in(&mut self, now_ns: u64, input: &Input<'_>, report: &mut Report) {
        match Request::try_from(input.request) {
            Ok(Request::Reset) => self.start_episode(),
            Ok(Request::Stop) => report.stop_asked = true,
            Ok(Request::None) | Err(_) => {}
        }
        if let Some(plan) = input.plan {
            match self.state.episode.hear_plan(plan) {
                Ok(true) => self.start_episode(),
                Ok(false) => {}
                Err(refusal) => self.refuse(
                    refusal,
                    EventKind::GroundingRefused,
                    reason::GROUNDING_REFUSED,
                    report,
                ),
            }
        }
        if let Some(sample) = input.state {
            self.take_state(now_ns, sample, report);
        }
        if let Some(record) = input.grounding {
            self.take_grounding(now_ns, record, report);
        }
        if let Some(heard) = input.verifier {
            self.state
                .verdicts
                .hear_verifier(heard, self.state.subtask.index());
        }
        if let Some(heard) = input.critic {
            self.state
                .verdicts
                .hear_critic(heard, self.state.subtask.index());
        }
        if let Some(chunk) = input.chunk {
            self.take_chunk(now_ns, chunk, report);
        }
    }

    fn take_state(&mut self, now_ns: u64, sample: &StateSample, report: &mut Report) {
        let (state, params) = (&mut self.state, self.params.get());
        let lock = &state.subtask.lock;
        let before = lock.sighting(state.robot.latest().unwrap_or(sample));
        match state.robot.step(&params.state, now_ns, sample) {
            robot::Outcome::Accepted { discontinuous } => {
                state.applied.note(now_ns, sample.applied_command);
                if discontinuous {
                    state.subtask.forget_motion();
                } else if let Some(after) = state.robot.latest() {
                    let lock = &mut state.subtask.lock;
                    let after = lock.sighting(after);
                    lock.watch(&params.lock, &params.gripper, before, after);
                }
            }
            robot::Outcome::Duplicate => {}
            robot::Outcome::Refused(refusal) => {
                let bit = if refusal == Refusal::Jump {
                    reason::STATE_JUMP
                } else {
                    reason::STATE_REFUSED
                };
                self.refuse(refusal, EventKind::StateRefused, bit, report);
            }
        }
    }

    fn take_grounding(&mut self, now_ns: u64, record: &GroundingRecord, report: &mut Report) {
        let (state, params) = (&mut self.state, self.params.get());
        let (epoch, subtask) = (state.subtask.lock.epoch(), state.subtask.index());
        match state
            .grounding
            .step(&params.state, now_ns, record, epoch, subtask)
        {
            grounding::Outcome::Evidence => state.subtask.lock.observe(record),
            grounding::Outcome::Proposal => {}
            grounding::Outcome::Refused(refusal) => {
                self.refuse(
                    refusal,
                    EventKind::GroundingRefused,
                    reason::GROUNDING_REFUSED,
                    report,
                );
            }
        }
    }

    fn take_chunk(&mut self, now_ns: u64, chunk: &ActionChunk, report: &mut Report) {
        let state = &mut self.state;
        match state.chunk.step(self.params.get(), now_ns, chunk) {
            chunk::Outcome::Accepted { frozen: true } => report.noticed |= reason::POLICY_FROZEN,
            chunk::Outcome::Accepted { frozen: false } => {}
            chunk::Outcome::Refused(refusal) => {
                let bit = if refusal == Refusal::SessionChanged {
                    // The policy restarted: what it planned before is void.
                    state.queue.clear();
                    reason::POLICY_RESTARTED
                } else {
                    reason::CHUNK_REFUSED
                };
                self.refuse(refusal, EventKind::ChunkRefused, bit, report);
            }
        }
    }

    fn refuse(&mut self, refusal: Refusal, kind: EventKind, bit: u64, report: &mut Report) {
        self.state.refusals.count(refusal);
        report.noticed |= bit;
        report.event = Some((kind, Some(refusal)));
    }

    fn start_episode(&mut self) {
        let state = &mut self.state;
        let epoch = state.subtask.lock.epoch();
        state.subtask = Subtask::fresh(0, epoch);
        state.episode.restart();
        state.verdicts.forget();
        state.robot.number_afresh();
        state.grounding.start_afresh();
        state.chunk.start_afresh();
        state.queue.clear();
        state.ladder = Ladder::new();
        state.turn = Turn::Settling(self.params.get().clock.settle_steps);
        state.decision = Decision::NONE;
    }
}
