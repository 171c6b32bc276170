//! Policy steps and queries (Algorithm 1), the queue, and the questions.

use fitmac_core::{
    intake::Refusal,
    message::{Command, PolicyQuery, RebindRequest},
    params::{PolicyGripper, WhileRebinding},
    reason,
    wire::{Diagnosis, EventKind, Route},
};

use super::{
    Decision, Model, Notes, Said, Start, Turn,
    doors::{Question, ms},
    still,
    task::{Asked, Found, Gate, Task},
};

/// Who acts after a query.
enum Next {
    Policy,
    Correction([f64; 7], Option<[f64; 3]>),
    /// The agents are asked; meanwhile the arm holds, or not.
    Agents(bool),
}

impl Model {
    pub(super) fn play(&mut self, now: u64, notes: &mut Notes) -> Option<Start> {
        match self.turn {
            Turn::AwaitChunk(horizon) => return self.await_chunk(now, horizon, notes),
            Turn::AwaitBinding(since) => return self.await_binding(now, since, notes),
            _ if !self.due(now) => return None,
            Turn::Settle(0) => self.turn = Turn::Due,
            Turn::Settle(left) => {
                self.turn = Turn::Settle(left - 1);
                return Some(still(-1.0));
            }
            Turn::Due | Turn::Play => {}
        }
        self.observe();
        if self.queue.is_empty() {
            return self.query(now, notes);
        }
        if self.queue.len() == self.p.chunk.query_lead_steps as usize {
            notes.query = self.ask(now);
        }
        Some(self.pop())
    }

    /// A policy step went by; a sample is looked at once.
    fn observe(&mut self) {
        let Some(sample) = self.doors.state else {
            return;
        };
        let name = Some((sample.session, sample.sequence));
        if std::mem::replace(&mut self.observed, name) == name {
            return;
        }
        let width = self.width.replace(sample.gripper_width_m);
        let width = width.unwrap_or(sample.gripper_width_m);
        let told_closed = self.policy_step > 0 && self.action[6] > 0.0;
        let verdict = self.verdict();
        self.task
            .step(&self.p, &sample, width, told_closed, verdict);
    }

    fn query(&mut self, now: u64, notes: &mut Notes) -> Option<Start> {
        let sample = self.doors.state?;
        self.queries += 1;
        let next = self.task.index + 1;
        let subtasks = self.doors.plan.map_or(1, |p| p.subtask_count);
        let advances = self.task.succeeded(&self.p, self.verdict()) && next < subtasks;
        if advances {
            self.task = Task::new(next, self.task.epoch);
            self.doors.next_subtask(next);
            notes.event = Some((EventKind::SubtaskChanged, 0));
        }
        let plan = self
            .doors
            .plan
            .map_or(1.0, |p| f64::from(p.confidence_permille) / 1000.0);
        let critic = self.doors.suspicion(self.p.evidence.critic_confidence);
        let verdict = self.verdict();
        let spent = self.corrections;
        let found = self
            .task
            .judge(&self.p, now, &sample, verdict, critic, plan, spent);
        if found.diagnosis == Diagnosis::Success {
            self.task.story.complete();
        }
        let (phase, other) = (self.task.story.phase, self.task.other());
        let route = self.task.route(found.gate);
        let mut rebound = false;
        let (next, reasons) = match route {
            Route::Base => {
                let Gate::Closed(why) = found.gate else {
                    unreachable!("the base policy acts behind a closed gate")
                };
                (Next::Policy, why)
            }
            Route::Target => self.correct_target(now, &found, &mut rebound),
            Route::Execution | Route::Pending => self.correct_execution(&found),
        };
        if !matches!(next, Next::Agents(_)) {
            self.task.heed(&found);
        }
        let horizon = self.horizon(&next, rebound);
        self.decision = Decision {
            kappa: found.kappa,
            evidence: found.evidence,
            phase,
            diagnosis: found.diagnosis,
            route,
            reasons,
            horizon,
            other,
        };
        if rebound || advances {
            (self.doors.question, self.doors.ready) = (None, None);
        }
        self.act_on(now, next, horizon, notes)
    }

    fn act_on(&mut self, now: u64, next: Next, horizon: u32, notes: &mut Notes) -> Option<Start> {
        match next {
            Next::Correction(action, waypoint) => {
                (self.doors.question, self.doors.ready) = (None, None);
                self.turn = Turn::Due;
                Some(Start {
                    action,
                    flags: 0,
                    waypoint,
                    query: true,
                })
            }
            Next::Policy => {
                self.turn = Turn::AwaitChunk(horizon);
                self.await_chunk(now, horizon, notes)
            }
            Next::Agents(hold) => {
                notes.rebind = Some(RebindRequest {
                    request_id: self.request_id,
                    stamp_ns: now,
                    epoch: self.task.epoch,
                    subtask: self.task.index,
                    suspect: self.task.target(),
                    reserved: 0,
                    reasons: self.decision.reasons,
                });
                self.request_id += 1;
                if hold {
                    self.turn = Turn::AwaitBinding(now);
                    return Some(Start {
                        query: true,
                        ..still(self.action[6])
                    });
                }
                self.turn = Turn::AwaitChunk(horizon);
                self.await_chunk(now, horizon, notes)
            }
        }
    }

