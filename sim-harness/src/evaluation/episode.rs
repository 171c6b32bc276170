//! One episode: set up from its description, played, judged, written down.

use super::config::{Knowledge, params_for};
use super::corrections::Corrections;
use super::grid::EpisodeSpec;
use super::record::{EpisodeRecord, SCHEMA, build_of};
use super::witness::{Controlled, Witness};
use crate::agents::{Agents, OracleAgents};
use crate::alone::{Alone, AloneSetup, SETTLE_STEPS};
use crate::backbone::Registry;
use crate::error::SimError;
use crate::grounding::RuleAgents;
use crate::lockstep::{Lockstep, Outcome, Setup, Ticked};
use crate::object::{ObjectClass, ObjectKind, Shape};
use crate::panda::GRIPPER_OPEN_M;
use crate::perturb::{Instance, instance};
use crate::predicate::Goal;
use crate::sim::Sim;
use crate::suite::Suite;

/// Room that a grasp needs on both sides together, m.
const GRASP_ROOM_M: f64 = 0.002;

/// A point in an episode that is worth a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// The start, after the scene has settled.
    Before,
    /// The onset of the policy's failure, or the first correction.
    Failure,
    /// Every tenth step of corrections: keep the one in the middle.
    Recovery,
    /// The end.
    End,
}

/// Follows an episode. What it does changes nothing.
pub trait Watch {
    /// After each physics step; the policy alone has neither command nor trace.
    fn tick(&mut self, world: &mut Sim, ticked: &Ticked);
    /// At a moment that is worth a picture, with the policy step.
    fn moment(&mut self, world: &mut Sim, step: u64, moment: Moment);
}

/// Nobody watches.
struct Nobody;

impl Watch for Nobody {
    fn tick(&mut self, _: &mut Sim, _: &Ticked) {}
    fn moment(&mut self, _: &mut Sim, _: u64, _: Moment) {}
}

/// Plays an episode.
///
/// # Errors
/// If a name does not resolve, a level cannot be realised, or the physics fails.
pub fn play(spec: &EpisodeSpec) -> Result<EpisodeRecord, SimError> {
    play_watched(spec, &mut Nobody)
}

/// What an episode starts from.
pub(super) fn made(suite: &Suite, spec: &EpisodeSpec) -> Result<Instance, SimError> {
    let task = &suite.tasks[suite.task_index(&spec.task)?];
    instance(suite, task, spec.perturbation, spec.level, spec.draw_seed())
}

/// Plays an episode before an audience.
///
/// # Errors
/// As for [`play`].
pub fn play_watched(spec: &EpisodeSpec, watch: &mut dyn Watch) -> Result<EpisodeRecord, SimError> {
    let suite = Suite::open(&spec.suite)?;
    let registry = Registry::embedded()?;
    let made = made(&suite, spec)?;
    let episode = Episode {
        spec,
        suite: &suite,
        registry: &registry,
        draw: spec.draw_seed(),
        max_steps: u64::from(suite.max_steps) + SETTLE_STEPS,
    };
    let graspable = made
        .scene
        .by_id(made.goal.object())
        .is_some_and(|o| fits(&o.kind));
    let drawn = made.drawn.clone();
    let played = if spec.config.is_base() {
        episode.alone(made, watch)?
    } else {
        episode.controlled(made, watch)?
    };
    let Played {
        success,
        corrections,
        witness,
        steps,
        rebinds,
        sim,
    } = played;
    let controlled = Controlled {
        correcting: corrections.running(),
        refused: corrections.first_failure_step().is_some() && corrections.parts().is_empty(),
    };
    let mut parts = corrections.clone();
    parts.finish();
    Ok(EpisodeRecord {
        schema: SCHEMA,
        core: build_of(&suite),
        suite: spec.suite.clone(),
        task_index: u32::try_from(suite.task_index(&spec.task)?).unwrap_or(u32::MAX),
        task: spec.task.clone(),
        perturbation: spec.perturbation.name().to_owned(),
        level: spec.level.label(),
        backbone: spec.backbone.clone(),
        backbone_hash: registry.fingerprint(&spec.backbone)?,
        config: spec.config.name().to_owned(),
        profile: spec.profile.name().to_owned(),
        perception: spec.vision.name().to_owned(),
        knowledge: spec.knowledge.name().to_owned(),
        seed: spec.seed,
        episode: spec.episode,
        success,
        intervened: !parts.parts().is_empty(),
        activations: parts.parts().to_vec(),
        onset_step: witness.onset(),
        first_failure_step: parts.first_failure_step(),
        first_intervention_step: parts.first_step(),
        steps,
        sim_seconds: rounded(sim.time_s()),
        failure: (!success).then(|| witness.classify(&sim, controlled)),
        gate_reasons: parts.gate_reasons(),
        rebinds,
        graspable,
        end_distance_m: rounded(witness.distance_m(&sim)),
        drawn,
    })
}

/// An episode before its first step.
struct Episode<'a> {
    spec: &'a EpisodeSpec,
    suite: &'a Suite,
    registry: &'a Registry,
    draw: u64,
    max_steps: u64,
}

