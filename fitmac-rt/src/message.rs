//! The messages that travel between the processes: the core's own, whose
//! layouts stand here, and four that the core never sees.

use fitmac_core::message::{
    ActionChunk, Candidate, Command, CriticReport, GroundingRecord, ObjectSample, Plan,
    PolicyQuery, RebindRequest, StateSample, TraceRecord, VerifierReport,
};
use fitmac_core::{evidence, reason, wire};

use crate::layout::{Meaning, Vocabulary, layout};

/// Longest prompt, bytes of UTF-8.
pub const PROMPT_CAPACITY: usize = 256;

/// The text behind a prompt id. It travels from the agents to the policy and
/// never enters the core.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PromptText {
    /// The id that queries and grounding records carry.
    pub prompt_id: u32,
    /// The subtask that it is for.
    pub subtask: u32,
    /// The grounding epoch that made it.
    pub epoch: u64,
    /// Bytes in use.
    pub length: u64,
    /// UTF-8, zero beyond `length`.
    pub text: [u8; PROMPT_CAPACITY],
}

/// Why a text is no prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PromptError {
    /// It is too long.
    #[error("a prompt of {0} bytes is longer than {PROMPT_CAPACITY}: shorten the instruction")]
    TooLong(usize),
    /// The declared length is above the capacity, or the bytes are not UTF-8.
    #[error("the prompt message does not hold UTF-8 text of its declared length")]
    NotText,
}

impl PromptText {
    /// A prompt message.
    ///
    /// # Errors
    /// If the text is longer than [`PROMPT_CAPACITY`]: it is never cut.
    pub fn new(prompt_id: u32, subtask: u32, epoch: u64, text: &str) -> Result<Self, PromptError> {
        let mut bytes = [0; PROMPT_CAPACITY];
        bytes
            .get_mut(..text.len())
            .ok_or(PromptError::TooLong(text.len()))?
            .copy_from_slice(text.as_bytes());
        Ok(Self {
            prompt_id,
            subtask,
            epoch,
            length: text.len() as u64,
            text: bytes,
        })
    }

    /// The text.
    ///
    /// # Errors
    /// If the message was malformed: it comes from another process.
    pub fn text(&self) -> Result<&str, PromptError> {
        text_of(self.length, &self.text).ok_or(PromptError::NotText)
    }
}

/// The text in the first `length` of some bytes, if that is what they hold.
fn text_of(length: u64, bytes: &[u8]) -> Option<&str> {
    let used = bytes.get(..usize::try_from(length).ok()?)?;
    core::str::from_utf8(used).ok()
}

/// Longest outcome of a model call, bytes.
pub const OUTCOME_CAPACITY: usize = 32;

/// Which agent asked a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ModelRole {
    /// The planner.
    Planner = 1,
    /// The grounder's resolver.
    Resolver = 2,
    /// The critic.
    Critic = 3,
}

impl ModelRole {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Planner, Self::Resolver, Self::Critic];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Planner => "planner",
            Self::Resolver => "resolver",
            Self::Critic => "critic",
        }
    }
}

/// A call of a language or vision model that came to its end, for the trace.
/// It travels from the agents to the recorder and never enters the core.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelCall {
    /// When it was asked, ns.
    pub asked_ns: u64,
    /// From asking to the end, ns.
    pub latency_ns: u64,
    /// Requests sent.
    pub attempts: u32,
    /// The subtask that it was for.
    pub subtask: u32,
    /// [`ModelRole`].
    pub role: u8,
    /// Zero.
    pub reserved: [u8; 7],
    /// Bytes of the outcome.
    pub length: u64,
    /// UTF-8, zero beyond `length`.
    pub outcome: [u8; OUTCOME_CAPACITY],
}

impl ModelCall {
    /// A record without an outcome.
    #[must_use]
    pub const fn new(role: ModelRole, subtask: u32, asked_ns: u64, latency_ns: u64) -> Self {
        Self {
            asked_ns,
            latency_ns,
            attempts: 0,
            subtask,
            role: role as u8,
            reserved: [0; 7],
            length: 0,
            outcome: [0; OUTCOME_CAPACITY],
        }
    }

