//! The action queue Q and the effective horizon (equation 12).

use crate::{
    message::{ACTION_DIM, Action, ActionChunk, CHUNK_CAPACITY},
    params::{ChunkIntake, Horizon, Params},
    wire::GripperConvention,
};

/// In which of its modes the controller fills the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillMode {
    /// The base policy acts and nothing is suspected.
    Base,
    /// A failure streak runs.
    Armed,
    /// The target was just rebound.
    Rebound,
    /// A correction handed back a few steps ago.
    HandedBack,
    /// A correction acts.
    Correction,
}

/// `H_eff` of equation 12: how many actions a query may execute. The paper's
/// `H_exec` holds where multi-agent control is active; a correction emits one
/// action a query (Table 19).
#[must_use]
pub fn effective_horizon(chunk: &ChunkIntake, horizon: &Horizon, mode: FillMode) -> u32 {
    match mode {
        FillMode::Base => chunk.open_loop_steps,
        FillMode::Armed | FillMode::Rebound | FillMode::HandedBack => {
            chunk.open_loop_steps.min(horizon.execution_steps)
        }
        FillMode::Correction => 1,
    }
}

/// A policy's action as the robot takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolicyAction {
    /// The action, bit for bit the policy's unless `clamped` or converted.
    pub action: Action,
    /// It lay outside [-1, 1].
    pub clamped: bool,
}

/// Actions of the base policy that wait to be executed.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionQueue {
    actions: [[f32; ACTION_DIM]; CHUNK_CAPACITY],
    next: usize,
    end: usize,
    played: u64,
}

impl ActionQueue {
    pub(crate) const fn new() -> Self {
        Self {
            actions: [[0.0; ACTION_DIM]; CHUNK_CAPACITY],
            next: 0,
            end: 0,
            played: 0,
        }
    }

    /// Actions of the policy that were executed so far.
    #[must_use]
    pub const fn played(&self) -> u64 {
        self.played
    }

    /// Actions left.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.end.saturating_sub(self.next)
    }

    /// True if a query is due.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn clear(&mut self) {
        self.next = 0;
        self.end = 0;
    }

    /// Takes the prefix of at most `horizon` actions of `chunk`, after
    /// `consumed` that were already overtaken. Returns how many it took.
    pub(crate) fn fill(&mut self, chunk: &ActionChunk, consumed: usize, horizon: u32) -> usize {
        let length = (chunk.horizon as usize).min(CHUNK_CAPACITY);
        self.actions = chunk.actions;
        self.next = consumed.min(length);
        self.end = self.next.saturating_add(horizon as usize).min(length);
        self.len()
    }

    pub(crate) fn pop(&mut self, params: &Params) -> Option<PolicyAction> {
        if self.next >= self.end {
            return None;
        }
        let raw = *self.actions.get(self.next)?;
        self.next = self.next.saturating_add(1);
        self.played = self.played.wrapping_add(1);
        Some(decode(params, raw))
    }
}

/// Widens to f64 (exact), converts the gripper's convention, clamps to the
/// action box.
fn decode(params: &Params, raw: [f32; ACTION_DIM]) -> PolicyAction {
    let mut action = raw.map(f64::from);
    if params.policy_gripper.convention() == GripperConvention::OneOpen {
        let [.., gripper] = &mut action;
        *gripper = if *gripper > 0.5 { -1.0 } else { 1.0 };
    }
    let clamped = action.iter().any(|x| x.abs() > 1.0);
    for x in &mut action {
        if x.abs() > 1.0 {
            *x = if *x > 0.0 { 1.0 } else { -1.0 };
        }
    }
    PolicyAction { action, clamped }
}

#[cfg(test)]
mod tests;
