//! What the task verifier and the critic said last. Both are asynchronous and
//! advisory: a verdict on another subtask is ignored, the critic's confidence
//! is clamped and its word never counts alone.

use crate::{
    evidence,
    intake::is_newer,
    message::{CriticReport, VerifierReport},
    params::Evidence,
    wire::{CriticLabel, Verdict},
};

/// The last words on the active subtask.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdicts {
    verdict: Verdict,
    verifier_sequence: Option<u64>,
    critic: Option<(CriticLabel, f64)>,
    critic_sequence: Option<u64>,
}

impl Verdicts {
    pub(crate) const fn new() -> Self {
        Self {
            verdict: Verdict::Unknown,
            verifier_sequence: None,
            critic: None,
            critic_sequence: None,
        }
    }

    /// The verifier's word.
    #[must_use]
    pub const fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// A new subtask: what was said before is void.
    pub(crate) fn forget(&mut self) {
        self.verdict = Verdict::Unknown;
        self.critic = None;
    }

    pub(crate) fn hear_verifier(&mut self, report: &VerifierReport, subtask: u32) {
        if self
            .verifier_sequence
            .is_some_and(|last| !is_newer(report.sequence, last))
        {
            return;
        }
        if let (Ok(verdict), true) = (Verdict::try_from(report.verdict), report.subtask == subtask)
        {
            self.verifier_sequence = Some(report.sequence);
            self.verdict = verdict;
        }
    }

    pub(crate) fn hear_critic(&mut self, report: &CriticReport, subtask: u32) {
        if self
            .critic_sequence
            .is_some_and(|last| !is_newer(report.sequence, last))
        {
            return;
        }
        if let (Ok(label), true) = (
            CriticLabel::try_from(report.label),
            report.subtask == subtask,
        ) {
            self.critic_sequence = Some(report.sequence);
            self.critic = Some((label, clamped(report.confidence)));
        }
    }

    /// Evidence from the critic. It joins evidence of the rules; where the
    /// rules have none, it is noted in the trace and counts for nothing.
    #[must_use]
    pub fn critic_evidence(&self, params: &Evidence) -> u64 {
        match self.critic {
            Some((label, confidence)) if confidence >= params.critic_confidence => match label {
                CriticLabel::TargetFailure => evidence::CRITIC_TARGET,
                CriticLabel::ExecutionFailure => evidence::CRITIC_EXECUTION,
                CriticLabel::None | CriticLabel::Success => 0,
            },
            _ => 0,
        }
    }
}

/// A confidence clamped to [0, 1]; 0 for a NaN.
fn clamped(confidence: f64) -> f64 {
    if confidence.is_nan() {
        0.0
    } else {
        confidence.clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests;
