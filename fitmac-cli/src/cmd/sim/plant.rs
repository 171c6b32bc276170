//! The simulated robot as the controller meets it: commands in, samples and
//! verdicts out.

use fitmac_core::{
    message::{Command, OBJECT_CAPACITY, ObjectSample, StateSample, VerifierReport},
    wire::{GraspClass, Phase, Route, SubPhase, Verdict},
};
use fitmac_rt::{
    endpoint::{CommandLimits, CommandState, CommandWatch},
    envelope::Envelope,
};
use sim_harness::{
    action::{Action, PHYSICS_STEP_S, SUBSTEPS, WAIT},
    object::ObjectClass,
    pose::distance_m,
    predicate::Judge,
    sim::Sim,
};

use crate::{
    crew::{Outcome, Progress},
    episode::Episode,
};

/// Policy steps that the controller lets pass while the scene settles.
const SETTLE_STEPS: u64 = 10;
/// An object that has risen this far is lifted, m.
const LIFTED_M: f64 = 0.04;

/// The robot, its world and the judge.
pub(super) struct Plant {
    sim: Sim,
    judge: Judge,
    watch: CommandWatch,
    sample: StateSample,
    report: VerifierReport,
    /// Heights of the objects' centres at the start, m.
    rest_height_m: Vec<f64>,
    substep: u32,
    /// The newest command that was followed.
    command: Option<Command>,
    stopped: bool,
    steps: u64,
    steps_max: u64,
    replaced_steps: u64,
    lifted: Option<u16>,
    late_steps: u64,
    verdict: Option<bool>,
}

impl Plant {
    /// The robot at rest in the scene.
    pub(super) fn new(episode: &Episode) -> anyhow::Result<Self> {
        let sim = Sim::new(episode.scene.clone())?;
        let rest_height_m = sim
            .objects()
            .iter()
            .map(|object| object.pose.position_m[2])
            .collect();
        Ok(Self {
            sim,
            judge: Judge::new(episode.goal),
            watch: CommandWatch::new(CommandLimits::default()),
            sample: StateSample::default(),
            report: VerifierReport::default(),
            rest_height_m,
            substep: 0,
            command: None,
            stopped: true,
            steps: 0,
            steps_max: SETTLE_STEPS + u64::from(episode.suite.max_steps),
            replaced_steps: 0,
            lifted: None,
            late_steps: 0,
            verdict: None,
        })
    }

    /// Follows what arrived, or comes to rest if there is nothing to follow.
    pub(super) fn take_command(
        &mut self,
        now_ns: u64,
        arrived: Option<&Envelope<Command>>,
    ) -> anyhow::Result<()> {
        match self.watch.step(now_ns, arrived) {
            CommandState::Follow(command) => self.follow(command),
            CommandState::Stop(_) => self.stand(),
        }
    }

    fn follow(&mut self, command: Command) -> anyhow::Result<()> {
        let before = self.command.map(|command| command.policy_step);
        self.sample.applied_command = command.sequence;
        self.stopped = false;
        let starts_action = before != Some(command.policy_step) && command.policy_step > 0;
        if starts_action {
            self.sim.apply(&command.action)?;
            self.steps += 1;
            self.replaced_steps += u64::from(is_correction(&command));
        }
        self.command = Some(command);
        Ok(())
    }

    /// Holds the place where it is; the gripper keeps what it was told.
    fn stand(&mut self) -> anyhow::Result<()> {
        if !self.stopped {
            self.stopped = true;
            let mut action: Action = WAIT;
            action[6] = self.command.map_or(WAIT[6], |command| command.action[6]);
            self.sim.apply(&action)?;
        }
        Ok(())
    }

    /// One physics step.
    pub(super) fn step(&mut self) {
        self.sim.step_physics();
        self.substep = (self.substep + 1) % SUBSTEPS;
    }

    /// A physics step began late.
    pub(super) fn count_late_step(&mut self) {
        self.late_steps += 1;
    }

    /// What the robot measures now.
    pub(super) fn sample(&mut self, now_ns: u64) -> &mut StateSample {
        let robot = self.sim.robot();
        let sample = &mut self.sample;
        sample.stamp_ns = now_ns;
        sample.joint_position_rad = robot.joint_position_rad;
        sample.joint_velocity_rad_s = robot.joint_velocity_rad_s;
        sample.ee_position_m = robot.tcp.position_m;
        sample.ee_orientation = robot.tcp.orientation;
        sample.ee_velocity_m_s = robot.tcp_velocity_m_s;
        sample.gripper_width_m = robot.gripper_width_m;
        let mut count = 0;
        let placed = self.sim.scene().objects().iter().zip(self.sim.objects());
        for ((placed, state), slot) in placed.zip(&mut sample.objects) {
            *slot = ObjectSample {
                id: placed.id,
                grasp_class: grasp_class(placed.kind.class).code(),
                visible: 1,
                reserved: 0,
                stamp_ns: now_ns,
                position_m: state.pose.position_m,
                orientation: state.pose.orientation,
                half_extent_m: placed.kind.half_extent_m(),
                confidence: 1.0,
            };
            count += 1;
        }
        sample.object_count = count;
        sample
    }

