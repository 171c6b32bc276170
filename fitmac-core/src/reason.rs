//! Why a command is not plainly the policy's own: bits of
//! [`crate::message::Command::reasons`].

macro_rules! bits {
    ($($(#[$doc:meta])* $name:ident = $bit:literal $text:literal,)+) => {
        $($(#[$doc])* pub const $name: u64 = 1 << $bit;)+

        /// Every bit with its name, in order.
        pub const ALL: &[(u64, &str)] = &[$(($name, $text),)+];

        /// The names of the bits that are set, in order.
        pub fn names(bits: u64) -> impl Iterator<Item = &'static str> {
            ALL.iter().filter(move |(bit, _)| bits & bit != 0).map(|&(_, name)| name)
        }
    };
}
pub(crate) use bits;

bits! {
    /// No valid state sample has arrived yet.
    NO_STATE = 0 "no_state",
    /// The newest state sample is too old.
    STATE_STALE = 1 "state_stale",
    /// A state sample was refused.
    STATE_REFUSED = 2 "state_refused",
    /// The robot applies no commands.
    COMMAND_NOT_APPLIED = 3 "command_not_applied",
    /// No chunk was ever accepted.
    NO_CHUNK = 4 "no_chunk",
    /// The action queue is empty and no chunk came in time.
    STARVED = 5 "starved",
    /// A chunk was refused.
    CHUNK_REFUSED = 6 "chunk_refused",
    /// Too many chunks in a row were refused.
    CHUNK_REFUSALS = 7 "chunk_refusals",
    /// The policy process restarted.
    POLICY_RESTARTED = 8 "policy_restarted",
    /// A grounding record was refused.
    GROUNDING_REFUSED = 9 "grounding_refused",
    /// The policy's action was clamped to the action box.
    ACTION_CLAMPED = 10 "action_clamped",
    /// Time stood still, ran backwards or leapt.
    TIME_FAULT = 11 "time_fault",
    /// An operator or supervisor asked for a stop.
    OPERATOR_STOP = 12 "operator_stop",
    /// The policy repeats the same chunk.
    POLICY_FROZEN = 13 "policy_frozen",
    /// The end effector jumped further than it can move.
    STATE_JUMP = 14 "state_jump",
    /// The controller waits for the answer to a rebind request.
    AWAITING_REBIND = 15 "awaiting_rebind",
    /// Target evidence persisted through the failure streak.
    TARGET_STREAK = 16 "target_streak",
    /// Execution evidence persisted through the failure streak.
    EXECUTION_STREAK = 17 "execution_streak",
    /// Strong evidence opened the gate at once.
    STRONG_EVIDENCE = 18 "strong_evidence",
    /// A correction that was authorised earlier continues.
    CORRECTION_PENDING = 19 "correction_pending",
    /// The target is grounded for a new subtask.
    INITIAL_GROUNDING = 20 "initial_grounding",
    /// Gate closed: the failure streak is too short.
    STREAK_SHORT = 24 "streak_short",
    /// Gate closed: the target confidence is too low for an execution correction.
    CONFIDENCE_LOW = 25 "confidence_low",
    /// Gate closed: the target confidence was not high for long enough.
    CONFIDENCE_STREAK_SHORT = 26 "confidence_streak_short",
    /// Gate closed: the attempt is too young for time-based evidence.
    ATTEMPT_YOUNG = 27 "attempt_young",
    /// Gate closed: the base policy makes progress.
    PROGRESS = 28 "progress",
    /// Gate closed: cooling down after a hand-back.
    COOL_DOWN = 29 "cool_down",
    /// Gate closed: no activations are left for the subtask, or no budget for the episode.
    BUDGET_SPENT = 30 "budget_spent",
    /// Gate closed: the destination is not a direct anchor.
    DESTINATION_INDIRECT = 31 "destination_indirect",
    /// Gate closed: a switch turns the correction off.
    SWITCHED_OFF = 32 "switched_off",
    /// The correction gave no action: a waypoint or pose was missing.
    NO_ACTION = 33 "no_action",
    /// The correction was cancelled: its validity was lost.
    VALIDITY_LOST = 34 "validity_lost",
    /// The correction was cancelled: the phase does not fit it.
    PHASE_INCOMPATIBLE = 35 "phase_incompatible",
    /// The correction ended: its query budget is spent.
    BUDGET_EXHAUSTED = 36 "budget_exhausted",
    /// The correction ended: it succeeded.
    CORRECTED = 37 "corrected",
    /// The last filter limited the action or the setpoint.
    LIMITED = 38 "limited",
    /// The controller was stopped in order.
    SHUTTING_DOWN = 39 "shutting_down",
    /// Gate closed: the plan's parse is too uncertain to act on.
    PLAN_UNCERTAIN = 40 "plan_uncertain",
}
