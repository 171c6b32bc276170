//! Models' part: what they are asked, and what becomes of their answers.

use fitmac_core::message::CriticReport;
use fitmac_core::wire::Provenance;

use super::lock::Lock;
use super::{AgentService, Event};
use crate::bind;
use crate::critic::{CriticOutput, FailureType};
use crate::grounder::Grounding;
use crate::grounder::resolver::{self, ResolverOutput};
use crate::model::{CallRecord, Finished, Question, Role};
use crate::planner::{self, PlannerOutput, SURE, TaskPlan};
use crate::track::TrackId;

/// What a call under way is for.
#[derive(Clone, Debug)]
pub(super) enum Waiting {
    Plan,
    /// The candidates' tracks, in the question's order.
    Choice(Vec<TrackId>),
    Critic {
        subtask: u32,
        rules: FailureType,
        rules_confidence: f64,
        stamp_ns: u64,
    },
}

impl AgentService {
    pub(super) fn ask_resolver(&mut self, now_ns: u64, grounding: &Grounding) {
        let Some(plan) = &self.plan else { return };
        let image = self.image.as_ref();
        let question = resolver::question(plan, self.subtask, &self.instruction, grounding, image);
        let tracks = grounding
            .candidates
            .iter()
            .filter_map(|candidate| self.seen.tracks.get(candidate.seen.index).copied())
            .collect();
        self.ask(Role::Resolver, now_ns, question, Waiting::Choice(tracks));
    }

    pub(super) fn ask(&mut self, role: Role, now_ns: u64, question: Question, waiting: Waiting) {
        let Some(calls) = &mut self.calls else { return };
        let spent = &mut self.spent[role as usize];
        if *spent >= self.params.calls_per_subtask {
            return;
        }
        if let Some(ticket) = calls.start(role, now_ns, question) {
            *spent += 1;
            self.waiting.push((ticket, waiting));
        }
    }

    pub(super) fn finish(&mut self, now_ns: u64, call: Finished) {
        let at = self
            .waiting
            .iter()
            .position(|(ticket, _)| *ticket == call.ticket);
        let waiting = at.map(|at| self.waiting.remove(at).1);
        let used = match (waiting, &call.answer) {
            (Some(waiting), Ok(answer)) => self.take(now_ns, waiting, answer),
            (_, Err(error)) => Err(error.outcome()),
            // Its subtask is over.
            (None, Ok(_)) => Err("cancelled"),
        };
        self.events.push(Event::Call(CallRecord {
            role: call.role,
            asked_ns: call.asked_ns,
            latency_ns: now_ns.saturating_sub(call.asked_ns),
            attempts: call.attempts,
            outcome: used.err().unwrap_or("ok"),
        }));
    }

    fn take(&mut self, now_ns: u64, waiting: Waiting, answer: &str) -> Result<(), &'static str> {
        match waiting {
            Waiting::Plan => {
                let output =
                    PlannerOutput::from_model(answer, &self.instruction).map_err(|_| "schema")?;
                let rules = self.plan.as_ref().map_or(0.0, |plan| plan.confidence);
                // The model fills the schema where the rules could not, and is
                // not believed further than what asks for a second look.
                let confidence = output.confidence.min(SURE);
                if confidence <= rules || confidence < planner::UNDERSTOOD {
                    return Err("not_better");
                }
                let plan = TaskPlan {
                    confidence,
                    ..output.into_plan()
                };
                self.adopt(now_ns, plan);
                Ok(())
            }
            Waiting::Choice(tracks) => self.take_choice(&tracks, answer),
            Waiting::Critic {
                subtask,
                rules,
                rules_confidence,
                stamp_ns,
            } => {
                let output = CriticOutput::parse(answer).map_err(|error| error.outcome())?;
                let (label, confidence) = output.merged(rules, rules_confidence);
                self.critic_sequence += 1;
                self.events.push(Event::Critic(CriticReport {
                    sequence: self.critic_sequence,
                    stamp_ns,
                    subtask,
                    label: bind::critic_label(label).code(),
                    reserved: [0; 3],
                    confidence,
                }));
                Ok(())
            }
        }
    }

    fn take_choice(&mut self, tracks: &[TrackId], answer: &str) -> Result<(), &'static str> {
        let choice =
            ResolverOutput::parse(answer, tracks.len()).map_err(|error| error.outcome())?;
        let plan = self.plan.as_ref().ok_or("cancelled")?;
        let step = plan.subtasks.get(self.subtask).ok_or("cancelled")?;
        // The scene has moved on: the choice names a track, not an index.
        let track = tracks.get(choice.selected_index).copied().ok_or("schema")?;
        let mut grounding = self.look(step);
        let index = self.seen.index_of(track).ok_or("gone")?;
        let at = grounding
            .candidates
            .iter()
            .position(|c| c.seen.index == index)
            .ok_or("gone")?;
        if !grounding.apply(&ResolverOutput {
            selected_index: at,
            ..choice
        }) {
            return Err("overruled");
        }
        let chosen = Some(grounding.confidence);
        self.lock = Some(Lock {
            track,
            provenance: Provenance::Resolver,
            chosen,
        });
        self.epoch += 1;
        self.report(&grounding);
        Ok(())
    }
}
