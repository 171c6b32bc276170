//! The agents as one object: instructions, scenes and requests in, records
//! out.
//!
//! Nothing here waits and nothing reads a clock: the caller says what time it
//! is. Models are asked in worker threads and their answers are found by
//! [`AgentService::poll`]; the rules' answer is out before a model's question.

use fitmac_core::message::{CriticReport, GroundingRecord, Plan, RebindRequest};
use fitmac_core::wire::Provenance;

use crate::bind;
use crate::canvas::Canvas;
use crate::critic::{self, FailureType, Snapshot};
use crate::grounder::Viewpoint;
use crate::model::{CallRecord, Calls, Question, Role, prompts};
use crate::planner::{self, PlanError, SURE, TaskPlan};
use crate::prompt::Backbone;
use crate::scene::{Scene, SceneError};
use crate::track::{TrackId, TrackParams, TrackedScene, Tracker};

mod calls;
mod lock;

use calls::Waiting;
use lock::Lock;

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
}

#[cfg(test)]
mod tests;
