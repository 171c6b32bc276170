//! Domain-shaped random input for the core: an episode in the toy world with
//! faults, drawn from one seed.
//!
//! A uniform random number almost never satisfies a guard. So every run is a
//! closed loop that gets somewhere, and a random subset of faults disturbs it:
//! lost, repeated, late and broken messages, objects that vanish, jump or slip,
//! clocks that leap, operators that stop and reset. The parameters are drawn
//! too, around the two profiles.

mod corrupt;
mod draw;
mod run;
mod seen;
mod watch;

pub use run::{Controls, Failure, Run, Summary, sweep};
pub use seen::{Glimpse, Seen};
pub use watch::{Broken, Watch};

use fitmac_core::{
    message::{
        ActionChunk, CriticReport, GroundingRecord, Input, Output, Plan, StateSample,
        VerifierReport,
    },
    params::ValidParams,
    wire::{Mode, Request, Verdict},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::world::{Agent, Policy, Scene, World};
use draw::Rates;

/// How long policy and agents take to answer once the faults are over, ns.
const ANSWER_NS: u64 = 5_000_000;

/// What the controller is told in one tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// The time, ns.
    pub now_ns: u64,
    /// The robot's state.
    pub state: Option<StateSample>,
    /// A chunk.
    pub chunk: Option<ActionChunk>,
    /// A grounding record.
    pub grounding: Option<GroundingRecord>,
    /// A plan.
    pub plan: Option<Plan>,
    /// The verifier's word.
    pub verifier: Option<VerifierReport>,
    /// The critic's word.
    pub critic: Option<CriticReport>,
    /// The operator's request.
    pub request: u8,
}

impl Told {
    /// The same as the core takes it.
    #[must_use]
    pub fn input(&self) -> Input<'_> {
        Input {
            state: self.state.as_ref(),
            chunk: self.chunk.as_ref(),
            grounding: self.grounding.as_ref(),
            plan: self.plan.as_ref(),
            verifier: self.verifier.as_ref(),
            critic: self.critic.as_ref(),
            request: self.request,
        }
    }

    /// Moves every stamp by `shift_ns`, wrapping: from the world's clock to the
    /// controller's.
    pub fn shift(&mut self, shift_ns: u64) {
        let moved = |t: u64| t.wrapping_add(shift_ns);
        if let Some(state) = &mut self.state {
            state.stamp_ns = moved(state.stamp_ns);
            for object in &mut state.objects {
                object.stamp_ns = moved(object.stamp_ns);
            }
        }
        if let Some(chunk) = &mut self.chunk {
            chunk.observation_ns = moved(chunk.observation_ns);
            chunk.stamp_ns = moved(chunk.stamp_ns);
        }
        if let Some(record) = &mut self.grounding {
            record.stamp_ns = moved(record.stamp_ns);
        }
    }
}

/// A source of ticks.
#[derive(Debug)]
pub struct Swarm {
    /// Parameters of the controller under test.
    pub params: ValidParams,
    rng: ChaCha8Rng,
    rates: Rates,
    scene: Scene,
    world: World,
    policy: Policy,
    agent: Agent,
    tick_ns: u64,
    now_ns: u64,
    subtasks: u32,
    last: Told,
    verdicts: u64,
    critics: u64,
    frozen_for: u32,
    deaf_for: u32,
    stopped_for: u32,
    plan_sent: bool,
}

