//! A controller, a world, a policy and agents that run together.

use fitmac_core::{
    Controller, Params,
    message::{Input, Output, Plan, TraceRecord, VerifierReport},
    wire::{Mode, Verdict},
};

use super::{Agent, Policy, Scene, World};

/// What the task verifier does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verifier {
    /// There is none: the controller judges by geometry.
    Absent,
    /// Reports success as soon as the task is done.
    Successes,
    /// Reports success when the task is done, and failure as long as it is not.
    Both,
}

/// Everything that takes part in an episode, in simulated time.
#[derive(Clone, Debug)]
pub struct Session {
    /// The controller under test.
    pub controller: Controller,
    /// The world.
    pub world: World,
    /// The task.
    pub scene: Scene,
    /// The policy.
    pub policy: Policy,
    /// The agents.
    pub agent: Agent,
    /// The task verifier.
    pub verifier: Verifier,
    /// Time from an outcome to its report, ns.
    pub verdict_delay_ns: u64,
    /// Time between control ticks, ns.
    pub tick_ns: u64,
    /// The plan that is sent with the first tick, if any.
    pub plan: Option<Plan>,
    /// Records of all queries so far.
    pub queries: Vec<TraceRecord>,
    /// Records of all events so far.
    pub events: Vec<TraceRecord>,
    /// Rebind requests so far.
    pub rebinds: usize,
    verdicts: u64,
    done_since_ns: Option<u64>,
}

impl Session {
    /// A session at 250 Hz with a verifier that reports successes.
    ///
    /// # Panics
    /// If the parameters are not valid.
    #[must_use]
    pub fn new(params: Params, scene: Scene, policy: Policy, agent: Agent) -> Self {
        let params = params.validate().expect("parameters of a test are valid");
        Self {
            controller: Controller::new(params),
            world: scene.world.clone(),
            scene,
            policy,
            agent,
            verifier: Verifier::Successes,
            verdict_delay_ns: 0,
            tick_ns: 4_000_000,
            plan: None,
            queries: Vec::new(),
            events: Vec::new(),
            rebinds: 0,
            verdicts: 0,
            done_since_ns: None,
        }
    }

    /// One control tick.
    pub fn tick(&mut self) -> Output {
        self.tick_with(|_| {})
    }

    /// One control tick; `change` may alter what the controller is told.
    pub fn tick_with(&mut self, change: impl FnOnce(&mut Input<'_>)) -> Output {
        self.world.advance(self.tick_ns);
        let now_ns = self.world.now_ns();
        let sample = self.world.sample();
        let chunk = self.policy.poll(now_ns);
        let grounding = self.agent.poll(now_ns);
        let verifier = self.verdict();
        let plan = self.plan.take();
        let mut input = Input {
            state: Some(&sample),
            chunk: chunk.as_ref(),
            grounding: grounding.as_ref(),
            plan: plan.as_ref(),
            verifier: verifier.as_ref(),
            ..Input::default()
        };
        change(&mut input);
        let output = self.controller.tick(now_ns, &input);
        self.world.apply(&output.command);
        if let Some(query) = &output.query {
            self.policy.ask(query, &self.world, &self.scene);
        }
        if let Some(request) = &output.rebind {
            self.rebinds += 1;
            self.agent.ask(now_ns, request, &self.scene);
        }
        self.queries.extend(output.trace);
        self.events.extend(output.event);
        output
    }

    fn verdict(&mut self) -> Option<VerifierReport> {
        let now_ns = self.world.now_ns();
        self.done_since_ns = match self.done_since_ns {
            _ if !self.scene.is_done(&self.world) => None,
            None => Some(now_ns),
            since => since,
        };
        let done = self
            .done_since_ns
            .is_some_and(|since| now_ns - since >= self.verdict_delay_ns);
        let verdict = match self.verifier {
            Verifier::Absent => return None,
            Verifier::Successes if !done => return None,
            _ if done => Verdict::Success,
            _ => Verdict::Fail,
        };
        self.verdicts += 1;
        Some(VerifierReport {
            sequence: self.verdicts,
            stamp_ns: self.world.now_ns(),
            subtask: 0,
            verdict: verdict.code(),
            reserved: [0; 3],
        })
    }

    /// Runs until the task is done and the hand is free of it, at most
    /// `steps` policy steps of time. True if it was done.
    pub fn run(&mut self, steps: u64) -> bool {
        self.run_until(steps, |s| s.scene.is_done(&s.world))
    }

    /// Runs until `done`, at most `steps` policy steps of time.
    pub fn run_until(&mut self, steps: u64, mut done: impl FnMut(&Self) -> bool) -> bool {
        let end_ns = self.world.now_ns() + steps * 50_000_000;
        while self.world.now_ns() < end_ns {
            let output = self.tick();
            assert_ne!(output.command.mode(), None, "a known mode");
            if done(self) {
                return true;
            }
            if output.command.mode() == Some(Mode::Stop) {
                return false;
            }
        }
        false
    }
}
