//! Execution correction (section 3.5 and appendix C.2): takes the arm for a
//! bounded pick or place, and hands it back.
//!
//! Every correction ends: each query costs one unit of a budget that never
//! grows while the correction runs.

mod active;
mod edges;
pub mod geometry;
mod pick;
mod place;
mod scene;
mod stuck;
pub mod waypoint;

pub use edges::{EDGES, is_legal};
pub use scene::Scene;

use kinematics::vector::Vector3;

use crate::{gate::Routine, message::Action, params::RecoveryParams, reason, wire::SubPhase};
use active::{Active, Running};

/// What a query of the correction gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// An action, and the waypoint behind it.
    Act {
        /// The action.
        action: Action,
        /// The waypoint, base frame, m.
        waypoint_m: Option<Vector3>,
    },
    /// No action (the paper's bottom): the correction has ended, the base
    /// policy acts; the bits of [`reason`] say why.
    Bottom(u64),
}

/// The correction state R of Algorithm 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovery {
    active: Option<Active>,
    activations: u32,
    /// Policy steps since the last hand-back.
    handed_back: Option<u32>,
}

impl Recovery {
    pub(crate) const fn new() -> Self {
        Self {
            active: None,
            activations: 0,
            handed_back: None,
        }
    }

    /// True while a correction is pending.
    #[must_use]
    pub const fn is_pending(&self) -> bool {
        self.active.is_some()
    }

    /// True while a place is pending, up to its end.
    #[must_use]
    pub const fn is_placing(&self) -> bool {
        match &self.active {
            Some(active) => matches!(active.running(), Running::Place(_)),
            None => false,
        }
    }

    /// Corrections started in this subtask.
    #[must_use]
    pub const fn activations(&self) -> u32 {
        self.activations
    }

    /// Policy steps since the last hand-back, if there was one.
    #[must_use]
    pub const fn since_hand_back(&self) -> Option<u32> {
        self.handed_back
    }

    /// Queries left to the running correction.
    #[must_use]
    pub fn budget(&self) -> u32 {
        self.active.as_ref().map_or(0, Active::budget)
    }

    /// Re-descents left to the running correction.
    #[must_use]
    pub fn redescents(&self) -> u32 {
        match self.active.as_ref().map(Active::running) {
            Some(Running::Pick(pick)) => pick.redescents_left(),
            Some(Running::Place(_)) | None => 0,
        }
    }

    /// The running correction's step.
    #[must_use]
    pub fn sub_phase(&self) -> SubPhase {
        self.active
            .as_ref()
            .map_or(SubPhase::Idle, |a| a.running().sub_phase())
    }

    /// A policy step went by.
    pub(crate) fn count_step(&mut self) {
        self.handed_back = self.handed_back.map(|n| n.saturating_add(1));
    }

    /// Starts a correction; at most `episode_left` queries.
    pub(crate) fn start(&mut self, scene: &Scene<'_>, routine: Routine, episode_left: u32) {
        self.activations = self.activations.saturating_add(1);
        self.active = Some(Active::begin(scene, routine, episode_left));
    }

    /// Ends a running correction without an action.
    pub(crate) fn cancel(&mut self) {
        if self.active.take().is_some() {
            self.handed_back = Some(0);
        }
    }

    /// One query of the running correction.
    pub(crate) fn step(&mut self, scene: &Scene<'_>) -> Step {
        let step = match &mut self.active {
            None => Step::Bottom(reason::NO_ACTION),
            Some(active) => active.step(scene),
        };
        if let Step::Bottom(_) = step {
            self.cancel();
        }
        step
    }
}

/// Whether the episode's recovery budget has queries left.
#[must_use]
pub const fn episode_left(params: &RecoveryParams, used: u32) -> u32 {
    params.episode_budget.saturating_sub(used)
}