impl Swarm {
    /// The run that `seed` names.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let params = draw::params(&mut rng);
        let rates = Rates::draw(&mut rng);
        let scene = draw::scene(&mut rng, params.get().clock.step_ms);
        let policy = draw::policy(&mut rng, params.get());
        let agent = draw::agent(&mut rng, &scene);
        let tick_ns = draw::tick_ns(&mut rng, params.get().clock.step_ms);
        let subtasks = if rng.random_bool(0.3) { 2 } else { 1 };
        Self {
            params,
            rates,
            world: scene.world.clone(),
            scene,
            policy,
            agent,
            tick_ns,
            now_ns: 1_000_000_000,
            subtasks,
            last: Told::default(),
            verdicts: 0,
            critics: 0,
            frozen_for: 0,
            deaf_for: 0,
            stopped_for: 0,
            plan_sent: false,
            rng,
        }
    }

    /// The world as it is.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// Ends all faults: messages arrive whole and in time, everything is seen,
    /// and who is asked answers soon and honestly. What the policy is able to
    /// do stays as it is.
    pub fn calm(&mut self) {
        self.rates = Rates::default();
        self.world.hidden.clear();
        self.world.plant.drop_above_m = None;
        (self.frozen_for, self.deaf_for, self.stopped_for) = (0, 0, 0);
        self.policy.delay_ns = self.policy.delay_ns.min(ANSWER_NS);
        self.agent.answers = Agent::knowing(&self.scene).answers;
        self.agent.delay_ns = ANSWER_NS;
    }

    fn hits(&mut self, rate: f64) -> bool {
        rate > 0.0 && self.rng.random_bool(rate)
    }

    /// The next tick.
    pub fn tick(&mut self) -> Told {
        self.pass_time();
        self.disturb_world();
        let mut told = Told {
            now_ns: self.now_ns,
            state: self.state(),
            chunk: self.policy.poll(self.world.now_ns()),
            grounding: self.agent.poll(self.world.now_ns()),
            plan: self.plan(),
            verifier: self.verifier(),
            critic: self.critic(),
            request: self.request(),
        };
        // The world's clock and the controller's part when time runs backwards.
        told.shift(self.now_ns.wrapping_sub(self.world.now_ns()));
        self.corrupt(&mut told);
        self.lose_and_repeat(&mut told);
        told
    }

    /// What the controller answered.
    pub fn hear(&mut self, output: &Output) {
        if self.deaf_for == 0 {
            self.world.apply(&output.command);
        }
        if let Some(query) = &output.query {
            self.policy.ask(query, &self.world, &self.scene);
        }
        if let Some(request) = &output.rebind {
            self.agent.ask(self.world.now_ns(), request, &self.scene);
        }
        self.stopped_for = if output.command.mode() == Some(Mode::Stop) {
            self.stopped_for + 1
        } else {
            0
        };
    }

    fn pass_time(&mut self) {
        let (gap, back, twice, leap) = (
            self.rates.gap,
            self.rates.backwards,
            self.rates.same_time,
            self.rates.leap,
        );
        let mut dt_ns = self.tick_ns;
        if self.hits(twice) {
            dt_ns = 0;
        } else if self.hits(gap) {
            dt_ns = self.rng.random_range(10_000_000..200_000_000);
        } else if self.hits(leap) {
            dt_ns = 600_000_000;
        }
        if self.hits(back) {
            self.now_ns -= self.rng.random_range(0..20_000_000).min(self.now_ns);
        } else {
            self.now_ns += dt_ns;
        }
        self.world.advance(dt_ns);
    }

    fn disturb_world(&mut self) {
        let r = self.rates.clone();
        if self.hits(r.hide) {
            let id = draw::thing(&mut self.rng, &self.world);
            self.world.hidden.push(id);
        }
        if self.hits(r.show) {
            self.world.hidden.clear();
        }
        if self.hits(r.push) {
            let id = draw::thing(&mut self.rng, &self.world);
            let by = draw::xy(&mut self.rng, 0.15);
            if id != self.world.held()
                && let Some(body) = self.world.body_mut(id)
            {
                body.position_m[0] += by[0];
                body.position_m[1] += by[1];
            }
        }
        if self.hits(r.slip) && self.world.held() != 0 {
            self.world.plant.drop_above_m = Some(0.1);
        }
        if self.hits(r.weak_grasp) {
            self.world.plant.weak_grasps += 1;
        }
        if self.hits(r.deaf) {
            self.deaf_for = self.rng.random_range(1..400);
        }
        self.deaf_for = self.deaf_for.saturating_sub(1);
        if self.hits(r.restart_policy) {
            self.policy.restart();
        }
        if self.hits(r.new_behaviour) {
            self.policy.behaviour = draw::behaviour(&mut self.rng);
        }
        if self.hits(r.volunteer) {
            let id = draw::thing(&mut self.rng, &self.world);
            let now_ns = self.world.now_ns();
            self.agent.volunteer(now_ns, id, &self.scene);
        }
        if self.hits(r.other_kappa) {
            let now_ns = self.world.now_ns();
            let kappa = draw::kappa(&mut self.rng);
            self.agent.observe_again(now_ns, kappa);
        }
    }

    fn state(&mut self) -> Option<StateSample> {
        if self.hits(self.rates.freeze_state) {
            self.frozen_for = self.rng.random_range(1..60);
        }
        self.frozen_for = self.frozen_for.saturating_sub(1);
        if self.frozen_for > 0 || self.hits(self.rates.lose_state) {
            return None;
        }
        let mut sample = self.world.sample();
        if self.rates.pose_noise_m > 0.0 {
            let sigma = self.rates.pose_noise_m;
            for object in sample.objects.iter_mut().take(sample.object_count as usize) {
                for x in &mut object.position_m {
                    *x += sigma * draw::gauss(&mut self.rng);
                }
            }
        }
        Some(sample)
    }

    fn plan(&mut self) -> Option<Plan> {
        let again = self.hits(self.rates.new_plan);
        if self.plan_sent && !again {
            return None;
        }
        self.plan_sent = true;
        Some(Plan {
            id: u64::from(again) + 1,
            subtask_count: self.subtasks,
            confidence_permille: draw::plan_confidence(&mut self.rng),
        })
    }

    fn verifier(&mut self) -> Option<VerifierReport> {
        let lies = self.hits(self.rates.verifier_lies);
        let reports = self.hits(self.rates.verifier);
        if !lies && !reports {
            return None;
        }
        self.verdicts += 1;
        let honest = if self.scene.is_done(&self.world) {
            Verdict::Success
        } else {
            Verdict::Fail
        };
        let verdict = if lies {
            self.rng.random_range(0..5)
        } else {
            honest.code()
        };
        Some(VerifierReport {
            sequence: self.verdicts,
            stamp_ns: self.now_ns,
            subtask: self.rng.random_range(0..self.subtasks),
            verdict,
            reserved: [0; 3],
        })
    }

    fn critic(&mut self) -> Option<CriticReport> {
        if !self.hits(self.rates.critic) {
            return None;
        }
        self.critics += 1;
        Some(CriticReport {
            sequence: self.critics,
            stamp_ns: self.now_ns,
            subtask: self.rng.random_range(0..self.subtasks),
            label: self.rng.random_range(0..6),
            reserved: [0; 3],
            confidence: draw::kappa(&mut self.rng),
        })
    }

    fn request(&mut self) -> u8 {
        let over = self.hits(if self.scene.is_done(&self.world) {
            self.rates.episode_ends_done
        } else {
            self.rates.episode_ends
        });
        let stopped = self.stopped_for > 20 && self.rates.episode_ends > 0.0;
        if over || stopped || self.hits(self.rates.reset) {
            self.stopped_for = 0;
            self.begin_again();
            return Request::Reset.code();
        }
        if self.hits(self.rates.stop) {
            return Request::Stop.code();
        }
        if self.hits(self.rates.unknown_request) {
            return self.rng.random_range(3..=255);
        }
        0
    }

    /// Things stand as they stood at the start; time goes on.
    fn begin_again(&mut self) {
        let mut fresh = self.scene.world.clone();
        fresh.go_on_from(&self.world);
        self.world = fresh;
        self.policy.behaviour = draw::behaviour(&mut self.rng);
        self.agent.answers = draw::answers(&mut self.rng, &self.scene);
    }

    fn corrupt(&mut self, told: &mut Told) {
        let r = self.rates.clone();
        if let Some(state) = &mut told.state
            && r.bad_state > 0.0
            && self.rng.random_bool(r.bad_state)
        {
            corrupt::state(&mut self.rng, state);
        }
        if let Some(chunk) = &mut told.chunk
            && r.bad_chunk > 0.0
            && self.rng.random_bool(r.bad_chunk)
        {
            corrupt::chunk(&mut self.rng, chunk);
        }
        if let Some(record) = &mut told.grounding
            && r.bad_grounding > 0.0
            && self.rng.random_bool(r.bad_grounding)
        {
            corrupt::grounding(&mut self.rng, record);
        }
        if let Some(plan) = &mut told.plan
            && r.bad_plan > 0.0
            && self.rng.random_bool(r.bad_plan)
        {
            plan.subtask_count = self.rng.random_range(0..20);
            plan.confidence_permille = self.rng.random_range(0..2000);
        }
    }

    fn lose_and_repeat(&mut self, told: &mut Told) {
        let r = self.rates.clone();
        if self.hits(r.lose_chunk) {
            told.chunk = None;
        }
        if self.hits(r.lose_grounding) {
            told.grounding = None;
        }
        if told.chunk.is_some() {
            self.last.chunk = told.chunk;
        } else if self.hits(r.repeat) {
            told.chunk = self.last.chunk;
        }
        if told.grounding.is_some() {
            self.last.grounding = told.grounding;
        } else if self.hits(r.repeat) {
            told.grounding = self.last.grounding;
        }
        if told.state.is_some() {
            self.last.state = told.state;
        } else if self.hits(r.repeat_state) {
            told.state = self.last.state;
        }
    }
}