    /// The same with what came of it, "ok" or what went wrong in a word (cut
    /// after [`OUTCOME_CAPACITY`] bytes), after so many requests.
    #[must_use]
    pub fn ended(mut self, outcome: &str, attempts: u32) -> Self {
        let end = outcome.floor_char_boundary(OUTCOME_CAPACITY);
        for (to, from) in self.outcome.iter_mut().zip(outcome.bytes().take(end)) {
            *to = from;
        }
        self.length = end as u64;
        self.attempts = attempts;
        self
    }

    /// What came of it; `None` if the message was malformed: it comes from
    /// another process.
    #[must_use]
    pub fn outcome(&self) -> Option<&str> {
        text_of(self.length, &self.outcome)
    }
}

/// What an operator or supervisor asks of the controller.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OperatorRequest {
    /// [`wire::Request`].
    pub request: u8,
    /// Zero.
    pub reserved: [u8; 7],
}

/// Number of named counters of a [`Status`].
pub const COUNTER_CAPACITY: usize = 128;

/// The controller's state of health, published ten times a second off the
/// control thread.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// When, ns.
    pub stamp_ns: u64,
    /// Control ticks so far.
    pub ticks: u64,
    /// Reasons of the newest command: bits of [`reason`].
    pub reasons: u64,
    /// [`wire::Mode`] of the newest command.
    pub mode: u8,
    /// [`wire::Route`] of the newest command.
    pub route: u8,
    /// [`wire::Phase`] of the newest command.
    pub phase: u8,
    /// [`wire::SubPhase`] of the newest command.
    pub sub_phase: u8,
    /// Counters in use.
    pub counter_count: u32,
    /// Counters, in the order of [`crate::counters::names`].
    pub counters: [u64; COUNTER_CAPACITY],
}

macro_rules! code {
    ($name:ident) => {
        Meaning::Code(Vocabulary {
            name: stringify!($name),
            members: || {
                wire::$name::ALL
                    .iter()
                    .map(|m| (m.code(), m.name()))
                    .collect()
            },
        })
    };
}

layout!(ObjectSample, "ObjectSample" {
    id, grasp_class: code!(GraspClass), visible, reserved, stamp_ns, position_m, orientation,
    half_extent_m, confidence,
});

layout!(StateSample, "StateSample" {
    sequence, session, stamp_ns, applied_command, joint_position_rad, joint_velocity_rad_s,
    ee_position_m, ee_orientation, ee_velocity_m_s, gripper_width_m, object_count, reserved,
    objects: Meaning::CountedBy("object_count"),
});

layout!(ActionChunk, "ActionChunk" {
    sequence, session, observation_ns, stamp_ns, query_id, epoch, subtask, prompt_id, horizon,
    action_space: code!(ActionSpace), frame: code!(ActionFrame),
    gripper: code!(GripperConvention), reserved, actions: Meaning::CountedBy("horizon"),
});

layout!(Candidate, "Candidate" { id, compatible, reserved, confidence });

layout!(GroundingRecord, "GroundingRecord" {
    sequence, session, stamp_ns, epoch, subtask, prompt_id, target, destination,
    destination_kind: code!(DestinationKind), relation: code!(PlaceRelation),
    provenance: code!(Provenance), candidate_count, confidence, region_offset_m,
    region_half_extent_m, image_box_px, candidates: Meaning::CountedBy("candidate_count"),
});

layout!(Plan, "Plan" { id, subtask_count, confidence_permille });

layout!(VerifierReport, "VerifierReport" {
    sequence, stamp_ns, subtask, verdict: code!(Verdict), reserved,
});

layout!(CriticReport, "CriticReport" {
    sequence, stamp_ns, subtask, label: code!(CriticLabel), reserved, confidence,
});

