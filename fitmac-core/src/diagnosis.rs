//! Diagnosis (equation 7) and its history.

use crate::{
    evidence,
    phase::{is_pick, is_place},
    wire::{Diagnosis, Phase},
};

/// Diagnoses that the history holds.
pub const HISTORY: usize = 16;

/// What a diagnosis depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Question {
    /// Bits of [`evidence`].
    pub evidence: u64,
    /// The phase.
    pub phase: Phase,
    /// The subtask's success was verified.
    pub success: bool,
    /// A correction is running.
    pub pending: bool,
    /// The attempt is too young for evidence that only time gives.
    pub young: bool,
    /// The binding was looked at again, or the attempt has acted: a wrong
    /// object now speaks against the execution.
    pub binding_settled: bool,
}

impl Question {
    /// The evidence that counts: none from time alone in a young attempt.
    #[must_use]
    pub const fn counted(&self) -> u64 {
        if self.young {
            self.evidence & !evidence::TIME_BASED
        } else {
            self.evidence
        }
    }

    /// Evidence against the binding.
    #[must_use]
    pub const fn against_target(&self) -> u64 {
        let wrong = if self.binding_settled {
            0
        } else {
            evidence::WRONG_OBJECT
        };
        self.counted() & (evidence::TARGET | wrong)
    }

    /// Evidence against the execution.
    #[must_use]
    pub const fn against_execution(&self) -> u64 {
        let wrong = if self.binding_settled {
            evidence::WRONG_OBJECT
        } else {
            0
        };
        self.counted() & (evidence::EXECUTION | wrong)
    }

    /// The attempt may end: something speaks against it.
    #[must_use]
    pub const fn attempt_end_candidate(&self) -> bool {
        self.against_target() != 0 || self.against_execution() != 0
    }

    /// The diagnosis: success first; nothing without an attempt-end candidate;
    /// a running correction; then the target before the execution.
    #[must_use]
    pub const fn diagnose(&self) -> Diagnosis {
        if self.success {
            Diagnosis::Success
        } else if !self.attempt_end_candidate() {
            if self.pending {
                Diagnosis::RecoveryInProgress
            } else {
                Diagnosis::None
            }
        } else if self.pending {
            Diagnosis::RecoveryInProgress
        } else if self.against_target() != 0 {
            Diagnosis::TargetCorrection
        } else if is_pick(self.phase) {
            Diagnosis::PickFailure
        } else if is_place(self.phase) {
            Diagnosis::PlaceFailure
        } else {
            Diagnosis::None
        }
    }
}

/// The last diagnoses, newest first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiagnosisHistory {
    newest_first: [Diagnosis; HISTORY],
}

impl DiagnosisHistory {
    pub(crate) const fn new() -> Self {
        Self {
            newest_first: [Diagnosis::None; HISTORY],
        }
    }

    pub(crate) fn push(&mut self, diagnosis: Diagnosis) {
        self.newest_first.rotate_right(1);
        if let Some(newest) = self.newest_first.first_mut() {
            *newest = diagnosis;
        }
    }

    /// The diagnoses, newest first.
    #[must_use]
    pub const fn newest_first(&self) -> &[Diagnosis; HISTORY] {
        &self.newest_first
    }
}

#[cfg(test)]
mod tests;
