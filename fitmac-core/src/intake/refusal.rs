//! Why a message was refused.

macro_rules! refusals {
    ($($(#[$doc:meta])* $name:ident $text:literal $hard:literal,)+) => {
        /// Why a message was refused.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Refusal { $($(#[$doc])* $name,)+ }

        impl Refusal {
            /// Every reason, in the order of its code.
            pub const ALL: &[Self] = &[$(Self::$name,)+];

            /// The number that stands for it in a trace record.
            #[must_use]
            pub const fn code(self) -> u32 {
                self as u32
            }

            /// The name that traces and counters show.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $text,)+ }
            }

            /// True if it speaks of a broken sender, false if it is a matter
            /// of timing that happens in good order.
            #[must_use]
            pub const fn is_hard(self) -> bool {
                match self { $(Self::$name => $hard,)+ }
            }
        }
    };
}

refusals! {
    /// The sequence number falls.
    Sequence "sequence" true,
    /// The sender restarted: the first message of the new session is not used.
    SessionChanged "session_changed" false,
    /// A number is not finite.
    NotFinite "not_finite" true,
    /// A count exceeds the capacity.
    TooLong "too_long" true,
    /// A chunk without actions.
    Empty "empty" true,
    /// A byte names no member of its vocabulary.
    UnknownCode "unknown_code" true,
    /// Action space, frame or gripper convention is not the configured one.
    Convention "convention" true,
    /// An action lies outside the action box.
    OutOfRange "out_of_range" true,
    /// The stamp lies in the future.
    FromFuture "from_future" true,
    /// The observation behind the message is too old.
    TooOld "too_old" false,
    /// The message belongs to another grounding epoch.
    Epoch "epoch" false,
    /// The message belongs to another subtask.
    Subtask "subtask" false,
    /// No query was asked, or another one.
    Query "query" false,
    /// All its actions were already played.
    Consumed "consumed" false,
    /// A quaternion is not of unit length.
    Quaternion "quaternion" true,
    /// A position lies implausibly far out: wrong unit or frame.
    Implausible "implausible" true,
    /// The end effector jumped further than it can move.
    Jump "jump" true,
    /// The chosen target is not among the candidates.
    NotACandidate "not_a_candidate" true,
    /// A plan without subtasks, or with too many.
    BadPlan "bad_plan" true,
    /// The message was heard before.
    Repeated "repeated" false,
}

/// How often each reason occurred.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RefusalCounts([u32; Refusal::ALL.len()]);

impl RefusalCounts {
    pub(crate) const ZERO: Self = Self([0; Refusal::ALL.len()]);

    pub(crate) fn count(&mut self, refusal: Refusal) {
        if let Some(n) = self.0.get_mut(refusal as usize) {
            *n = n.saturating_add(1);
        }
    }

    /// How often `refusal` occurred.
    #[must_use]
    pub fn of(&self, refusal: Refusal) -> u32 {
        self.0.get(refusal as usize).copied().unwrap_or(0)
    }

    /// All reasons with their counts.
    pub fn iter(&self) -> impl Iterator<Item = (Refusal, u32)> {
        Refusal::ALL.iter().map(|&r| (r, self.of(r)))
    }
}
