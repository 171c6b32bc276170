//! Messages into the core.

use super::{
    ACTION_DIM, CANDIDATE_CAPACITY, CHUNK_CAPACITY, JOINT_COUNT, OBJECT_CAPACITY, ObjectId,
    SUBTASK_CAPACITY, assert_packed,
};

/// One object as the pose source sees it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectSample {
    /// Identity within the episode; 0 is invalid.
    pub id: ObjectId,
    /// [`crate::wire::GraspClass`].
    pub grasp_class: u8,
    /// 1 if the object was observed in this sample, 0 if the pose is kept.
    pub visible: u8,
    /// Zero.
    pub reserved: u32,
    /// When the pose was observed, ns.
    pub stamp_ns: u64,
    /// Centre of the bounding box, base frame, m.
    pub position_m: [f64; 3],
    /// Orientation in the base frame, unit quaternion (w, x, y, z).
    pub orientation: [f64; 4],
    /// Half the bounding box along the object's own axes, m.
    pub half_extent_m: [f64; 3],
    /// Confidence of the pose, 0 to 1.
    pub confidence: f64,
}
assert_packed!(ObjectSample = 104);

/// The state of the robot and of the objects around it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateSample {
    /// Rises by one with each new sample; a repeated number is a repeated sample.
    pub sequence: u64,
    /// Names the run of the publisher; a change means that it restarted.
    pub session: u64,
    /// When the sample was taken, ns.
    pub stamp_ns: u64,
    /// The sequence number of the last command that the robot applied.
    pub applied_command: u64,
    /// Joint positions, rad.
    pub joint_position_rad: [f64; JOINT_COUNT],
    /// Joint velocities, rad/s.
    pub joint_velocity_rad_s: [f64; JOINT_COUNT],
    /// Tool centre point, base frame, m.
    pub ee_position_m: [f64; 3],
    /// Orientation of the end effector, unit quaternion (w, x, y, z).
    pub ee_orientation: [f64; 4],
    /// Linear velocity of the tool centre point, base frame, m/s.
    pub ee_velocity_m_s: [f64; 3],
    /// Distance between the finger pads, m (Franka Hand: 0 to 0.08).
    pub gripper_width_m: f64,
    /// Objects in use.
    pub object_count: u32,
    /// Zero.
    pub reserved: u32,
    /// The objects; only the first `object_count` count.
    pub objects: [ObjectSample; OBJECT_CAPACITY],
}
assert_packed!(StateSample = 240 + 104 * OBJECT_CAPACITY);

/// A chunk of actions from the policy.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActionChunk {
    /// Rises with each chunk of a session.
    pub sequence: u64,
    /// Names the run of the publisher; a change means that it restarted.
    pub session: u64,
    /// When the observation behind the chunk was taken, ns.
    pub observation_ns: u64,
    /// When the chunk was produced, ns.
    pub stamp_ns: u64,
    /// The query that the chunk answers.
    pub query_id: u64,
    /// The grounding epoch of the prompt that the chunk answers.
    pub epoch: u64,
    /// The subtask of that prompt.
    pub subtask: u32,
    /// The prompt.
    pub prompt_id: u32,
    /// Actions in use; a count above the capacity refuses the whole chunk.
    pub horizon: u32,
    /// [`crate::wire::ActionSpace`].
    pub action_space: u8,
    /// [`crate::wire::ActionFrame`].
    pub frame: u8,
    /// [`crate::wire::GripperConvention`].
    pub gripper: u8,
    /// Zero.
    pub reserved: u8,
    /// The actions, one a policy step; only the first `horizon` count.
    pub actions: [[f32; ACTION_DIM]; CHUNK_CAPACITY],
}
assert_packed!(ActionChunk = 64 + 4 * ACTION_DIM * CHUNK_CAPACITY);

/// One object that may be meant by the instruction.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Candidate {
    /// The object.
    pub id: ObjectId,
    /// 1 if its class and relation fit the instruction.
    pub compatible: u8,
    /// Zero.
    pub reserved: [u8; 5],
    /// How well it fits, 0 to 1.
    pub confidence: f64,
}
assert_packed!(Candidate = 16);