    fn correct_target(&mut self, now: u64, found: &Found, rebound: &mut bool) -> (Next, u64) {
        let Gate::Target(why) = found.gate else {
            unreachable!("the gate is open for it")
        };
        if let Some(record) = self.doors.proposal.take() {
            self.rebinds += u32::from(self.task.binding.is_some());
            self.task.commit(&record);
            *rebound = true;
            return (Next::Policy, why);
        }
        match self.task.asked {
            Asked::No if self.task.may_ask(&self.p) => {
                self.task.ask(now);
                let holds = self.p.while_rebinding == WhileRebinding::Hold;
                (Next::Agents(holds && self.may_act()), why)
            }
            Asked::No => (Next::Policy, why | reason::BUDGET_SPENT),
            Asked::InVain => (Next::Policy, why | reason::AWAITING_REBIND),
            Asked::Since(then) => {
                if now.saturating_sub(then) > ms(self.p.lock.rebind_wait_ms) {
                    self.task.asked = Asked::InVain;
                }
                (Next::Policy, why | reason::AWAITING_REBIND)
            }
        }
    }

    /// Some correction may act at all.
    fn may_act(&self) -> bool {
        let s = &self.p.switches;
        s.target_corrector || (s.execution_corrector && (s.hard_pick || s.hard_place))
    }

    fn correct_execution(&mut self, found: &Found) -> (Next, u64) {
        let why = match found.gate {
            Gate::Execution(why) if self.task.arm.is_none() => why,
            _ => reason::CORRECTION_PENDING,
        };
        let sample = self.doors.state.expect("a query has a state");
        match self.task.correct(&self.p, &sample, found, self.corrections) {
            None => (Next::Policy, reason::NO_ACTION),
            Some(Said::Bottom(end)) => (Next::Policy, why | end),
            Some(Said::Act(action, waypoint)) => {
                self.corrections += 1;
                (Next::Correction(action, waypoint), why)
            }
        }
    }

    /// Equation 12, by mode.
    fn horizon(&self, next: &Next, rebound: bool) -> u32 {
        let base = self.p.chunk.open_loop_steps;
        let short = base.min(self.p.horizon.execution_steps);
        let recent = |n: Option<u32>| n.is_some_and(|n| n < self.p.horizon.hand_back_steps);
        let task = &self.task;
        let armed = task.failures() > 0 && task.binding.is_some();
        let moved = task.since_rebind();
        match next {
            Next::Correction(..) => 1,
            _ if !self.may_act() => base,
            _ if armed || (rebound && moved.is_some()) => short,
            _ if recent(moved) || recent(task.since_hand_back()) => short,
            _ => base,
        }
    }

    fn await_chunk(&mut self, now: u64, horizon: u32, notes: &mut Notes) -> Option<Start> {
        if self.due(now)
            && let Some(left) = self.doors.take_chunk(self.played)
        {
            self.queue = left.into_iter().take(horizon as usize).collect();
            if self.queue.is_empty() {
                self.doors.count(Refusal::Consumed);
            } else {
                let start = self.pop();
                return Some(Start {
                    query: true,
                    ..start
                });
            }
        }
        notes.query = self.ask(now);
        None
    }

    fn await_binding(&mut self, now: u64, since: u64, notes: &mut Notes) -> Option<Start> {
        let over = now.saturating_sub(since) > ms(self.p.lock.rebind_wait_ms);
        if self.doors.proposal.is_none() && !over {
            return None;
        }
        self.turn = Turn::Due;
        if !self.due(now) {
            return None;
        }
        self.observe();
        self.query(now, notes)
    }

    /// The next action of the queue.
    fn pop(&mut self) -> Start {
        let mut action = self.queue.remove(0).map(f64::from);
        self.played += 1;
        self.turn = if self.queue.is_empty() {
            Turn::Due
        } else {
            Turn::Play
        };
        if self.p.policy_gripper == PolicyGripper::OneOpen {
            action[6] = if action[6] > 0.5 { -1.0 } else { 1.0 };
        }
        let clamped = action.iter().any(|x| x.abs() > 1.0);
        Start {
            action: action.map(|x| if x.abs() > 1.0 { x.signum() } else { x }),
            flags: Command::FROM_POLICY | if clamped { Command::CLAMPED } else { 0 },
            waypoint: None,
            query: false,
        }
    }

    /// Asks the policy, or asks again after a while.
    pub(super) fn ask(&mut self, now: u64) -> Option<PolicyQuery> {
        let patience = ms(self.p.chunk.hold_after_ms);
        if let Some(open) = &mut self.doors.question {
            let again = now.saturating_sub(open.last) >= patience;
            if again {
                open.last = now;
            }
            return again.then_some(open.query);
        }
        if self.doors.ready.is_some() {
            return None;
        }
        let query = PolicyQuery {
            query_id: self.query_id,
            stamp_ns: now,
            state_sequence: self.doors.state.map_or(0, |s| s.sequence),
            policy_step: self.policy_step,
            epoch: self.task.epoch,
            subtask: self.task.index,
            prompt_id: self.task.binding.map_or(0, |b| b.prompt),
        };
        self.query_id += 1;
        self.doors.question = Some(Question {
            query,
            played: self.played,
            first: now,
            last: now,
        });
        Some(query)
    }
}
