//! The whole loop in one process, deterministic and as fast as the physics allows.
//!
//! Simulator, policy, agents and controller exchange the same messages as the processes on shared
//! memory; only the transport and the clock differ. The controller ticks once a physics step
//! (500 Hz). A chunk arrives as late as its policy says, a grounding as late as the agents are.

use fitmac_core::message::{
    ActionChunk, Command, GroundingRecord, Input, ObjectSample, Plan, PolicyQuery, RebindRequest,
    StateSample, TraceRecord,
};
use fitmac_core::wire::{ActionFrame, ActionSpace, GraspClass, GripperConvention};
use fitmac_core::{Controller, ValidParams};

use crate::action::{PHYSICS_STEP_S, SUBSTEPS};
use crate::agents::{Agents, Occasion, View};
use crate::backbone::{Backbone, Observation};
use crate::error::SimError;
use crate::object::ObjectClass;
use crate::perception::{Perception, PoseSource, Sighting};
use crate::predicate::{Goal, Judge};
use crate::sim::{RobotState, Sim};

/// Nanoseconds of a physics step.
pub(crate) const TICK_NS: u64 = 2_000_000;
const _: () = assert!(TICK_NS as f64 * 1e-9 == PHYSICS_STEP_S);
/// How long the agents take for a look, ns.
const GROUNDING_LATENCY_NS: u64 = 200_000_000;
/// When the agents first look, ns: a few frames are in by then, and the answer comes before the
/// first query.
const FIRST_LOOK_NS: u64 = 250_000_000;
/// How often the agents look without being asked, ns.
const GROUNDING_PERIOD_NS: u64 = 1_000_000_000;
/// The run that the simulated processes belong to.
const SESSION: u64 = 1;

/// What an episode consists of.
pub struct Setup {
    /// The world.
    pub sim: Sim,
    /// What decides success.
    pub goal: Goal,
    /// What the robot is told.
    pub instruction: String,
    /// Who acts by default.
    pub backbone: Box<dyn Backbone>,
    /// Who plans and grounds.
    pub agents: Box<dyn Agents>,
    /// The controller's parameters.
    pub params: ValidParams,
    /// Where object poses come from.
    pub pose_source: PoseSource,
    /// Draws the noise of perception and policy.
    pub seed: u64,
    /// Policy steps until the episode is over.
    pub max_steps: u64,
}

/// The loop of one episode.
pub struct Lockstep {
    sim: Sim,
    judge: Judge,
    instruction: String,
    backbone: Box<dyn Backbone>,
    agents: Box<dyn Agents>,
    controller: Controller,
    perception: Perception,
    tick: u64,
    max_steps: u64,
    sightings: Vec<Sighting>,
    plan: Option<Plan>,
    chunks: Mailbox<ActionChunk>,
    groundings: Mailbox<GroundingRecord>,
    question: Option<PolicyQuery>,
    policy_busy_until_ns: u64,
    epoch_given: u64,
    looked_ns: u64,
    last_command: Option<Command>,
    outcome: Option<Outcome>,
}

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The goal holds, released and at rest.
    Success,
    /// The policy steps are used up.
    OutOfSteps,
    /// The controller stopped, or nothing moved for longer than an episode may last.
    OutOfTime,
}

impl Outcome {
    /// Whether an episode without success is over.
    pub(crate) fn at(step: u64, tick: u64, max_steps: u64) -> Option<Self> {
        // Waiting for the policy takes time but no steps: three times as long as without is enough.
        let longest = 3 * (max_steps + 40) * u64::from(SUBSTEPS);
        if step > max_steps {
            Some(Self::OutOfSteps)
        } else {
            (tick > longest).then_some(Self::OutOfTime)
        }
    }
}

/// What one tick did.
#[derive(Clone, Debug, Default)]
pub struct Ticked {
    /// The controller's command.
    pub command: Option<Command>,
    /// Whether a new action was taken by the robot.
    pub acted: bool,
    /// A record of a query.
    pub trace: Option<TraceRecord>,
    /// A record of an event.
    pub event: Option<TraceRecord>,
    /// A request for another look.
    pub rebind: Option<RebindRequest>,
}

/// Messages on their way.
#[derive(Clone, Debug)]
struct Mailbox<T> {
    sequence: u64,
    waiting: Vec<(u64, T)>,
}

impl<T> Mailbox<T> {
    fn new() -> Self {
        Self {
            sequence: 0,
            waiting: Vec::new(),
        }
    }

    fn next_sequence(&mut self) -> u64 {
        self.sequence += 1;
        self.sequence
    }

    fn post(&mut self, due_ns: u64, message: T) {
        self.waiting.push((due_ns, message));
    }

