//! The messages that enter and leave the core.
//!
//! All are plain data with a fixed layout (`repr(C)`, no padding), the same in
//! shared memory, behind the C interface and in a trace. They are *not*
//! trusted: enumerations are bytes, counts and numbers may be anything. The
//! core's intake validates a private copy before it uses one.
//!
//! Units are SI, positions are in the robot's base frame, quaternions are
//! (w, x, y, z), times are nanoseconds of a monotonic clock.

mod inbound;
mod outbound;

pub use inbound::{
    ActionChunk, Candidate, CriticReport, GroundingRecord, ObjectSample, Plan, StateSample,
    VerifierReport,
};
pub use outbound::{Command, PolicyQuery, RebindRequest, TraceRecord};

/// Most actions that a chunk carries.
pub const CHUNK_CAPACITY: usize = 64;
/// Numbers in an action: x, y, z, rotation vector, gripper.
pub const ACTION_DIM: usize = 7;
/// Most target candidates of a grounding record.
pub const CANDIDATE_CAPACITY: usize = 16;
/// Most objects of a state sample.
pub const OBJECT_CAPACITY: usize = 32;
/// Most subtasks of a plan.
pub const SUBTASK_CAPACITY: usize = 8;
/// Joints of the arm.
pub const JOINT_COUNT: usize = 7;

/// One action in the declared action space.
pub type Action = [f64; ACTION_DIM];

/// An object's identity within an episode; 0 names no object.
pub type ObjectId = u16;

/// Fails the build if a message has padding: the sum of its fields' sizes must
/// be its size.
macro_rules! assert_packed {
    ($type:ty = $bytes:expr) => {
        const _: () = assert!(
            size_of::<$type>() == $bytes,
            "message has padding or changed size"
        );
    };
}
use assert_packed;

/// Everything that arrived since the last tick. An absent message means
/// nothing new. Messages are borrowed and copied once by the intake.
#[derive(Clone, Copy, Debug, Default)]
pub struct Input<'a> {
    /// The newest robot state.
    pub state: Option<&'a StateSample>,
    /// The newest action chunk.
    pub chunk: Option<&'a ActionChunk>,
    /// The newest grounding record.
    pub grounding: Option<&'a GroundingRecord>,
    /// The plan, at the start of an episode.
    pub plan: Option<&'a Plan>,
    /// The newest word of the task verifier.
    pub verifier: Option<&'a VerifierReport>,
    /// The newest word of the critic.
    pub critic: Option<&'a CriticReport>,
    /// A request of the operator, as a byte of [`crate::wire::Request`].
    pub request: u8,
}

/// The answer to one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// The command for the robot; exactly one a tick.
    pub command: Command,
    /// A request for an action chunk, to be sent to the policy.
    pub query: Option<PolicyQuery>,
    /// A request to ground the target, to be sent to the agents.
    pub rebind: Option<RebindRequest>,
    /// The record of a query whose first action starts in this tick.
    pub trace: Option<TraceRecord>,
    /// The record of an event: a refusal, or a change of mode.
    pub event: Option<TraceRecord>,
}
