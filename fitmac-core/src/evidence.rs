//! Evidence of failure: bits of [`crate::message::TraceRecord::evidence`].

use crate::reason::bits;

bits! {
    /// Progress in the newest step (equation 5).
    PROGRESS = 0 "progress",
    /// No progress through the phase's patience window (equation 6).
    STALL = 1 "stall",
    /// The phase lasts longer than it may.
    TIMEOUT = 2 "timeout",
    /// The motion keeps turning back without net progress.
    REVERSAL = 3 "reversal",
    /// The end effector closes in on another instance than the locked one.
    WRONG_TARGET = 4 "wrong_target",
    /// The end effector moves away from the target with an open gripper.
    MOVING_AWAY = 5 "moving_away",
    /// The gripper closed on nothing.
    EMPTY_GRASP = 6 "empty_grasp",
    /// The lifted object fell.
    DROPPED = 7 "dropped",
    /// The verifier denied success after the release.
    VERIFIER_NEGATIVE = 8 "verifier_negative",
    /// The target confidence is below the grounding threshold.
    KAPPA_LOW = 9 "kappa_low",
    /// The locked instance left the candidates.
    LOCK_INCOMPATIBLE = 10 "lock_incompatible",
    /// The locked instance jumped without contact.
    LOCK_JUMPED = 11 "lock_jumped",
    /// The gripper holds another object than the locked one.
    WRONG_OBJECT_HELD = 12 "wrong_object_held",
    /// No target is locked.
    NO_LOCK = 13 "no_lock",
    // Bit 14 is free: the others keep their places, so that recorded traces read as before.
    /// The critic suspects the target.
    CRITIC_TARGET = 15 "critic_target",
    /// The critic suspects the execution.
    CRITIC_EXECUTION = 16 "critic_execution",
    /// The released object rests outside its region.
    MISPLACED = 17 "misplaced",
    /// The held object is carried or lowered away from its destination.
    WRONG_DESTINATION = 18 "wrong_destination",
    /// The detector keeps naming another target than the locked one.
    FLAPPING = 19 "flapping",
}

/// Evidence that only time gives: it does not count in a young attempt.
pub const TIME_BASED: u64 = STALL | TIMEOUT | REVERSAL | MOVING_AWAY;

/// Evidence against the binding of the target, whatever the attempt did.
pub const TARGET: u64 = KAPPA_LOW | LOCK_INCOMPATIBLE | LOCK_JUMPED | NO_LOCK | FLAPPING;

/// Evidence of a wrong object: against the binding until it was looked at
/// again or the attempt has acted, against the execution afterwards.
pub const WRONG_OBJECT: u64 = WRONG_TARGET | WRONG_OBJECT_HELD;

/// Evidence against the execution.
pub const EXECUTION: u64 =
    TIME_BASED | EMPTY_GRASP | DROPPED | VERIFIER_NEGATIVE | MISPLACED | WRONG_DESTINATION;

/// Strong evidence: opens the gate without a streak.
pub const STRONG: u64 =
    WRONG_OBJECT | EMPTY_GRASP | DROPPED | VERIFIER_NEGATIVE | WRONG_DESTINATION | NO_LOCK;
