//! Everything that the controller remembers.

use crate::{
    clock::StepClock,
    decide::Episode,
    filter::{Commanded, still},
    intake::{RefusalCounts, chunk::ChunkIntake, grounding::GroundingIntake, robot::RobotIntake},
    ladder::{Applied, Ladder},
    message::Action,
    queue::ActionQueue,
    shaping::Shaper,
    subtask::Subtask,
    trace::Decision,
    turn::Turn,
    verdicts::Verdicts,
    wire::Mode,
};

/// The action that is being executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Current {
    pub(super) action: Action,
    pub(super) policy_step: u64,
    pub(super) flags: u32,
}

/// Everything that the controller remembers: a copy is a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub(super) sequence: u64,
    pub(super) clock: StepClock,
    pub(super) robot: RobotIntake,
    pub(super) chunk: ChunkIntake,
    pub(super) grounding: GroundingIntake,
    pub(super) verdicts: Verdicts,
    pub(super) refusals: RefusalCounts,
    pub(super) applied: Applied,
    pub(super) ladder: Ladder,
    pub(super) episode: Episode,
    pub(super) subtask: Subtask,
    pub(super) queue: ActionQueue,
    pub(super) turn: Turn,
    pub(super) decision: Decision,
    pub(super) current: Current,
    pub(super) mode: Mode,
    pub(super) observed: Option<(u64, u64)>,
    pub(super) width_m: Option<f64>,
    pub(super) shaper: Option<(Shaper, Commanded)>,
    pub(super) next_request: u64,
}

impl State {
    pub(super) fn new() -> Self {
        Self {
            sequence: 0,
            clock: StepClock::new(),
            robot: RobotIntake::new(),
            chunk: ChunkIntake::new(),
            grounding: GroundingIntake::new(),
            verdicts: Verdicts::new(),
            refusals: RefusalCounts::ZERO,
            applied: Applied::new(),
            ladder: Ladder::new(),
            episode: Episode::new(),
            subtask: Subtask::fresh(0, 0),
            queue: ActionQueue::new(),
            turn: Turn::Settling(0),
            decision: Decision::NONE,
            current: Current {
                action: still(-1.0),
                policy_step: 0,
                flags: 0,
            },
            mode: Mode::Hold,
            observed: None,
            width_m: None,
            shaper: None,
            next_request: 1,
        }
    }

    /// The active subtask.
    #[must_use]
    pub const fn subtask(&self) -> &Subtask {
        &self.subtask
    }

    /// What was refused so far, by name.
    #[must_use]
    pub const fn refusals(&self) -> &RefusalCounts {
        &self.refusals
    }

    /// The newest decision.
    #[must_use]
    pub const fn decision(&self) -> &Decision {
        &self.decision
    }

    /// The action that is being executed.
    #[must_use]
    pub const fn action(&self) -> &Action {
        &self.current.action
    }

    /// Queries and corrections of the episode.
    #[must_use]
    pub const fn episode(&self) -> &Episode {
        &self.episode
    }

    /// Actions of the base policy that wait.
    #[must_use]
    pub const fn queue(&self) -> &ActionQueue {
        &self.queue
    }
}