layout!(Command, "Command" {
    sequence, stamp_ns, policy_step, query, action, setpoint_position_m, setpoint_velocity_m_s,
    setpoint_acceleration_m_s2, setpoint_orientation, reasons: Meaning::Bits(reason::ALL),
    mode: code!(Mode), route: code!(Route), phase: code!(Phase), sub_phase: code!(SubPhase),
    flags: Meaning::Bits(COMMAND_FLAGS),
});

/// The names of a command's flags.
pub const COMMAND_FLAGS: &[(u64, &str)] = &[
    (Command::CLAMPED as u64, "clamped"),
    (Command::LIMITED as u64, "limited"),
    (Command::LAST as u64, "last"),
    (Command::FROM_POLICY as u64, "from_policy"),
];

layout!(PolicyQuery, "PolicyQuery" {
    query_id, stamp_ns, state_sequence, policy_step, epoch, subtask, prompt_id,
});

layout!(RebindRequest, "RebindRequest" {
    request_id, stamp_ns, epoch, subtask, suspect, reserved,
    reasons: Meaning::Bits(reason::ALL),
});

layout!(TraceRecord, "TraceRecord" {
    stamp_ns, query, policy_step, evidence: Meaning::Bits(evidence::ALL),
    reasons: Meaning::Bits(reason::ALL), epoch, attempt, phase_steps, budget, effective_horizon,
    attempt_steps, subtask, detail, target, other, kind: code!(EventKind), phase: code!(Phase),
    diagnosis: code!(Diagnosis), route: code!(Route), mode: code!(Mode),
    sub_phase: code!(SubPhase), verdict: code!(Verdict), failure_streak, confidence_streak,
    redescents, gripper_closed, lifted, kappa, target_distance_m, destination_distance_m,
    gripper_width_m, ee_position_m, target_position_m, waypoint_m, base_action, action,
});

layout!(PromptText, "PromptText" {
    prompt_id, subtask, epoch, length, text: Meaning::Text("length"),
});

layout!(ModelCall, "ModelCall" {
    asked_ns, latency_ns, attempts, subtask,
    role: Meaning::Code(Vocabulary {
        name: "ModelRole",
        members: || ModelRole::ALL.iter().map(|m| (*m as u8, m.name())).collect(),
    }),
    reserved, length, outcome: Meaning::Text("length"),
});

layout!(OperatorRequest, "OperatorRequest" { request: code!(Request), reserved });

layout!(Status, "Status" {
    stamp_ns, ticks, reasons: Meaning::Bits(reason::ALL), mode: code!(Mode),
    route: code!(Route), phase: code!(Phase), sub_phase: code!(SubPhase), counter_count,
    counters: Meaning::CountedBy("counter_count"),
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Payload;

    #[test]
    fn a_prompt_comes_back_whole_or_not_at_all() {
        let prompt = PromptText::new(3, 1, 7, "put the bowl on the plate – now").expect("fits");
        assert_eq!(prompt.text(), Ok("put the bowl on the plate – now"));
        let long = "x".repeat(PROMPT_CAPACITY + 1);
        assert_eq!(
            PromptText::new(0, 0, 0, &long),
            Err(PromptError::TooLong(PROMPT_CAPACITY + 1))
        );
        let mut torn = prompt;
        torn.length = u64::MAX;
        assert_eq!(torn.text(), Err(PromptError::NotText));
        torn.length = 28; // ends inside the dash
        torn.text[25] = 0xff;
        assert_eq!(torn.text(), Err(PromptError::NotText));
    }

    #[test]
    fn the_outcome_of_a_call_is_cut_between_letters() {
        let call = ModelCall::new(ModelRole::Critic, 0, 1, 2);
        assert_eq!(call.ended("ok", 1).outcome(), Some("ok"));
        let long = call.ended(&"ö".repeat(17), 3);
        assert_eq!(long.outcome(), Some(&*"ö".repeat(16)));
        let torn = ModelCall { length: 33, ..long };
        assert_eq!(torn.outcome(), None);
    }

    #[test]
    fn unused_candidates_are_not_recorded() {
        let record = GroundingRecord {
            candidate_count: 1,
            ..GroundingRecord::default()
        };
        assert_eq!(record.used_bytes().len(), 120 + 16);
    }
}
