//! The orchestrator: the order of the stages, and nothing else.
//!
//! A tick takes in what arrived, analyses it at policy steps, decides at
//! queries, and only then acts. What happens above the line in
//! [`Controller::tick`] commands nothing.

mod act;
mod play;
mod state;
mod take_in;

use crate::{
    clock::Tick,
    filter::still,
    intake::Refusal,
    ladder::Faults,
    message::{Action, Input, Output, PolicyQuery, RebindRequest},
    params::ValidParams,
    reason,
    turn::Turn,
    wire::{EventKind, Mode},
};
pub use state::State;

/// What a tick has to report besides its command.
#[derive(Default)]
struct Report {
    query: Option<PolicyQuery>,
    rebind: Option<RebindRequest>,
    event: Option<(EventKind, Option<Refusal>)>,
    noticed: u64,
    stop_asked: bool,
}

/// An action that starts in this tick.
#[derive(Clone, Copy)]
struct Start {
    action: Action,
    flags: u32,
    from_policy: bool,
    waypoint_m: Option<[f64; 3]>,
    /// It is the first of its query.
    query: bool,
}

impl Start {
    /// No increment, the gripper as in `last`.
    const fn still(last: &Action) -> Self {
        let [.., gripper] = *last;
        Self {
            action: still(gripper),
            flags: 0,
            from_policy: false,
            waypoint_m: None,
            query: false,
        }
    }
}

/// Watches the policy and decides who acts.
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    params: ValidParams,
    state: State,
}

impl Controller {
    /// A controller that has seen nothing yet.
    #[must_use]
    pub fn new(params: ValidParams) -> Self {
        let mut state = State::new();
        state.turn = Turn::Settling(params.get().clock.settle_steps);
        Self { params, state }
    }

    /// The parameters.
    #[must_use]
    pub const fn params(&self) -> &ValidParams {
        &self.params
    }

    /// What the controller remembers; a clone is a snapshot.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Goes on from a snapshot.
    pub fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// Decides one control tick at `now_ns` (monotonic). Total: whatever the
    /// input holds, one command comes out.
    pub fn tick(&mut self, now_ns: u64, input: &Input<'_>) -> Output {
        let mut report = Report::default();
        self.state.sequence = self.state.sequence.wrapping_add(1);
        let tick = self
            .state
            .clock
            .advance(now_ns, self.params.get().clock.gap_stop_ms);
        self.take_in(now_ns, input, &mut report);
        let (mode, faults) = self.judge_faults(now_ns, &tick, &report);
        let starts = match mode {
            Mode::Normal | Mode::Warn => self.play(now_ns, &mut report),
            Mode::Hold | Mode::Stop => self.stand_still(now_ns, mode, &mut report),
        };
        // Analysis ends here; what follows acts.
        self.act(now_ns, mode, faults, tick.dt_s, starts, report)
    }

    fn judge_faults(&mut self, now_ns: u64, tick: &Tick, report: &Report) -> (Mode, u64) {
        let (state, params) = (&mut self.state, self.params.get());
        let time = if tick.backwards {
            reason::TIME_FAULT
        } else {
            0
        };
        let faults = Faults {
            noticed: report.noticed | time,
            state_age_ns: state.robot.age_ns(now_ns),
            waiting_ns: state
                .chunk
                .waiting_since_ns()
                .map(|since| now_ns.saturating_sub(since)),
            chunks_accepted: state.chunk.accepted(),
            chunks_refused: state.chunk.refused_in_a_row(),
            unapplied_ns: state.applied.standing_ns(now_ns),
            suspended: tick.suspended,
            stop_asked: report.stop_asked,
        };
        state.ladder.step(params, &faults)
    }
}