    /// The newest message that is due; older ones are lost, as in a buffer of one.
    fn take(&mut self, now_ns: u64) -> Option<T> {
        let mut newest = None;
        while let Some(at) = self.waiting.iter().position(|(due, _)| *due <= now_ns) {
            newest = Some(self.waiting.remove(at).1);
        }
        newest
    }
}

impl Lockstep {
    /// Everything at the start of an episode.
    #[must_use]
    pub fn new(setup: Setup) -> Self {
        let Setup {
            sim,
            goal,
            instruction,
            mut backbone,
            mut agents,
            params,
            ..
        } = setup;
        backbone.reset(setup.seed);
        let plan = agents.plan(&instruction);
        // The policy's noise and the perception's are different draws of the same seed.
        let perception = Perception::new(setup.pose_source, &sim, !setup.seed);
        Self {
            judge: Judge::new(goal),
            sim,
            instruction,
            backbone,
            agents,
            controller: Controller::new(params),
            perception,
            tick: 0,
            max_steps: setup.max_steps,
            sightings: Vec::new(),
            plan: Some(plan),
            chunks: Mailbox::new(),
            groundings: Mailbox::new(),
            question: None,
            policy_busy_until_ns: 0,
            epoch_given: 0,
            looked_ns: 0,
            last_command: None,
            outcome: None,
        }
    }

    /// The world.
    #[must_use]
    pub fn sim(&self) -> &Sim {
        &self.sim
    }

    /// The world, for pictures.
    pub fn sim_mut(&mut self) -> &mut Sim {
        &mut self.sim
    }

    /// The world, when the episode is over.
    #[must_use]
    pub fn into_sim(self) -> Sim {
        self.sim
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Simulated time, ns.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.tick * TICK_NS
    }

    /// Policy steps that were begun.
    #[must_use]
    pub fn policy_step(&self) -> u64 {
        self.last_command.map_or(0, |c| c.policy_step)
    }

    /// How the episode ended, once it has.
    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    /// Runs to the end; `watch` sees every tick.
    ///
    /// # Errors
    /// As for [`Lockstep::step`].
    pub fn run(&mut self, mut watch: impl FnMut(&mut Self, &Ticked)) -> Result<Outcome, SimError> {
        loop {
            let ticked = self.step()?;
            watch(self, &ticked);
            if let Some(outcome) = self.outcome {
                return Ok(outcome);
            }
        }
    }

    /// One control tick and one physics step.
    ///
    /// # Errors
    /// [`SimError::Diverged`] if the physics fails.
    pub fn step(&mut self) -> Result<Ticked, SimError> {
        let now_ns = self.now_ns();
        self.perception.capture(self.tick, now_ns, &mut self.sim);
        self.perception.update(now_ns, &self.sim);
        self.sightings.clear();
        self.sightings.extend(self.perception.sightings());
        self.look_again(now_ns);
        let state = self.state_sample(now_ns);
        let chunk = self.chunks.take(now_ns);
        let grounding = self.groundings.take(now_ns);
        let plan = self.plan.take();
        let input = Input {
            state: Some(&state),
            chunk: chunk.as_ref(),
            grounding: grounding.as_ref(),
            plan: plan.as_ref(),
            ..Input::default()
        };
        let output = self.controller.tick(now_ns, &input);
        // The policy works on one question at a time, and then on the newest one.
        self.question = output.query.or(self.question);
        if now_ns >= self.policy_busy_until_ns
            && let Some(query) = self.question.take()
        {
            self.ask_policy(now_ns, &query);
        }
        if let Some(rebind) = &output.rebind {
            self.ground(
                now_ns,
                rebind.subtask,
                Occasion::Rebind {
                    suspect: rebind.suspect,
                },
            );
        }
        let acted = self.policy_step() != output.command.policy_step;
        if acted {
            self.sim.apply(&output.command.action)?;
        }
        self.last_command = Some(output.command);
        self.sim.step_physics();
        self.tick += 1;
        self.judge_outcome();
        Ok(Ticked {
            command: Some(output.command),
            acted,
            trace: output.trace,
            event: output.event,
            rebind: output.rebind,
        })
    }

    fn judge_outcome(&mut self) {
        if !self.tick.is_multiple_of(u64::from(SUBSTEPS)) {
            return;
        }
        self.outcome = if self.judge.look(&self.sim) {
            Some(Outcome::Success)
        } else {
            Outcome::at(self.policy_step(), self.tick, self.max_steps)
        };
    }

