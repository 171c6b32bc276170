//! Closed vocabularies of the messages.
//!
//! A message carries an enumeration as one byte. The byte is decoded by a
//! table ([`TryFrom<u8>`]), never reinterpreted, so an unknown value is an
//! error and not undefined behaviour.

/// A byte that names no member of its vocabulary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownCode {
    /// The vocabulary, as the type is named.
    pub vocabulary: &'static str,
    /// The byte that was found.
    pub code: u8,
}

impl core::fmt::Display for UnknownCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} has no member {}", self.vocabulary, self.code)
    }
}

macro_rules! vocabulary {
    ($(#[$meta:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $code:literal $text:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum $name { $($(#[$doc])* $variant = $code,)+ }

        impl $name {
            /// Every member, in the order of its code.
            pub const ALL: &[Self] = &[$(Self::$variant,)+];

            /// The byte that stands for this member in a message.
            #[must_use]
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// The name that traces, tables and JSON use.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)+ }
            }
        }

        impl TryFrom<u8> for $name {
            type Error = UnknownCode;

            fn try_from(code: u8) -> Result<Self, UnknownCode> {
                match code {
                    $($code => Ok(Self::$variant),)+
                    _ => Err(UnknownCode { vocabulary: stringify!($name), code }),
                }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.pad(self.name())
            }
        }
    };
}

vocabulary! {
    /// How the seven numbers of an action are meant.
    ActionSpace {
        /// Operational-space pose increments, normalised to [-1, 1]: x, y, z,
        /// rotation vector, gripper (robosuite's OSC_POSE; the goal is the
        /// measured pose plus the increment).
        OscPoseDelta = 1 "osc_pose_delta",
    }
}

vocabulary! {
    /// The frame in which an action's increments are expressed.
    ActionFrame {
        /// The robot's base frame.
        Base = 1 "base",
    }
}

vocabulary! {
    /// What the gripper number of an action means.
    GripperConvention {
        /// -1 opens, +1 closes (LIBERO, robosuite, openpi's LIBERO policies).
        MinusOneOpen = 1 "minus_one_open",
        /// 1 opens, 0 closes (OpenVLA's raw output).
        OneOpen = 2 "one_open",
    }
}

vocabulary! {
    /// How an object wants to be grasped: the key of the grasp table.
    GraspClass {
        /// A box that fits between the fingers along its narrow side.
        Box = 1 "box",
        /// A short upright cylinder.
        Can = 2 "can",
        /// A tall object that is easily knocked over.
        Bottle = 3 "bottle",
        /// An open vessel wider than the gripper: grasped by its rim.
        Bowl = 4 "bowl",
        /// A flat thing that is not picked: plates, baskets, furniture.
        Fixture = 5 "fixture",
    }
}

vocabulary! {
    /// What the destination reference of a subtask is.
    DestinationKind {
        /// The subtask names no destination, or none was resolved.
        Unresolved = 0 "unresolved",
        /// A place that geometry alone can reach: an object's region.
        Direct = 1 "direct",
        /// A place that only a relation describes: left to the base policy.
        Relational = 2 "relational",
    }
}

vocabulary! {
    /// How the object stands to its destination.
    PlaceRelation {
        /// On a supporting surface.
        On = 1 "on",
        /// Inside a container.
        In = 2 "in",
    }
}

vocabulary! {
    /// Where a grounding record comes from.
    Provenance {
        /// Rules over detections and relations, first resolution.
        Rules = 1 "rules",
        /// A model chose among the candidates.
        Resolver = 2 "resolver",
        /// The answer to the core's request to look again.
        Recheck = 3 "recheck",
    }
}

vocabulary! {
    /// What the task verifier says (V of the paper's Algorithm 1).
    Verdict {
        /// Nothing known.
        Unknown = 0 "unknown",
        /// The active subtask's predicate holds.
        Success = 1 "success",
        /// The active subtask's predicate was tested and does not hold.
        Fail = 2 "fail",
    }
}

vocabulary! {
    /// The critic's label (appendix C.4.3 of the paper).
    CriticLabel {
        /// No actionable failure.
        None = 0 "none",
        /// The target is likely wrong, ambiguous or mismatched.
        TargetFailure = 1 "target_failure",
        /// The target seems right, but the robot makes no progress.
        ExecutionFailure = 2 "execution_failure",
        /// The subtask is done.
        Success = 3 "success",
    }
}

vocabulary! {
    /// What an operator or supervisor asks of the controller.
    Request {
        /// Nothing.
        None = 0 "none",
        /// Stop in a controlled way, and stay stopped.
        Stop = 1 "stop",
        /// Forget the latched stop and the episode, start afresh.
        Reset = 2 "reset",
    }
}

