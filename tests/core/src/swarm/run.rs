//! One run of the swarm: a seed from its first tick to its last.

use fitmac_core::{
    Controller, State,
    message::{Command, Input, Output},
    wire::{Mode, Request, SubPhase},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Broken, Glimpse, Seen, Swarm, Watch};

/// Ticks with faults that a seed may draw.
const TICKS: core::ops::Range<u64> = 2_000..20_000;
/// Policy steps in a row, without a hold, that must be played once the faults
/// are off.
const STEPS_ALIVE: u64 = 20;
/// Time in which they must be, ns: settling, every rebind that the parameters
/// allow, and the steps, each with the policy's answer.
const ALIVE_WITHIN_NS: u64 = 15_000_000_000;

/// What is put under test: the core, or one that was spoilt on purpose.
pub trait Controls {
    /// Decides one tick.
    fn tick(&mut self, now_ns: u64, input: &Input<'_>) -> Output;
    /// What it remembers.
    fn state(&self) -> &State;
}

impl Controls for Controller {
    fn tick(&mut self, now_ns: u64, input: &Input<'_>) -> Output {
        Self::tick(self, now_ns, input)
    }

    fn state(&self) -> &State {
        Self::state(self)
    }
}

/// What a run that went well did; sums of several runs add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Runs.
    pub runs: u64,
    /// Ticks.
    pub ticks: u64,
    /// Ticks in a hold or a stop.
    pub faulty: u64,
    /// Queries.
    pub queries: u64,
    /// Queries in which a recovery acted.
    pub corrections: u64,
    /// Requests to ground anew.
    pub rebinds: u64,
    /// Longest time from the end of the faults to the end of
    /// `STEPS_ALIVE` steps, ns.
    pub alive_after_ns: u64,
    /// A hash of every command: equal runs have equal ones.
    pub fingerprint: u64,
}

impl Summary {
    fn note(&mut self, output: &Output) {
        let c = &output.command;
        self.ticks += 1;
        self.faulty += u64::from(c.mode().is_some_and(|m| m >= Mode::Hold));
        self.queries += u64::from(output.trace.is_some());
        self.corrections += u64::from(output.trace.is_some_and(|t| t.sub_phase != 0));
        self.rebinds += u64::from(output.rebind.is_some());
        let numbers = c.action.iter().chain(&c.setpoint_position_m);
        let words = numbers.map(|x| x.to_bits());
        for word in words.chain([c.reasons, c.policy_step]) {
            // FNV-1a, a word at a time.
            self.fingerprint = (self.fingerprint ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn add(&mut self, other: &Self) {
        self.runs += other.runs;
        self.ticks += other.ticks;
        self.faulty += other.faulty;
        self.queries += other.queries;
        self.corrections += other.corrections;
        self.rebinds += other.rebinds;
        self.alive_after_ns = self.alive_after_ns.max(other.alive_after_ns);
        self.fingerprint = self.fingerprint.rotate_left(1) ^ other.fingerprint;
    }
}

/// A run in which an invariant broke.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The seed that shows it again.
    pub seed: u64,
    /// The tick, from 1.
    pub tick: u64,
    /// What broke.
    pub broken: Broken,
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { seed, tick, broken } = self;
        let Broken { invariant, found } = broken;
        write!(
            f,
            "seed {seed}, tick {tick}: broken: {invariant}; found {found}\n\
             see it again: cargo xtask swarm --seed {seed} --ticks 1"
        )
    }
}

impl core::error::Error for Failure {}

/// A run in progress.
pub struct Run<C> {
    seed: u64,
    swarm: Swarm,
    core: C,
    ticks_with_faults: u64,
    watch: Watch,
    policy_step: u64,
    summary: Summary,
}

impl Run<Controller> {
    /// The run of this seed, with the real core.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self::with(seed, Controller::new)
    }
}

impl<C: Controls> Run<C> {
    /// The run of this seed with another controller.
    #[must_use]
    pub fn with(seed: u64, core: impl FnOnce(fitmac_core::ValidParams) -> C) -> Self {
        let swarm = Swarm::new(seed);
        Self {
            seed,
            core: core(swarm.params),
            swarm,
            // Other draws than those of the swarm.
            ticks_with_faults: ChaCha8Rng::seed_from_u64(!seed).random_range(TICKS),
            watch: Watch::default(),
            policy_step: 0,
            summary: Summary {
                runs: 1,
                ..Summary::default()
            },
        }
    }

    /// Runs with faults, then without: first safety, then liveness.
    ///
    /// # Errors
    /// The first invariant that breaks.
    pub fn to_end(mut self) -> Result<Summary, Failure> {
        for _ in 0..self.ticks_with_faults {
            self.one_tick(None)?;
        }
        self.swarm.calm();
        // What an operator does after a fault.
        self.one_tick(Some(Request::Reset))?;
        let begin_ns = self.swarm.world().now_ns();
        let mut steps = 0;
        while steps < STEPS_ALIVE {
            let before = self.policy_step;
            let output = self.one_tick(None)?;
            self.policy_step = output.command.policy_step;
            steps = after_tick(steps, before, &output.command);
            let passed_ns = self.swarm.world().now_ns() - begin_ns;
            self.summary.alive_after_ns = passed_ns;
            if passed_ns > ALIVE_WITHIN_NS {
                return Err(self.failure(Broken {
                    invariant: "soon after the faults are over, actions are played again",
                    found: format!("{:?}", output.command),
                }));
            }
        }
        Ok(self.summary)
    }

    fn one_tick(&mut self, demand: Option<Request>) -> Result<Output, Failure> {
        let mut told = self.swarm.tick();
        if let Some(demand) = demand {
            told.request = demand.code();
        }
        let before = Glimpse::of(self.core.state());
        let output = self.core.tick(told.now_ns, &told.input());
        self.summary.note(&output);
        let looked = self.watch.look(&Seen {
            seed: self.seed,
            params: self.swarm.params.get(),
            before: &before,
            told: &told,
            output: &output,
            after: self.core.state(),
        });
        self.swarm.hear(&output);
        looked
            .map(|()| output)
            .map_err(|broken| self.failure(broken))
    }

    fn failure(&self, broken: Broken) -> Failure {
        Failure {
            seed: self.seed,
            tick: self.summary.ticks,
            broken,
        }
    }
}

/// Steps played in a row without a hold, after this command.
fn after_tick(steps: u64, step_before: u64, command: &Command) -> u64 {
    if command.mode().is_none_or(|mode| mode >= Mode::Hold) {
        return 0;
    }
    let acts =
        command.flags & Command::FROM_POLICY != 0 || command.sub_phase != SubPhase::Idle.code();
    steps + u64::from(acts && command.policy_step != step_before)
}

/// Runs seeds from `first` on until at least `ticks` were run; shows each run
/// and the sum so far.
///
/// # Errors
/// The first seed whose run broke an invariant.
pub fn sweep(
    first: u64,
    ticks: u64,
    mut after: impl FnMut(u64, &Summary),
) -> Result<Summary, Failure> {
    let mut sum = Summary::default();
    let mut seed = first;
    while sum.ticks < ticks {
        sum.add(&Run::new(seed).to_end()?);
        after(seed, &sum);
        seed = seed.wrapping_add(1);
    }
    Ok(sum)
}