/// An episode after its last step.
struct Played {
    success: bool,
    corrections: Corrections,
    witness: Witness,
    steps: u64,
    rebinds: u32,
    sim: Sim,
}

impl Episode<'_> {
    fn alone(&self, made: Instance, watch: &mut dyn Watch) -> Result<Played, SimError> {
        let mut alone = Alone::new(AloneSetup {
            sim: Sim::new(made.scene)?,
            goal: made.goal,
            instruction: made.instruction,
            backbone: self.registry.build(&self.spec.backbone, self.suite)?,
            open_loop: self.registry.open_loop(&self.spec.backbone)?,
            seed: self.draw,
            max_steps: self.max_steps,
        });
        let mut log = Log::new(made.goal, alone.sim());
        while alone.outcome().is_none() {
            let action = alone.step()?;
            let step = alone.policy_step();
            let ticked = Ticked {
                acted: action.is_some(),
                ..Ticked::default()
            };
            if let Some(action) = action {
                let moment = log.step(alone.sim(), step, action[6] > 0.0);
                tell(watch, alone.sim_mut(), step, moment);
            }
            watch.tick(alone.sim_mut(), &ticked);
        }
        let step = alone.policy_step();
        watch.moment(alone.sim_mut(), step, Moment::End);
        Ok(Played {
            success: alone.outcome() == Some(Outcome::Success),
            corrections: log.corrections,
            witness: log.witness,
            steps: step,
            rebinds: 0,
            sim: alone.into_sim(),
        })
    }

    fn controlled(&self, made: Instance, watch: &mut dyn Watch) -> Result<Played, SimError> {
        let spec = self.spec;
        let open_loop = self.registry.open_loop(&spec.backbone)?;
        let params = params_for(&spec.config, spec.profile, open_loop)?;
        let mut lockstep = Lockstep::new(Setup {
            sim: Sim::new(made.scene)?,
            goal: made.goal,
            instruction: made.instruction,
            backbone: self.registry.build(&self.spec.backbone, self.suite)?,
            agents: agents(spec.knowledge, made.goal),
            params,
            pose_source: spec.vision.source()?,
            seed: self.draw,
            max_steps: self.max_steps,
        });
        let mut log = Log::new(made.goal, lockstep.sim());
        while lockstep.outcome().is_none() {
            let ticked = lockstep.step()?;
            let step = lockstep.policy_step();
            log.corrections.note(&ticked);
            if let Some(command) = ticked.command.filter(|_| ticked.acted) {
                let moment = log.step(lockstep.sim(), step, command.action[6] > 0.0);
                tell(watch, lockstep.sim_mut(), step, moment);
            }
            watch.tick(lockstep.sim_mut(), &ticked);
        }
        let step = lockstep.policy_step();
        watch.moment(lockstep.sim_mut(), step, Moment::End);
        Ok(Played {
            success: lockstep.outcome() == Some(Outcome::Success),
            corrections: log.corrections,
            witness: log.witness,
            steps: step,
            rebinds: lockstep.controller().state().episode().rebinds(),
            sim: lockstep.into_sim(),
        })
    }
}

fn agents(knowledge: Knowledge, goal: Goal) -> Box<dyn Agents> {
    match knowledge {
        Knowledge::Agents => Box::new(RuleAgents::new()),
        Knowledge::Simulator => Box::new(OracleAgents::new(goal)),
    }
}

fn tell(watch: &mut dyn Watch, world: &mut Sim, step: u64, moment: Option<Moment>) {
    if let Some(moment) = moment {
        watch.moment(world, step, moment);
    }
}

/// What is noted while an episode runs.
struct Log {
    corrections: Corrections,
    witness: Witness,
    correction_steps: u64,
}

impl Log {
    fn new(goal: Goal, sim: &Sim) -> Self {
        Self {
            corrections: Corrections::default(),
            witness: Witness::new(goal, sim),
            correction_steps: 0,
        }
    }

    /// Takes the start of a policy step in; says if it is worth a picture.
    fn step(&mut self, sim: &Sim, step: u64, closing: bool) -> Option<Moment> {
        let corrects = self.corrections.running();
        self.correction_steps += u64::from(corrects);
        let by_policy = self.corrections.parts().is_empty();
        let failed = self.witness.look(sim, step, closing, by_policy);
        if step == SETTLE_STEPS + 1 {
            return Some(Moment::Before);
        }
        if failed || (corrects && self.correction_steps == 1) {
            return Some(Moment::Failure);
        }
        (corrects && self.correction_steps.is_multiple_of(10)).then_some(Moment::Recovery)
    }
}

/// Whether an object can be taken between the fingers at all.
fn fits(kind: &ObjectKind) -> bool {
    let [x, y, _] = kind.half_extent_m();
    match (kind.class, &kind.shape) {
        (ObjectClass::Bowl, Shape::Bowl { wall_m, .. }) => *wall_m < GRIPPER_OPEN_M,
        (_, Shape::Bottle { neck_radius_m, .. }) => 2.0 * neck_radius_m < GRIPPER_OPEN_M,
        _ => 2.0 * x.min(y) <= GRIPPER_OPEN_M - GRASP_ROOM_M,
    }
}

/// To tenths of a millimetre or millisecond: more says nothing.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
