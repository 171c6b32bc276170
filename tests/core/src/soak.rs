//! The core against the model ([`crate::model`]): the same ticks of the swarm
//! for both, compared after each.

use std::fmt;

use fitmac_core::{
    Controller, State, evidence,
    intake::Refusal,
    message::{Output, StateSample},
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
    /// Runs that a tie has cut short.
    pub ties: u64,
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
        self.ties += other.ties;
        self.reached.add(&other.reached);
    }
}

/// Runs one seed.
///
/// # Errors
/// As for [`run_spoilt`].
pub fn run(seed: u64, ticks: u64) -> Result<Seen, Disagreement> {
    run_spoilt(seed, ticks, || |_, _: &mut Output| {})
}

/// Runs one seed; what `spoil` makes may alter what the core answers (a test
/// of the comparison itself).
///
/// Where a measure lies on a limit to within rounding, core and model may fall
/// on different sides of it, for they round differently, and part for good: a
/// tie. The run then ends, and counts in [`Seen::ties`].
///
/// # Errors
/// The first tick after which the two differ, and not because of a tie.
pub fn run_spoilt<S: FnMut(u64, &mut Output)>(
    seed: u64,
    ticks: u64,
    spoil: impl Fn() -> S,
) -> Result<Seen, Disagreement> {
    let (seen, differs) = play(seed, ticks, None, spoil());
    let Some(disagreement) = differs else {
        return Ok(seen);
    };
    // Whether the model, told of positions that differ by rounding in the last
    // ticks, answers as the core did in every tick up to this one. In the last
    // ones only: a run may pass several ties, and fall to either side of each.
    let agrees = |n| {
        let tick = disagreement.tick;
        let nudge = Nudge {
            n,
            from: tick.saturating_sub(n % NUDGED_TICKS),
        };
        play(seed, tick + 1, Some(nudge), spoil()).1.is_none()
    };
    if (0..NUDGES).any(agrees) {
        return Ok(Seen { ties: 1, ..seen });
    }
    Err(disagreement)
}

/// Nudges that are tried.
const NUDGES: u64 = 64;
/// How much positions are moved: by this share, and by this many metres.
const NUDGE: f64 = 1e-12;

/// Most ticks before a disagreement in which positions are nudged.
const NUDGED_TICKS: u64 = 4;

/// Moves positions by less than anything but rounding can tell; always the
/// same one by as much, so that what repeats still repeats.
#[derive(Clone, Copy, Debug)]
struct Nudge {
    n: u64,
    from: u64,
}

impl Nudge {
    fn apply(self, state: &mut StateSample) {
        let objects = state.objects.iter_mut();
        let positions = objects.map(|o| (u64::from(o.id) + 1, &mut o.position_m));
        for (whose, position_m) in positions.chain([(0, &mut state.ee_position_m)]) {
            for (x, axis) in position_m.iter_mut().zip(0..) {
                let which = (self.n << 20) + (whose << 2) + axis;
                *x += NUDGE * (drawn(2 * which) * *x + drawn(2 * which + 1));
            }
        }
        state.gripper_width_m *= 1.0 + NUDGE * drawn(self.n << 20 | 3);
    }
}

/// A number in [-1, 1), always the same one for the same `n` (splitmix64).
fn drawn(n: u64) -> f64 {
    let mut z = n.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Runs one seed, the model with its positions nudged; up to the first tick
/// after which the two differ.
fn play(
    seed: u64,
    ticks: u64,
    nudge: Option<Nudge>,
    mut spoil: impl FnMut(u64, &mut Output),
) -> (Seen, Option<Disagreement>) {
    let mut swarm = Swarm::new(seed);
    let mut controller = Controller::new(swarm.params);
    let mut model = Model::new(&swarm.params);
    let mut seen = Seen::default();
    for tick in 0..ticks {
        let mut told = swarm.tick();
        let mut output = controller.tick(told.now_ns, &told.input());
        spoil(tick, &mut output);
        let core = of_core(&output, &controller);
        if let (Some(nudge), Some(state)) = (nudge, &mut told.state)
            && tick >= nudge.from
        {
            nudge.apply(state);
        }
        let differences = core.differences(&model.tick(&told, &output));
        if !differences.is_empty() {
            let disagreement = Disagreement {
                seed,
                tick,
                differences,
            };
            return (seen, Some(disagreement));
        }
        swarm.hear(&output);
        seen.ticks += 1;
        seen.queries += u64::from(output.trace.is_some());
        seen.corrections += u64::from(output.trace.is_some_and(|t| t.sub_phase != 0));
        seen.rebinds += u64::from(output.rebind.is_some());
        seen.values += core.len() as u64;
        seen.reached.note(&output, controller.state());
    }
    (seen, None)
}
