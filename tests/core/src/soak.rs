//! The core against the model ([`crate::model`]): the same ticks of the swarm
//! for both, compared after each.

use std::fmt;

use fitmac_core::{
    Controller, State, evidence,
    intake::Refusal,
    message::Output,
    reason,
    wire::{Diagnosis, Mode, Phase, Route, SubPhase},
};

use crate::{
    model::{
        Model,
        view::{Difference, of_core},
    },
    swarm::Swarm,
};

/// Ticks of one seed.
pub const TICKS: u64 = 2000;

/// The two disagree.
#[derive(Clone, Debug)]
pub struct Disagreement {
    /// The run.
    pub seed: u64,
    /// The tick, from 0.
    pub tick: u64,
    /// What differs.
    pub differences: Vec<Difference>,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "seed {}, tick {}: core and model differ",
            self.seed, self.tick
        )?;
        for d in &self.differences {
            writeln!(f, "  {}: core {:?}, model {:?}", d.name, d.core, d.model)?;
        }
        Ok(())
    }
}

/// What a run went through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// Ticks.
    pub ticks: u64,
    /// Queries.
    pub queries: u64,
    /// Queries in which a recovery acted.
    pub corrections: u64,
    /// Rebind requests.
    pub rebinds: u64,
    /// Values that were compared.
    pub values: u64,
    /// What occurred at least once.
    pub reached: Reached,
}

/// What occurred at least once: a bit for each member of a vocabulary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reached {
    phases: u64,
    steps: u64,
    routes: u64,
    modes: u64,
    diagnoses: u64,
    refusals: u64,
    evidence: u64,
    reasons: u64,
}

impl Reached {
    fn note(&mut self, output: &Output, state: &State) {
        let c = &output.command;
        self.phases |= 1 << c.phase;
        self.steps |= 1 << c.sub_phase;
        self.routes |= 1 << c.route;
        self.modes |= 1 << c.mode;
        let d = state.decision();
        self.diagnoses |= 1 << d.diagnosis.code();
        self.evidence |= d.evidence;
        self.reasons |= c.reasons | d.reasons;
        for (refusal, n) in state.refusals().iter() {
            self.refusals |= u64::from(n > 0) << refusal.code();
        }
    }

    const fn add(&mut self, other: &Self) {
        self.phases |= other.phases;
        self.steps |= other.steps;
        self.routes |= other.routes;
        self.modes |= other.modes;
        self.diagnoses |= other.diagnoses;
        self.refusals |= other.refusals;
        self.evidence |= other.evidence;
        self.reasons |= other.reasons;
    }

    /// What never occurred, by name.
    #[must_use]
    pub fn missing(&self) -> Vec<&'static str> {
        let mut missing = Vec::new();
        let mut look = |mask: u64, code: u64, name| {
            if mask >> code & 1 == 0 {
                missing.push(name);
            }
        };
        Phase::ALL
            .iter()
            .for_each(|m| look(self.phases, m.code().into(), m.name()));
        SubPhase::ALL
            .iter()
            .for_each(|m| look(self.steps, m.code().into(), m.name()));
        Route::ALL
            .iter()
            .for_each(|m| look(self.routes, m.code().into(), m.name()));
        Mode::ALL
            .iter()
            .for_each(|m| look(self.modes, m.code().into(), m.name()));
        Diagnosis::ALL
            .iter()
            .for_each(|m| look(self.diagnoses, m.code().into(), m.name()));
        Refusal::ALL
            .iter()
            .for_each(|m| look(self.refusals, m.code().into(), m.name()));
        for (mask, all) in [(self.evidence, evidence::ALL), (self.reasons, reason::ALL)] {
            all.iter()
                .for_each(|(bit, name)| look(mask, bit.trailing_zeros().into(), name));
        }
        missing
    }
}

impl Seen {
    /// Adds what another run went through.
    pub const fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.queries += other.queries;
        self.corrections += other.corrections;
        self.rebinds += other.rebinds;
        self.values += other.values;
        self.reached.add(&other.reached);
    }
}

/// Runs one seed; `spoil` may alter what the core answers (a test of the
/// comparison itself).
///
/// # Errors
/// The first tick after which the two differ.
pub fn run_spoilt(
    seed: u64,
    ticks: u64,
    mut spoil: impl FnMut(u64, &mut Output),
) -> Result<Seen, Disagreement> {
    let mut swarm = Swarm::new(seed);
    let mut controller = Controller::new(swarm.params);
    let mut model = Model::new(&swarm.params);
    let mut seen = Seen::default();
    for tick in 0..ticks {
        let told = swarm.tick();
        let mut output = controller.tick(told.now_ns, &told.input());
        spoil(tick, &mut output);
        let core = of_core(&output, &controller);
        let differences = core.differences(&model.tick(&told, &output));
        if !differences.is_empty() {
            return Err(Disagreement {
                seed,
                tick,
                differences,
            });
        }
        swarm.hear(&output);
        seen.ticks += 1;
        seen.queries += u64::from(output.trace.is_some());
        seen.corrections += u64::from(output.trace.is_some_and(|t| t.sub_phase != 0));
        seen.rebinds += u64::from(output.rebind.is_some());
        seen.values += core.len() as u64;
        seen.reached.note(&output, controller.state());
    }
    Ok(seen)
}

/// Runs one seed.
///
/// # Errors
/// The first tick after which the two differ.
pub fn run(seed: u64, ticks: u64) -> Result<Seen, Disagreement> {
    run_spoilt(seed, ticks, |_, _| {})
}
