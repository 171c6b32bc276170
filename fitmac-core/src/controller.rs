//! The controller.

use crate::{
    ValidParams,
    message::{Command, Input, Output},
};

/// Everything that the controller remembers: a copy is a snapshot.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    sequence: u64,
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
        Self {
            params,
            state: State { sequence: 0 },
        }
    }

    /// What the controller remembers.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Goes on from a snapshot.
    pub fn restore(&mut self, state: State) {
        self.state = state;
    }

    /// Decides one control tick at `now_ns` (monotonic).
    pub fn tick(&mut self, now_ns: u64, _input: &Input<'_>) -> Output {
        self.state.sequence = self.state.sequence.wrapping_add(1);
        let command = Command {
            sequence: self.state.sequence,
            stamp_ns: now_ns,
            policy_step: 0,
            query: 0,
            action: [0.0; 7],
            setpoint_position_m: [0.0; 3],
            setpoint_velocity_m_s: [0.0; 3],
            setpoint_acceleration_m_s2: [0.0; 3],
            setpoint_orientation: [1.0, 0.0, 0.0, 0.0],
            reasons: crate::reason::NO_STATE,
            mode: crate::wire::Mode::Hold.code(),
            route: 0,
            phase: 0,
            sub_phase: 1,
            flags: 0,
        };
        Output {
            command,
            query: None,
            rebind: None,
            trace: None,
        }
    }
}