    fn look_again(&mut self, now_ns: u64) {
        if now_ns < FIRST_LOOK_NS {
            return;
        }
        let subtask = self.controller.state().subtask().index();
        if self.epoch_given == 0 {
            self.ground(now_ns, subtask, Occasion::First);
        } else if now_ns.saturating_sub(self.looked_ns) >= GROUNDING_PERIOD_NS {
            self.ground(now_ns, subtask, Occasion::Again);
        }
    }

    fn ground(&mut self, now_ns: u64, subtask: u32, occasion: Occasion) {
        self.looked_ns = now_ns;
        let committed = self.controller.state().subtask().lock().epoch();
        let epoch = match occasion {
            Occasion::Again => committed,
            Occasion::First | Occasion::Rebind { .. } => self.epoch_given.max(committed) + 1,
        };
        let view = View {
            now_ns,
            scene: self.sim.scene(),
            sightings: &self.sightings,
        };
        let Some(record) = self.agents.ground(&view, subtask, epoch, occasion) else {
            return;
        };
        self.epoch_given = self.epoch_given.max(epoch);
        let sequence = self.groundings.next_sequence();
        let record = GroundingRecord {
            sequence,
            session: SESSION,
            stamp_ns: now_ns,
            ..record
        };
        self.groundings.post(now_ns + GROUNDING_LATENCY_NS, record);
    }

    fn ask_policy(&mut self, now_ns: u64, query: &PolicyQuery) {
        let prompt = self
            .agents
            .prompt(query.prompt_id)
            .unwrap_or(&self.instruction)
            .to_owned();
        let seen = Observation::of(&self.sim, &prompt, query.policy_step);
        let answer = self.backbone.infer(&seen);
        let late_ns = (answer.latency_s.max(0.0) * 1e9) as u64;
        self.policy_busy_until_ns = now_ns + late_ns;
        let mut chunk = ActionChunk {
            sequence: self.chunks.next_sequence(),
            session: SESSION,
            observation_ns: now_ns,
            stamp_ns: now_ns + late_ns,
            query_id: query.query_id,
            epoch: query.epoch,
            subtask: query.subtask,
            prompt_id: query.prompt_id,
            horizon: u32::try_from(answer.actions.len()).unwrap_or(u32::MAX),
            action_space: ActionSpace::OscPoseDelta.code(),
            frame: ActionFrame::Base.code(),
            gripper: GripperConvention::MinusOneOpen.code(),
            ..ActionChunk::default()
        };
        for (wire, action) in chunk.actions.iter_mut().zip(&answer.actions) {
            *wire = action.map(|a| a as f32);
        }
        for _ in 0..answer.copies {
            self.chunks.post(now_ns + late_ns, chunk);
        }
    }

    fn state_sample(&self, now_ns: u64) -> StateSample {
        let applied = self.last_command.map_or(0, |c| c.sequence);
        let mut sample = robot_sample(&self.sim.robot(), now_ns);
        sample.sequence = self.tick + 1;
        sample.session = SESSION;
        sample.applied_command = applied;
        for (slot, seen) in sample.objects.iter_mut().zip(&self.sightings) {
            let Some(placed) = self.sim.scene().by_id(seen.id) else {
                continue;
            };
            *slot = ObjectSample {
                id: seen.id,
                grasp_class: grasp_class(placed.kind.class).code(),
                visible: u8::from(seen.visible),
                reserved: 0,
                stamp_ns: seen.stamp_ns,
                position_m: seen.pose.position_m,
                orientation: seen.pose.orientation,
                half_extent_m: placed.kind.half_extent_m(),
                confidence: seen.confidence,
            };
            sample.object_count += 1;
        }
        sample
    }
}

/// What the robot measures as a message, without objects.
#[must_use]
pub fn robot_sample(robot: &RobotState, now_ns: u64) -> StateSample {
    StateSample {
        stamp_ns: now_ns,
        joint_position_rad: robot.joint_position_rad,
        joint_velocity_rad_s: robot.joint_velocity_rad_s,
        ee_position_m: robot.tcp.position_m,
        ee_orientation: robot.tcp.orientation,
        ee_velocity_m_s: robot.tcp_velocity_m_s,
        gripper_width_m: robot.gripper_width_m,
        ..StateSample::default()
    }
}

/// The controller's name for a class of objects.
#[must_use]
pub fn grasp_class(class: ObjectClass) -> GraspClass {
    match class {
        ObjectClass::Box => GraspClass::Box,
        ObjectClass::Can => GraspClass::Can,
        ObjectClass::Bottle => GraspClass::Bottle,
        ObjectClass::Bowl => GraspClass::Bowl,
        ObjectClass::Fixture => GraspClass::Fixture,
    }
}
