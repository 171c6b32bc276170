//! The agents as one object: instructions, scenes and requests in, records
//! out.
//!
//! Nothing here waits and nothing reads a clock: the caller says what time it
//! is. Models are asked in worker threads and their answers are found by
//! [`AgentService::poll`]; the rules' answer is out before a model's question.

use fitmac_core::message::{CriticReport, GroundingRecord, Plan, RebindRequest};
use fitmac_core::wire::Provenance;

use crate::bind::{self, RecordHeader};
use crate::canvas::Canvas;
use crate::critic::{self, CriticOutput, FailureType, Snapshot};
use crate::grounder::resolver::{self, ResolverOutput};
use crate::grounder::{self, Context, Grounding, Verdict, Viewpoint};
use crate::model::{CallRecord, Calls, Finished, Question, Role, prompts};
use crate::planner::{self, PlanError, PlannerOutput, SURE, TaskPlan};
use crate::prompt::{Backbone, policy_prompt};
use crate::scene::{Scene, SceneError};
use crate::track::{TrackId, TrackParams, TrackedScene, Tracker};

/// Settings of an [`AgentService`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServiceParams {
    /// Names this run to the controller.
    pub session: u64,
    /// The viewer of left and right.
    pub viewpoint: Viewpoint,
    /// The policy that the prompts are for.
    pub backbone: Backbone,
    /// Instance tracking.
    pub tracking: TrackParams,
    /// Model calls of each role that a subtask may cost.
    pub calls_per_subtask: u32,
}

impl Default for ServiceParams {
    fn default() -> Self {
        Self {
            session: 1,
            viewpoint: Viewpoint::default(),
            backbone: Backbone::default(),
            tracking: TrackParams::default(),
            calls_per_subtask: 2,
        }
    }
}

/// What the service has to say.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A plan for the controller.
    Plan(Plan),
    /// A sentence for the policy; chunks answer with its number.
    Prompt {
        /// Its number.
        id: u32,
        /// The sentence.
        text: String,
    },
    /// A grounding for the controller.
    Grounding(Box<GroundingRecord>),
    /// The critic's word for the controller.
    Critic(CriticReport),
    /// A model call for the trace.
    Call(CallRecord),
}

/// The lock of the active subtask.
#[derive(Clone, Copy, Debug)]
struct Lock {
    track: TrackId,
    provenance: Provenance,
    /// The model's confidence, where it chose.
    chosen: Option<f64>,
}

/// Planner, grounder and critic behind one face.
#[derive(Debug)]
pub struct AgentService {
    params: ServiceParams,
    calls: Option<Calls>,
    tracker: Tracker,
    seen: TrackedScene,
    image: Option<Canvas>,
    instruction: String,
    plan: Option<TaskPlan>,
    plan_id: u64,
    subtask: usize,
    lock: Option<Lock>,
    placed: Vec<TrackId>,
    epoch: u64,
    sequence: u64,
    critic_sequence: u64,
    prompt: (u32, String),
    spent: [u32; 3],
    waiting: Vec<(u64, Waiting)>,
    events: Vec<Event>,
}

/// What a call under way is for.
#[derive(Clone, Debug)]
enum Waiting {
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
    /// A service without a plan; `calls` reach a model, none is a normal state.
    #[must_use]
    pub fn new(params: ServiceParams, calls: Option<Calls>) -> Self {
        Self {
            tracker: Tracker::new(params.tracking),
            params,
            calls,
            seen: TrackedScene::default(),
            image: None,
            instruction: String::new(),
            plan: None,
            plan_id: 0,
            subtask: 0,
            lock: None,
            placed: Vec::new(),
            epoch: 0,
            sequence: 0,
            critic_sequence: 0,
            prompt: (0, String::new()),
            spent: [0; 3],
            waiting: Vec::new(),
            events: Vec::new(),
        }
    }

    /// The plan in force.
    #[must_use]
    pub fn plan(&self) -> Option<&TaskPlan> {
        self.plan.as_ref()
    }

    /// Takes a new instruction: what was under way is dropped.
    ///
    /// # Errors
    /// [`PlanError`] for an empty or overlong text; the old plan stays then.
    pub fn on_instruction(&mut self, now_ns: u64, text: &str) -> Result<(), PlanError> {
        let plan = planner::plan(text)?;
        self.instruction = text.to_owned();
        let unsure = plan.confidence < SURE;
        self.adopt(now_ns, plan);
        if unsure {
            let user = serde_json::Value::from(text).to_string();
            let user = format!("Instruction: {user}");
            let question = Question {
                system: prompts::PLANNER,
                user,
                png: None,
            };
            self.ask(Role::Planner, now_ns, question, Waiting::Plan);
        }
        Ok(())
    }

