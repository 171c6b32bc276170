//! The reaction ladder: what faults lead to. The severest reaction wins; a
//! stop is latched until a reset.

use crate::{
    intake::{age_ns, ms_to_ns},
    params::Params,
    reason,
    wire::Mode,
};

/// What the ladder judges in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Faults {
    /// Bits of [`reason`] that were noticed in this tick and lead to a warning.
    pub noticed: u64,
    /// Age of the newest state, `None` if there never was one.
    pub state_age_ns: Option<u64>,
    /// How long the policy has owed an answer.
    pub waiting_ns: Option<u64>,
    /// Chunks accepted so far.
    pub chunks_accepted: u64,
    /// Broken chunks since the last accepted one.
    pub chunks_refused: u32,
    /// Since when the robot has applied no new command.
    pub unapplied_ns: u64,
    /// The tick came after a gap: the process was suspended.
    pub suspended: bool,
    /// An operator or supervisor asks for a stop.
    pub stop_asked: bool,
}

/// What a fault leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reaction {
    /// One bit of [`reason`].
    pub reason: u64,
    /// The mode; a stop is latched until a reset.
    pub mode: Mode,
    /// From when on.
    pub when: &'static str,
}

const fn reaction(mode: Mode, reason: u64, when: &'static str) -> Reaction {
    Reaction { reason, mode, when }
}

/// Every reaction, the mildest first; where several apply the severest wins.
pub const REACTIONS: &[Reaction] = &[
    reaction(
        Mode::Warn,
        reason::STATE_REFUSED,
        "a state sample was refused",
    ),
    reaction(Mode::Warn, reason::STATE_JUMP, "the end effector jumped"),
    reaction(Mode::Warn, reason::CHUNK_REFUSED, "a chunk was refused"),
    reaction(
        Mode::Warn,
        reason::POLICY_RESTARTED,
        "the policy's session changed",
    ),
    reaction(
        Mode::Warn,
        reason::POLICY_FROZEN,
        "`chunk.frozen_chunks` equal chunks in a row",
    ),
    reaction(
        Mode::Warn,
        reason::GROUNDING_REFUSED,
        "a grounding record or a plan was refused",
    ),
    reaction(Mode::Warn, reason::TIME_FAULT, "time ran backwards"),
    reaction(
        Mode::Warn,
        reason::ACTION_CLAMPED,
        "the policy left the action box",
    ),
    reaction(
        Mode::Warn,
        reason::LIMITED,
        "the last filter changed the command",
    ),
    reaction(
        Mode::Hold,
        reason::NO_STATE,
        "no state sample was ever accepted",
    ),
    reaction(
        Mode::Hold,
        reason::STATE_STALE,
        "state older than `state.hold_age_ms`",
    ),
    reaction(
        Mode::Hold,
        reason::NO_CHUNK,
        "first answer later than `chunk.hold_after_ms`",
    ),
    reaction(
        Mode::Hold,
        reason::STARVED,
        "answer later than `chunk.hold_after_ms`",
    ),
    reaction(
        Mode::Hold,
        reason::CHUNK_REFUSALS,
        "`chunk.refusals_hold` broken chunks in a row",
    ),
    reaction(
        Mode::Hold,
        reason::COMMAND_NOT_APPLIED,
        "nothing applied for `state.applied_hold_ms`",
    ),
    reaction(
        Mode::Hold,
        reason::AWAITING_REBIND,
        "the answer to a rebind request is awaited",
    ),
    reaction(
        Mode::Stop,
        reason::OPERATOR_STOP,
        "an operator asked for it",
    ),
    reaction(
        Mode::Stop,
        reason::TIME_FAULT,
        "a gap above `clock.gap_stop_ms`",
    ),
    reaction(
        Mode::Stop,
        reason::STATE_STALE,
        "state older than `state.stop_age_ms`",
    ),
    reaction(
        Mode::Stop,
        reason::STARVED,
        "answer later than `chunk.stop_after_ms`",
    ),
    reaction(
        Mode::Stop,
        reason::CHUNK_REFUSALS,
        "`chunk.refusals_stop` broken chunks in a row",
    ),
];

/// The ladder's memory: a latched stop and its reasons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ladder {
    stopped: Option<u64>,
}

impl Ladder {
    pub(crate) const fn new() -> Self {
        Self { stopped: None }
    }

    /// The mode of this tick and its reasons.
    pub(crate) fn step(&mut self, params: &Params, faults: &Faults) -> (Mode, u64) {
        let stop = stop_reasons(params, faults);
        if let Some(latched) = &mut self.stopped {
            *latched |= stop;
        } else if stop != 0 {
            self.stopped = Some(stop);
        }
        if let Some(latched) = self.stopped {
            return (Mode::Stop, latched);
        }
        let hold = hold_reasons(params, faults);
        if hold != 0 {
            (Mode::Hold, hold | faults.noticed)
        } else if faults.noticed != 0 {
            (Mode::Warn, faults.noticed)
        } else {
            (Mode::Normal, 0)
        }
    }
}

fn stop_reasons(params: &Params, faults: &Faults) -> u64 {
    let mut bits = 0;
    let mut note = |holds: bool, bit: u64| bits |= if holds { bit } else { 0 };
    note(faults.stop_asked, reason::OPERATOR_STOP);
    note(faults.suspended, reason::TIME_FAULT);
    let stale = faults
        .state_age_ns
        .is_some_and(|age| age > ms_to_ns(params.state.stop_age_ms));
    note(stale, reason::STATE_STALE);
    let silent = faults.chunks_accepted > 0
        && faults
            .waiting_ns
            .is_some_and(|w| w > ms_to_ns(params.chunk.stop_after_ms));
    note(silent, reason::STARVED);
    note(
        faults.chunks_refused >= params.chunk.refusals_stop,
        reason::CHUNK_REFUSALS,
    );
    bits
}

fn hold_reasons(params: &Params, faults: &Faults) -> u64 {
    let mut bits = 0;
    let mut note = |holds: bool, bit: u64| bits |= if holds { bit } else { 0 };
    match faults.state_age_ns {
        None => note(true, reason::NO_STATE),
        Some(age) => note(
            age > ms_to_ns(params.state.hold_age_ms),
            reason::STATE_STALE,
        ),
    }
    let late = faults
        .waiting_ns
        .is_some_and(|w| w > ms_to_ns(params.chunk.hold_after_ms));
    let unknown = faults.chunks_accepted == 0;
    note(late && unknown, reason::NO_CHUNK);
    note(late && !unknown, reason::STARVED);
    note(
        faults.chunks_refused >= params.chunk.refusals_hold,
        reason::CHUNK_REFUSALS,
    );
    note(
        faults.unapplied_ns > ms_to_ns(params.state.applied_hold_ms),
        reason::COMMAND_NOT_APPLIED,
    );
    bits
}

/// Notices a robot that applies no commands: the number that it reports stands
/// still. A robot that reports none (0) is not judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Applied {
    last: u64,
    since_ns: Option<u64>,
}

impl Applied {
    pub(crate) const fn new() -> Self {
        Self {
            last: 0,
            since_ns: None,
        }
    }

    /// Notes the number in a new sample.
    pub(crate) fn note(&mut self, now_ns: u64, applied_command: u64) {
        if applied_command != self.last || self.since_ns.is_none() {
            *self = Self {
                last: applied_command,
                since_ns: Some(now_ns),
            };
        }
    }

    /// For how long no new command was applied.
    #[must_use]
    pub fn standing_ns(&self, now_ns: u64) -> u64 {
        match self.since_ns {
            Some(since) if self.last != 0 => age_ns(now_ns, since),
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests;