    /// Whether a policy step's worth of physics has passed since the last look.
    pub(super) fn is_end_of_look(&self) -> bool {
        self.substep == 0
    }

    /// The judge's look at the scene, 20 times a second.
    pub(super) fn look(&mut self, now_ns: u64) -> &mut VerifierReport {
        let goal = self.judge.goal();
        let done = self.judge.look(&self.sim);
        self.note_lifted();
        if self.verdict.is_none() {
            if done {
                self.verdict = Some(true);
            } else if self.steps >= self.steps_max {
                self.verdict = Some(false);
            }
        }
        let verdict = match (self.verdict == Some(true), goal.holds(&self.sim)) {
            (true, _) => Verdict::Success,
            // In its place, but not released or not at rest yet.
            (false, true) => Verdict::Unknown,
            (false, false) => Verdict::Fail,
        };
        self.report.stamp_ns = now_ns;
        self.report.verdict = verdict.code();
        &mut self.report
    }

    fn note_lifted(&mut self) {
        if self.lifted.is_none() {
            let risen = self.sim.objects().into_iter().zip(&self.rest_height_m);
            let risen = risen.map(|(object, rest)| (object.id, object.pose.position_m[2] - rest));
            self.lifted = risen
                .into_iter()
                .find(|(_, by_m)| *by_m > LIFTED_M)
                .map(|(id, _)| id);
        }
    }

    /// How the episode ended, once it has.
    pub(super) fn verdict(&self) -> Option<bool> {
        self.verdict
    }

    /// The simulator, for pictures.
    pub(super) fn sim(&mut self) -> &mut Sim {
        &mut self.sim
    }

    /// Simulated time, s.
    pub(super) fn time_s(&self) -> f64 {
        self.sim.time_s()
    }

    /// The first object that was lifted.
    pub(super) fn lifted(&self) -> Option<u16> {
        self.lifted
    }

    /// The object that the instruction means.
    pub(super) fn target(&self) -> u16 {
        self.judge.goal().object()
    }

    /// How far the target has risen, m.
    pub(super) fn target_risen_m(&self) -> f64 {
        let target = self.target();
        let rest = self.rest_height_m.get(usize::from(target).wrapping_sub(1));
        match (self.sim.object(target), rest) {
            (Some(object), Some(rest)) => object.pose.position_m[2] - rest,
            _ => 0.0,
        }
    }

    /// Whether a correction has the arm.
    pub(super) fn corrects(&self) -> bool {
        self.command.as_ref().is_some_and(is_correction)
    }

    /// Distance between the finger pads, m.
    pub(super) fn gripper_width_m(&self) -> f64 {
        self.sample.gripper_width_m
    }

    /// Where the episode stands.
    pub(super) fn progress(&self) -> Progress {
        let goal = self.judge.goal();
        let place = |id| {
            self.sim
                .object(id)
                .map_or([f64::NAN; 3], |o| o.pose.position_m)
        };
        let (object, destination) = (place(goal.object()), place(goal.destination()));
        let command = self.command.as_ref();
        let name = |name: Option<&str>| name.unwrap_or("waiting").to_owned();
        Progress {
            step: self.steps,
            steps_max: self.steps_max,
            phase: name(command.and_then(Command::phase).map(Phase::name)),
            route: name(command.and_then(Command::route).map(Route::name)),
            sub_phase: name(command.and_then(Command::sub_phase).map(SubPhase::name)),
            target_distance_m: distance_m(self.sample.ee_position_m, object),
            destination_distance_m: distance_m(object, destination),
        }
    }

    /// How the episode ended.
    pub(super) fn outcome(&self, pictures: Vec<String>) -> Outcome {
        let name = |id| self.sim.scene().by_id(id).map(|object| object.name.clone());
        Outcome {
            success: self.verdict == Some(true),
            steps: self.steps,
            seconds: self.sim.time_s(),
            replaced_steps: self.replaced_steps,
            lifted: self.lifted.and_then(name),
            late_steps: self.late_steps,
            pictures,
        }
    }
}

/// Whether a correction, not the policy, decided the command.
fn is_correction(command: &Command) -> bool {
    matches!(command.route(), Some(Route::Execution | Route::Pending))
}

/// The same class as the core names it.
fn grasp_class(class: ObjectClass) -> GraspClass {
    match class {
        ObjectClass::Box => GraspClass::Box,
        ObjectClass::Can => GraspClass::Can,
        ObjectClass::Bottle => GraspClass::Bottle,
        ObjectClass::Bowl => GraspClass::Bowl,
        ObjectClass::Fixture => GraspClass::Fixture,
    }
}

const _: () = assert!(sim_harness::scene::MAX_OBJECTS <= OBJECT_CAPACITY);
const _: () = assert!(PHYSICS_STEP_S == 0.002);
