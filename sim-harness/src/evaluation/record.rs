//! What is kept of an episode: one line of JSON.
//!
//! Every field is always there; what does not apply is `null` or empty. Steps are policy steps
//! (20 Hz), counted from the start of the episode, the ten of settling included. Nothing depends
//! on the machine, the number of workers or the time of day: the same episode gives the same
//! bytes.

use serde::{Deserialize, Serialize};

use crate::suite::Suite;

/// Version of this format. It changes when a field changes its name or meaning.
pub const SCHEMA: u32 = 1;

/// What played: the version, and the first twelve hexadecimal digits of the SHA-256 of the sources,
/// data and dependencies that decide how an episode goes (core, kinematics, agents and harness).
pub const CORE_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "+",
    env!("SIM_HARNESS_FINGERPRINT")
);

/// What plays the episodes of a suite: [`CORE_VERSION`], and the fingerprint of a suite that is not
/// built in.
pub(super) fn build_of(suite: &Suite) -> String {
    match suite.fingerprint() {
        Some(file) => format!("{CORE_VERSION}/{file}"),
        None => CORE_VERSION.to_owned(),
    }
}

macro_rules! names {
    ($(#[$meta:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $text:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum $name { $($(#[$doc])* #[serde(rename = $text)] $variant,)+ }

        impl $name {
            /// All of them, in the order of declaration.
            pub const ALL: &[Self] = &[$(Self::$variant,)+];

            /// The name in results and tables.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }
        }
    };
}

names! {
    /// How an episode failed. The first that applies, in the order of declaration: what can be
    /// seen at the end, then what the controller was doing, then how far the target came.
    Failure {
        /// The target left the table.
        OffTable = "off-table",
        /// The target reached its place, but was not let go, or not at rest, for long enough.
        NotSettled = "not-settled",
        /// Another object is in the target's place.
        WrongObject = "wrong-object",
        /// The target lies on its side.
        KnockedOver = "knocked-over",
        /// The steps ran out during a correction, or with the target in the hand.
        Timeout = "timeout",
        /// A failure was diagnosed, and the gate never let the controller act.
        GateClosed = "gate-closed",
        /// The target fell out of the hand.
        Dropped = "dropped",
        /// The target was put down elsewhere.
        MissedPlace = "missed-place",
        /// The target was touched and never lifted.
        MissedGrasp = "missed-grasp",
        /// The target was never touched.
        NeverReached = "never-reached",
    }
}

names! {
    /// What a correction was doing.
    Routine {
        /// Getting hold of the target.
        Pick = "pick",
        /// Carrying, lowering, opening.
        Place = "place",
        /// Rising clear and waiting for the object to come to rest.
        Settle = "settle",
    }
}

names! {
    /// How a part of a correction ended.
    Ending {
        /// The next part of the same correction followed.
        Continued = "continued",
        /// The correction reached its goal and handed back.
        Corrected = "corrected",
        /// Its budget was spent.
        BudgetExhausted = "budget-exhausted",
        /// A pose or waypoint was missing.
        NoAction = "no-action",
        /// The lock was no longer trusted.
        ValidityLost = "validity-lost",
        /// The phase no longer fitted.
        PhaseIncompatible = "phase-incompatible",
        /// The episode was over.
        EpisodeEnd = "episode-end",
        /// Another reason: the controller held, stopped, or was asked to look again.
        Other = "other",
    }
}

/// A stretch of policy steps in which one routine of a correction replaced the policy's actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Activation {
    /// Which correction of the episode it belongs to, from 0: a pick that goes on to a place is
    /// one correction of two or three parts.
    pub correction: u32,
    /// What was done.
    pub kind: Routine,
    /// First policy step.
    pub start_step: u64,
    /// Last policy step.
    pub end_step: u64,
    /// How it ended.
    pub outcome: Ending,
}

impl Activation {
    /// Policy steps that it took.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.end_step.saturating_sub(self.start_step) + 1
    }
}

/// An episode's description and result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeRecord {
    /// [`SCHEMA`].
    pub schema: u32,
    /// [`CORE_VERSION`]; with a suite from a file, a slash and that file's fingerprint follow.
    pub core: String,
    /// Suite: `object`, `spatial`, or a file.
    pub suite: String,
    /// Number of the task within the suite, from 0.
    pub task_index: u32,
    /// Task within the suite.
    pub task: String,
    /// What is perturbed: `none`, `task`, `pos`, `obj`, `sem` or `env`.
    pub perturbation: String,
    /// How strongly: `standard`, or a displacement or scale.
    pub level: String,
    /// Surrogate policy.
    pub backbone: String,
    /// First twelve hexadecimal digits of the SHA-256 of all surrogates' parameters.
    pub backbone_hash: String,
    /// What of the controller is on: `base`, `full`, an ablation, or one with other parameters.
    pub config: String,
    /// The controller's parameters: `guarded` or `paper`.
    pub profile: String,
    /// What the controller sees of the objects: `truth` or `modelled`.
    pub perception: String,
    /// Who grounds the instruction: `agents` (the project's own) or `simulator` (the answer).
    pub knowledge: String,
    /// Seed of the experiment.
    pub seed: u64,
    /// Number within task and seed, from 0.
    pub episode: u32,
    /// Whether the goal was reached, with the object released and at rest.
    pub success: bool,
    /// Whether at least one action of the policy was replaced (the paper's IR).
    pub intervened: bool,
    /// What corrections did, in order.
    pub activations: Vec<Activation>,
    /// Policy step at which the policy alone first did what waiting does not undo: closed on
    /// another object or on nothing, or let go of the target elsewhere; seen by the simulator.
    pub onset_step: Option<u64>,
    /// Policy step of the first diagnosis of an execution failure.
    pub first_failure_step: Option<u64>,
    /// Policy step of the first replaced action.
    pub first_intervention_step: Option<u64>,
    /// Policy steps of the episode.
    pub steps: u64,
    /// Simulated time, s.
    pub sim_seconds: f64,
    /// How it failed, if it did.
    pub failure: Option<Failure>,
    /// Why the gate stayed closed upon a diagnosed failure, each reason once, by the controller's
    /// names.
    pub gate_reasons: Vec<String>,
    /// Bindings that were committed after the first one.
    pub rebinds: u32,
    /// Whether the target fits between the fingers at all; if not, the cell has a ceiling.
    pub graspable: bool,
    /// Distance between the centres of object and destination in the end, m.
    pub end_distance_m: f64,
    /// What the perturbation drew, in words.
    pub drawn: String,
}

impl EpisodeRecord {
    /// The text that names the episode among all others, as
    /// [`EpisodeSpec::key`](super::EpisodeSpec::key).
    #[must_use]
    pub fn key(&self) -> String {
        let Self {
            config,
            profile,
            perception,
            knowledge,
            ..
        } = self;
        format!(
            "{}/{config}/{profile}/{perception}/{knowledge}",
            self.pair_key()
        )
    }

    /// What episodes have in common that are played on the same draws by the same policy, with
    /// and without the controller.
    #[must_use]
    pub fn pair_key(&self) -> String {
        let Self {
            suite,
            task,
            perturbation,
            level,
            backbone,
            seed,
            episode,
            ..
        } = self;
        format!("{suite}/{task}/{perturbation}/{level}/{backbone}/{seed}/{episode}")
    }

    /// Policy steps in which the policy's action was replaced.
    #[must_use]
    pub fn correction_steps(&self) -> u64 {
        self.activations.iter().map(Activation::steps).sum()
    }
}