vocabulary! {
    /// The phase of a manipulation attempt (section 3.4 of the paper).
    Phase {
        /// Pick: moving to the target with an open gripper.
        Approach = 0 "approach",
        /// Pick: at the target, closing.
        Grasp = 1 "grasp",
        /// Pick: closed on something, raising it.
        Lift = 2 "lift",
        /// Place: carrying towards the destination.
        Transport = 3 "transport",
        /// Place: above the destination, lowering.
        Descend = 4 "descend",
        /// Place: opening.
        Release = 5 "release",
        /// Place: released, waiting for the object to come to rest.
        Stabilise = 6 "stabilise",
        /// The subtask's success was verified.
        Complete = 7 "complete",
    }
}

vocabulary! {
    /// The diagnosed state (equation 7).
    Diagnosis {
        /// Nothing actionable.
        None = 0 "none",
        /// The binding to the target is uncertain or inconsistent.
        TargetCorrection = 1 "target_correction",
        /// Approach, grasp or lift failed.
        PickFailure = 2 "pick_failure",
        /// Transport, placement, release or rest failed.
        PlaceFailure = 3 "place_failure",
        /// A correction is already running.
        RecoveryInProgress = 4 "recovery_in_progress",
        /// The subtask is done.
        Success = 5 "success",
    }
}

vocabulary! {
    /// The route M of a query (Algorithm 1). Declaration order is precedence:
    /// what stands further down wins.
    Route {
        /// The base policy acts.
        Base = 0 "base",
        /// Execution correction starts in this query.
        Execution = 1 "execution_correction",
        /// Target correction: the grounding changes, the base policy acts.
        Target = 2 "target_correction",
        /// A running execution correction continues.
        Pending = 3 "pending_correction",
    }
}

vocabulary! {
    /// What the controller does with faults. Declaration order is severity.
    Mode {
        /// No fault.
        Normal = 0 "normal",
        /// A fault is flagged; nothing changes.
        Warn = 1 "warn",
        /// Zero increment, gripper kept, until the cause is gone.
        Hold = 2 "hold",
        /// Controlled stop, latched until a reset.
        Stop = 3 "stop",
    }
}

vocabulary! {
    /// The step of a running recovery (appendix C.2 and Table 19).
    SubPhase {
        /// No recovery runs.
        Idle = 0 "idle",
        /// Pick: setting down a thing that is not the target.
        SetDown = 1 "set_down",
        /// Pick: moving above the target, open.
        ApproachHover = 2 "approach_hover",
        /// Pick: down to the grasp point.
        Descend = 3 "descend",
        /// Pick: closing.
        Close = 4 "close",
        /// Pick: a short raise that shows whether the object follows.
        LiftTest = 5 "lift_test",
        /// Pick: opening again for another descent.
        Reopen = 6 "reopen",
        /// Place: raising to the carry height.
        LiftCarry = 7 "lift_carry",
        /// Place: carrying to above the destination, aligning.
        MoveAbove = 8 "move_above_destination",
        /// Place: lowering to the release height.
        Lower = 9 "descend_to_destination",
        /// Place: at the release height, about to open.
        ReleaseReady = 10 "release_ready",
        /// Place: open, standing still.
        ReleaseHold = 11 "release_hold",
        /// Place: rising clear of the object.
        Retreat = 12 "retreat",
        /// Place: small upward motion, open, while the object comes to rest.
        Settle = 13 "settle",
    }
}

vocabulary! {
    /// Why a trace record was written.
    EventKind {
        /// One record a query.
        Query = 0 "query",
        /// A chunk was refused.
        ChunkRefused = 1 "chunk_refused",
        /// A state sample was refused.
        StateRefused = 2 "state_refused",
        /// A grounding record was refused.
        GroundingRefused = 3 "grounding_refused",
        /// The mode changed.
        ModeChanged = 4 "mode_changed",
        /// The active subtask changed.
        SubtaskChanged = 5 "subtask_changed",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_decodes_to_its_member_and_no_other_does() {
        for code in 0..=u8::MAX {
            match SubPhase::try_from(code) {
                Ok(member) => assert_eq!(member.code(), code),
                Err(e) => assert_eq!((e.vocabulary, e.code), ("SubPhase", code)),
            }
        }
        assert_eq!(SubPhase::ALL.len(), 14);
        assert!(Route::Pending > Route::Target && Route::Target > Route::Execution);
        assert!(Mode::Stop > Mode::Hold);
    }
}
