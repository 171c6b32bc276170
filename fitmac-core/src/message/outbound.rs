//! Messages out of the core.

use super::{ACTION_DIM, Action, ObjectId, assert_packed};
use crate::wire::{Mode, Phase, Route, SubPhase};

/// The command of one control tick.
///
/// A robot takes it in one of two ways. A LIBERO-like plant takes `action`
/// each time `policy_step` rises: its goal becomes the measured pose plus the
/// increment. A robot with a Cartesian interface at control rate follows
/// `setpoint_*`, which is shaped to the limits on velocity, acceleration and
/// jerk at every tick.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Rises by one each tick.
    pub sequence: u64,
    /// The time that the tick was told, ns.
    pub stamp_ns: u64,
    /// Rises by one each time a new action starts; an action stands until the
    /// next one starts.
    pub policy_step: u64,
    /// The query in which the action was decided.
    pub query: u64,
    /// Normalised increments (x, y, z, rotation vector) in [-1, 1], and the
    /// gripper: -1 opens, +1 closes.
    pub action: Action,
    /// Setpoint of the tool centre point, base frame, m.
    pub setpoint_position_m: [f64; 3],
    /// Its velocity, m/s.
    pub setpoint_velocity_m_s: [f64; 3],
    /// Its acceleration, m/s^2.
    pub setpoint_acceleration_m_s2: [f64; 3],
    /// Setpoint of the orientation, unit quaternion (w, x, y, z).
    pub setpoint_orientation: [f64; 4],
    /// Why the mode or the route is not the plain one: bits of [`crate::reason`].
    pub reasons: u64,
    /// [`Mode`].
    pub mode: u8,
    /// [`Route`].
    pub route: u8,
    /// [`Phase`].
    pub phase: u8,
    /// [`SubPhase`].
    pub sub_phase: u8,
    /// Bits of [`Command::CLAMPED`] and its neighbours.
    pub flags: u32,
}
assert_packed!(Command = 32 + 8 * ACTION_DIM + 104 + 16);

impl Command {
    /// The policy's action lay outside the action box and was clamped.
    pub const CLAMPED: u32 = 1;
    /// The last filter changed the action or the setpoint.
    pub const LIMITED: u32 = 1 << 1;
    /// No command follows: the controller ends in order.
    pub const LAST: u32 = 1 << 2;
    /// The action is the base policy's own.
    pub const FROM_POLICY: u32 = 1 << 3;

    /// The mode, or `None` for an unknown byte.
    #[must_use]
    pub fn mode(&self) -> Option<Mode> {
        Mode::try_from(self.mode).ok()
    }

    /// The route, or `None` for an unknown byte.
    #[must_use]
    pub fn route(&self) -> Option<Route> {
        Route::try_from(self.route).ok()
    }

    /// The phase, or `None` for an unknown byte.
    #[must_use]
    pub fn phase(&self) -> Option<Phase> {
        Phase::try_from(self.phase).ok()
    }

    /// The recovery's step, or `None` for an unknown byte.
    #[must_use]
    pub fn sub_phase(&self) -> Option<SubPhase> {
        SubPhase::try_from(self.sub_phase).ok()
    }
}

/// Asks the policy for a chunk.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PolicyQuery {
    /// Names the query; the chunk repeats it.
    pub query_id: u64,
    /// When it was asked, ns.
    pub stamp_ns: u64,
    /// The sequence number of the state sample that the core decided on.
    pub state_sequence: u64,
    /// Policy steps executed so far in this episode.
    pub policy_step: u64,
    /// The committed grounding epoch; the chunk repeats it.
    pub epoch: u64,
    /// The active subtask; the chunk repeats it.
    pub subtask: u32,
    /// The prompt to use; the chunk repeats it.
    pub prompt_id: u32,
}
assert_packed!(PolicyQuery = 48);

/// Asks the agents to ground the target (again).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RebindRequest {
    /// Names the request.
    pub request_id: u64,
    /// When it was asked, ns.
    pub stamp_ns: u64,
    /// The answer's epoch must be above this one.
    pub epoch: u64,
    /// The subtask to ground.
    pub subtask: u32,
    /// The instance that is in doubt; 0 if none was locked.
    pub suspect: ObjectId,
    /// Zero.
    pub reserved: u16,
    /// Why: bits of [`crate::reason`].
    pub reasons: u64,
}
assert_packed!(RebindRequest = 40);

/// One record a query, and one an event: what the core saw and decided.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceRecord {
    /// When, ns.
    pub stamp_ns: u64,
    /// The query.
    pub query: u64,
    /// Policy steps executed so far.
    pub policy_step: u64,
    /// Evidence at hand: bits of [`crate::evidence`].
    pub evidence: u64,
    /// Gate reasons and faults: bits of [`crate::reason`].
    pub reasons: u64,
    /// Committed grounding epoch.
    pub epoch: u64,
    /// Attempt number within the episode.
    pub attempt: u64,
    /// Policy steps in the phase.
    pub phase_steps: u32,
    /// Queries left to the running recovery.
    pub budget: u32,
    /// Actions that this query may execute.
    pub effective_horizon: u32,
    /// Policy steps since the attempt began.
    pub attempt_steps: u32,
    /// Active subtask.
    pub subtask: u32,
    /// For a refused message: its reason as the code of the refusal.
    pub detail: u32,
    /// The locked target; 0 if none.
    pub target: ObjectId,
    /// The object that the arm approaches or holds instead; 0 if none.
    pub other: ObjectId,
    /// [`crate::wire::EventKind`].
    pub kind: u8,
    /// [`crate::wire::Phase`].
    pub phase: u8,
    /// [`crate::wire::Diagnosis`].
    pub diagnosis: u8,
    /// [`crate::wire::Route`].
    pub route: u8,
    /// [`crate::wire::Mode`].
    pub mode: u8,
    /// [`crate::wire::SubPhase`].
    pub sub_phase: u8,
    /// [`crate::wire::Verdict`].
    pub verdict: u8,
    /// Consecutive actionable failures of one type.
    pub failure_streak: u8,
    /// Consecutive observations of the target above the gate's confidence.
    pub confidence_streak: u8,
    /// Re-descents left to the running recovery.
    pub redescents: u8,
    /// 1 if the gripper is closed.
    pub gripper_closed: u8,
    /// 1 if the target is lifted.
    pub lifted: u8,
    /// Confidence of the lock.
    pub kappa: f64,
    /// End effector to target, m; NaN if unknown.
    pub target_distance_m: f64,
    /// Object to destination, m; NaN if unknown.
    pub destination_distance_m: f64,
    /// Gripper width, m.
    pub gripper_width_m: f64,
    /// Tool centre point, base frame, m.
    pub ee_position_m: [f64; 3],
    /// The target, base frame, m; NaN if unknown.
    pub target_position_m: [f64; 3],
    /// The recovery's waypoint, base frame, m; NaN if none.
    pub waypoint_m: [f64; 3],
    /// The base policy's action for this step; NaN if none was at hand.
    pub base_action: Action,
    /// The action that was executed.
    pub action: Action,
}
assert_packed!(TraceRecord = 56 + 24 + 16 + 32 + 72 + 16 * ACTION_DIM);

#[cfg(test)]
mod tests {
    use super::*;

    /// Programs in other languages read them too.
    #[test]
    fn the_flags_are_the_four_lowest_bits() {
        let flags = [
            Command::CLAMPED,
            Command::LIMITED,
            Command::LAST,
            Command::FROM_POLICY,
        ];
        assert_eq!(flags, [1, 2, 4, 8]);
    }
}