    /// Takes a scene, with the image that it was seen in if there is one.
    ///
    /// # Errors
    /// [`SceneError`] names the field; the last scene stays then.
    pub fn on_scene(
        &mut self,
        now_ns: u64,
        scene: &Scene,
        image: Option<Canvas>,
    ) -> Result<(), SceneError> {
        scene.check()?;
        self.seen = self.tracker.update(scene);
        self.image = image;
        self.ground(now_ns, Provenance::Rules, false);
        Ok(())
    }

    /// The controller has gone on to another subtask.
    pub fn on_subtask(&mut self, now_ns: u64, subtask: u32) {
        let subtask = subtask as usize;
        if self
            .plan
            .as_ref()
            .is_none_or(|plan| subtask >= plan.subtasks.len())
        {
            return;
        }
        if subtask > self.subtask {
            self.placed.extend(self.lock.map(|lock| lock.track));
        }
        self.begin(now_ns, subtask);
    }

    /// The controller asks to look again: the answer has a higher epoch, even
    /// if the same object is found.
    pub fn on_rebind_request(&mut self, now_ns: u64, request: &RebindRequest) {
        if request.subtask as usize != self.subtask {
            return;
        }
        self.epoch = self.epoch.max(request.epoch);
        self.lock = None;
        self.ground(now_ns, Provenance::Recheck, true);
    }

    /// Asks the critic about a snapshot, beside the rules' own diagnosis.
    pub fn on_snapshot(
        &mut self,
        now_ns: u64,
        snapshot: &Snapshot,
        rules: FailureType,
        rules_confidence: f64,
    ) {
        let Some(step) = self
            .plan
            .as_ref()
            .and_then(|plan| plan.subtasks.get(self.subtask))
        else {
            return;
        };
        let question = critic::question(&step.text, snapshot);
        let subtask = u32::try_from(self.subtask).unwrap_or(u32::MAX);
        let waiting = Waiting::Critic {
            subtask,
            rules,
            rules_confidence,
            stamp_ns: now_ns,
        };
        self.ask(Role::Critic, now_ns, question, waiting);
    }

    /// What there is to say since the last poll; never waits.
    pub fn poll(&mut self, now_ns: u64) -> Vec<Event> {
        let finished = self.calls.as_mut().map_or_else(Vec::new, Calls::poll);
        for call in finished {
            self.finish(now_ns, call);
        }
        std::mem::take(&mut self.events)
    }

    fn adopt(&mut self, now_ns: u64, plan: TaskPlan) {
        self.plan_id += 1;
        self.events
            .push(Event::Plan(bind::plan(self.plan_id, &plan)));
        self.plan = Some(plan);
        self.placed.clear();
        self.begin(now_ns, 0);
    }

    /// Starts a subtask: nothing of the last one stays.
    fn begin(&mut self, now_ns: u64, subtask: usize) {
        if let Some(calls) = &mut self.calls {
            calls.cancel_all(None);
        }
        self.waiting.clear();
        self.spent = [0; 3];
        self.subtask = subtask;
        self.lock = None;
        self.ground(now_ns, Provenance::Rules, true);
    }

    /// Grounds the active subtask and reports it. The lock stays unless there
    /// is none; a new lock or a `fresh` look has a new epoch.
    fn ground(&mut self, now_ns: u64, provenance: Provenance, fresh: bool) {
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
        let excluded: Vec<usize> = self
            .placed
            .iter()
            .filter_map(|track| self.seen.index_of(*track))
            .collect();
        let context = Context {
            viewpoint: self.params.viewpoint,
            excluded: &excluded,
        };
        let mut grounding = grounder::ground(&step, &self.seen.scene, &context);
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

    fn report(&mut self, grounding: &Grounding) {
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

    fn ask_resolver(&mut self, now_ns: u64, grounding: &Grounding) {
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

    fn ask(&mut self, role: Role, now_ns: u64, question: Question, waiting: Waiting) {
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

    fn finish(&mut self, now_ns: u64, call: Finished) {
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
        let excluded: Vec<usize> = self
            .placed
            .iter()
            .filter_map(|track| self.seen.index_of(*track))
            .collect();
        let context = Context {
            viewpoint: self.params.viewpoint,
            excluded: &excluded,
        };
        let mut grounding = grounder::ground(step, &self.seen.scene, &context);
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

#[cfg(test)]
mod tests;
