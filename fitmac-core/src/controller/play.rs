//! Policy steps and queries: what starts in this tick.

use super::{Controller, Report, Start};
use crate::{
    decide::{Decided, decide},
    filter::still,
    intake::{Refusal, chunk::Wanted, ms_to_ns},
    message::{Command, PolicyQuery, RebindRequest},
    turn::{Turn, Waiting},
    wire::{EventKind, Mode, Route},
};

impl Controller {
    /// Hold or stop: the queue is void; a zero increment starts once.
    pub(super) fn stand_still(
        &mut self,
        now_ns: u64,
        mode: Mode,
        report: &mut Report,
    ) -> Option<Start> {
        let state = &mut self.state;
        let enters = state.mode < Mode::Hold;
        if mode == Mode::Stop {
            state.subtask.recovery.cancel();
            state.chunk.discard();
            state.decision.route = Route::Base;
        }
        state.queue.clear();
        if let Turn::Playing = state.turn {
            state.turn = Turn::Due;
        }
        // A hold for want of a good chunk ends only with one: keep asking.
        let owed = matches!(state.turn, Turn::Waiting(Waiting::Chunk { .. }))
            || state.chunk.refused_in_a_row() > 0;
        if owed && mode == Mode::Hold {
            report.query = self.ask(now_ns);
        }
        let state = &self.state;
        (enters && state.robot.latest().is_some()).then(|| Start::still(&state.current.action))
    }

    /// Starts an action if one is due and at hand.
    pub(super) fn play(&mut self, now_ns: u64, report: &mut Report) -> Option<Start> {
        if let Turn::Waiting(waiting) = self.state.turn {
            return self.wait(now_ns, waiting, report);
        }
        if !self.state.clock.is_due(now_ns) {
            return None;
        }
        if let Turn::Settling(left) = self.state.turn {
            self.state.turn = left.checked_sub(1).map_or(Turn::Due, Turn::Settling);
            if left > 0 {
                return Some(Start::still(&still(-1.0)));
            }
        }
        self.observe();
        if self.state.queue.is_empty() {
            return self.query(now_ns, report);
        }
        if self.state.queue.len() == self.params.get().chunk.query_lead_steps as usize {
            report.query = self.ask(now_ns);
        }
        self.pop()
    }

    /// One policy step went by: analysis, once, and only on a new sample.
    fn observe(&mut self) {
        let (state, params) = (&mut self.state, self.params.get());
        let Some(sample) = state.robot.latest() else {
            return;
        };
        let seen = Some((sample.session, sample.sequence));
        if state.observed == seen {
            return;
        }
        state.observed = seen;
        let width_before = state.width_m.unwrap_or(sample.gripper_width_m);
        let [.., grip] = state.current.action;
        let commanded_closed = grip > 0.0;
        let verdict = state.verdicts.verdict();
        state
            .subtask
            .observe(params, sample, width_before, commanded_closed, verdict);
        state.width_m = Some(sample.gripper_width_m);
    }

    /// The queue is empty: decide who acts.
    fn query(&mut self, now_ns: u64, report: &mut Report) -> Option<Start> {
        let (state, params) = (&mut self.state, self.params.get());
        let sample = state.robot.latest()?;
        let decided = decide(
            params,
            now_ns,
            sample,
            &mut state.episode,
            &mut state.subtask,
            &mut state.grounding,
            &mut state.verdicts,
        );
        state.decision = decided.decision;
        if decided.new_prompt {
            state.chunk.discard();
        }
        if decided.advanced {
            report.event = Some((EventKind::SubtaskChanged, None));
        }
        match decided.step {
            Decided::Correct { action, waypoint_m } => {
                state.chunk.discard();
                state.turn = Turn::Due;
                Some(Start {
                    action,
                    flags: 0,
                    from_policy: false,
                    waypoint_m,
                    query: true,
                })
            }
            Decided::Policy => {
                let horizon = state.decision.effective_horizon;
                state.turn = Turn::Waiting(Waiting::Chunk { horizon });
                self.wait(now_ns, Waiting::Chunk { horizon }, report)
            }
            Decided::AskAgents { hold } => {
                report.rebind = Some(self.rebind_request(now_ns));
                let state = &mut self.state;
                let horizon = state.decision.effective_horizon;
                let waiting = if hold {
                    Waiting::Grounding { since_ns: now_ns }
                } else {
                    Waiting::Chunk { horizon }
                };
                state.turn = Turn::Waiting(waiting);
                match waiting {
                    Waiting::Grounding { .. } => Some(Start {
                        query: true,
                        ..Start::still(&state.current.action)
                    }),
                    Waiting::Chunk { .. } => self.wait(now_ns, waiting, report),
                }
            }
        }
    }

    /// Something is awaited: the chunk of this query, or the agents' answer.
    fn wait(&mut self, now_ns: u64, waiting: Waiting, report: &mut Report) -> Option<Start> {
        match waiting {
            Waiting::Chunk { horizon } => {
                if self.state.clock.is_due(now_ns) && self.fill(horizon) {
                    return self.pop().map(|s| Start { query: true, ..s });
                }
                report.query = self.ask(now_ns);
                None
            }
            Waiting::Grounding { since_ns } => {
                let waited = now_ns.saturating_sub(since_ns);
                let over = waited > ms_to_ns(self.params.get().lock.rebind_wait_ms);
                if self.state.grounding.proposal().is_none() && !over {
                    return None;
                }
                self.state.turn = Turn::Due;
                if !self.state.clock.is_due(now_ns) {
                    return None;
                }
                self.observe();
                self.query(now_ns, report)
            }
        }
    }

    /// Moves the prefix of the chunk at hand into the queue.
    fn fill(&mut self, horizon: u32) -> bool {
        let state = &mut self.state;
        match state.chunk.take(state.queue.played()) {
            Some((chunk, consumed)) => {
                let taken = state.queue.fill(chunk, consumed, horizon);
                if taken == 0 {
                    state.refusals.count(Refusal::Consumed);
                }
                taken > 0
            }
            None => false,
        }
    }

    fn pop(&mut self) -> Option<Start> {
        let state = &mut self.state;
        let popped = state.queue.pop(self.params.get())?;
        state.turn = if state.queue.is_empty() {
            Turn::Due
        } else {
            Turn::Playing
        };
        Some(Start {
            action: popped.action,
            flags: if popped.clamped { Command::CLAMPED } else { 0 },
            from_policy: true,
            waypoint_m: None,
            query: false,
        })
    }

    fn ask(&mut self, now_ns: u64) -> Option<PolicyQuery> {
        let state = &mut self.state;
        let wanted = Wanted {
            state_sequence: state.robot.latest().map_or(0, |s| s.sequence),
            policy_step: state.current.policy_step,
            played: state.queue.played(),
            epoch: state.subtask.lock.epoch(),
            subtask: state.subtask.index(),
            prompt_id: state.subtask.lock.binding().map_or(0, |b| b.prompt_id),
        };
        state.chunk.ask(self.params.get(), now_ns, wanted)
    }

    fn rebind_request(&mut self, now_ns: u64) -> RebindRequest {
        let state = &mut self.state;
        let request_id = state.next_request;
        state.next_request = state.next_request.wrapping_add(1);
        RebindRequest {
            request_id,
            stamp_ns: now_ns,
            epoch: state.subtask.lock.epoch(),
            subtask: state.subtask.index(),
            suspect: state.subtask.lock.target(),
            reserved: 0,
            reasons: state.decision.reasons,
        }
    }
}