/// What the grounder knows about the target and destination of a subtask.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundingRecord {
    /// Rises with each record of a session.
    pub sequence: u64,
    /// Names the run of the publisher.
    pub session: u64,
    /// When the observation behind the record was taken, ns.
    pub stamp_ns: u64,
    /// Rises with each resolution that may move the lock.
    pub epoch: u64,
    /// The subtask that it grounds.
    pub subtask: u32,
    /// The prompt that names the target to the policy.
    pub prompt_id: u32,
    /// The chosen target; 0 if none was found.
    pub target: ObjectId,
    /// The destination's anchor object; 0 if it has none.
    pub destination: ObjectId,
    /// [`crate::wire::DestinationKind`].
    pub destination_kind: u8,
    /// [`crate::wire::PlaceRelation`].
    pub relation: u8,
    /// [`crate::wire::Provenance`].
    pub provenance: u8,
    /// Candidates in use; a count above the capacity refuses the record.
    pub candidate_count: u8,
    /// Confidence kappa of the target, 0 to 1.
    pub confidence: f64,
    /// Centre of the destination region in the anchor's frame, m: on a
    /// surface, its z is the surface; in a container, its z is the rim.
    pub region_offset_m: [f64; 3],
    /// Half extent of the destination region in x and y of the anchor, and the
    /// depth of a container (0 on a surface), m.
    pub region_half_extent_m: [f64; 3],
    /// The target in the image: x, y, width, height, px. For the trace only.
    pub image_box_px: [f32; 4],
    /// The candidates.
    pub candidates: [Candidate; CANDIDATE_CAPACITY],
}
assert_packed!(GroundingRecord = 120 + 16 * CANDIDATE_CAPACITY);

/// The ordered subtasks of an instruction.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plan {
    /// Names the plan; a new number starts a new episode of decisions.
    pub id: u64,
    /// Subtasks in use, 1 to [`SUBTASK_CAPACITY`].
    pub subtask_count: u32,
    /// Confidence of the parse in 1/1000; below the core's threshold the base
    /// policy keeps control.
    pub confidence_permille: u32,
}
assert_packed!(Plan = 16);

/// The task verifier's word on the active subtask.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VerifierReport {
    /// Rises with each report.
    pub sequence: u64,
    /// When it was judged, ns.
    pub stamp_ns: u64,
    /// The subtask that it judges.
    pub subtask: u32,
    /// [`crate::wire::Verdict`].
    pub verdict: u8,
    /// Zero.
    pub reserved: [u8; 3],
}
assert_packed!(VerifierReport = 24);

/// The critic's assessment of the execution snapshot.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CriticReport {
    /// Rises with each report.
    pub sequence: u64,
    /// When the snapshot was taken, ns.
    pub stamp_ns: u64,
    /// The subtask that it judges.
    pub subtask: u32,
    /// [`crate::wire::CriticLabel`].
    pub label: u8,
    /// Zero.
    pub reserved: [u8; 3],
    /// Confidence, clamped to [0, 1] by the intake.
    pub confidence: f64,
}
assert_packed!(CriticReport = 32);

const _: () = assert!(SUBTASK_CAPACITY <= u32::MAX as usize);

impl Default for StateSample {
    fn default() -> Self {
        Self {
            sequence: 0,
            session: 0,
            stamp_ns: 0,
            applied_command: 0,
            joint_position_rad: [0.0; JOINT_COUNT],
            joint_velocity_rad_s: [0.0; JOINT_COUNT],
            ee_position_m: [0.0; 3],
            ee_orientation: [1.0, 0.0, 0.0, 0.0],
            ee_velocity_m_s: [0.0; 3],
            gripper_width_m: 0.0,
            object_count: 0,
            reserved: 0,
            objects: [ObjectSample::default(); OBJECT_CAPACITY],
        }
    }
}

impl Default for ActionChunk {
    fn default() -> Self {
        Self {
            sequence: 0,
            session: 0,
            observation_ns: 0,
            stamp_ns: 0,
            query_id: 0,
            epoch: 0,
            subtask: 0,
            prompt_id: 0,
            horizon: 0,
            action_space: 0,
            frame: 0,
            gripper: 0,
            reserved: 0,
            actions: [[0.0; ACTION_DIM]; CHUNK_CAPACITY],
        }
    }
}

impl Default for GroundingRecord {
    fn default() -> Self {
        Self {
            sequence: 0,
            session: 0,
            stamp_ns: 0,
            epoch: 0,
            subtask: 0,
            prompt_id: 0,
            target: 0,
            destination: 0,
            destination_kind: 0,
            relation: 0,
            provenance: 0,
            candidate_count: 0,
            confidence: 0.0,
            region_offset_m: [0.0; 3],
            region_half_extent_m: [0.0; 3],
            image_box_px: [0.0; 4],
            candidates: [Candidate::default(); CANDIDATE_CAPACITY],
        }
    }
}
