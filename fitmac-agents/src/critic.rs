//! The optional critic: a language model's view of a snapshot.
//!
//! Its label is one of four, its confidence is clamped, and the rules win: it
//! adds to what they say and never authorises anything by itself.

use serde::{Deserialize, Serialize};

use crate::model::{ModelError, Question, prompts};

/// What the critic may say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureType {
    /// Nothing to act on.
    None,
    /// The target is likely wrong, ambiguous or mismatched.
    TargetFailure,
    /// The target seems right, the execution doesn't progress.
    ExecutionFailure,
    /// The task is done.
    Success,
}

/// The execution state that the critic sees: the paper's 17 keys (section
/// C.4.3).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snapshot {
    /// The route of the last query.
    pub route: String,
    /// The phase.
    pub phase: String,
    /// Pick or place.
    pub attempt_kind: String,
    /// Number of the attempt.
    pub attempt_id: u64,
    /// Policy steps in the phase.
    pub phase_steps: u32,
    /// Why it stalls, or empty.
    pub stall_reason: String,
    /// True if the attempt may be over.
    pub attempt_end_candidate: bool,
    /// True if the gripper is closed.
    pub gripper_closed: bool,
    /// True if the target was lifted.
    pub target_lifted: bool,
    /// The locked target's label.
    pub target_selected: String,
    /// Kappa, 0 to 1.
    pub target_confidence: f64,
    /// Progress that was recognised.
    pub progress_flags: Vec<String>,
    /// The verifier's word.
    pub verifier_status: String,
    /// What a look at the target said.
    pub target_probe: String,
    /// The rules' diagnosis.
    pub rule_hint: String,
    /// Earlier contexts, newest last.
    pub recent_contexts: Vec<String>,
    /// Earlier diagnoses, newest last.
    pub recent_diagnoses: Vec<String>,
}

/// The critic's answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CriticOutput {
    /// The label.
    pub failure_type: FailureType,
    /// Why; for the trace only, never parsed.
    pub reason: String,
    /// 0 to 1 after [`CriticOutput::parse`].
    pub confidence: f64,
    /// Short words; for the trace only.
    pub evidence_tags: Vec<String>,
}

/// Longest reason, bytes.
const REASON_CAP: usize = 256;
/// Most tags, and the longest tag, bytes.
const TAG_CAPS: (usize, usize) = (8, 32);

impl CriticOutput {
    /// Reads an answer; the confidence is clamped to [0, 1].
    ///
    /// # Errors
    /// [`ModelError::Schema`] says what is wrong.
    pub fn parse(answer: &str) -> Result<Self, ModelError> {
        let mut output: Self = serde_json::from_str(answer.trim())
            .map_err(|error| ModelError::Schema(error.to_string()))?;
        if output.reason.len() > REASON_CAP {
            return Err(ModelError::Schema(
                "reason is longer than 256 bytes".to_owned(),
            ));
        }
        let (count, length) = TAG_CAPS;
        if output.evidence_tags.len() > count
            || output.evidence_tags.iter().any(|tag| tag.len() > length)
        {
            return Err(ModelError::Schema("at most 8 tags of 32 bytes".to_owned()));
        }
        // JSON has no NaN; an overflow reads as infinite.
        output.confidence = output.confidence.clamp(0.0, 1.0);
        Ok(output)
    }

    /// The diagnosis after the rules' own: theirs stands wherever they name
    /// one; where they say none, the critic's opinion is recorded as a doubt
    /// with at most half of its confidence.
    #[must_use]
    pub fn merged(&self, rules: FailureType, rules_confidence: f64) -> (FailureType, f64) {
        let rules_confidence = rules_confidence.clamp(0.0, 1.0);
        if rules == FailureType::None && self.failure_type != FailureType::Success {
            return (self.failure_type, self.confidence / 2.0);
        }
        if rules == self.failure_type {
            return (rules, rules_confidence.max(self.confidence));
        }
        (rules, rules_confidence)
    }
}

/// The question for the model.
#[must_use]
pub fn question(task: &str, snapshot: &Snapshot) -> Question {
    let snapshot = serde_json::to_string(snapshot).unwrap_or_default();
    let task = serde_json::Value::from(task);
    let user = format!("Task: {task}\nSnapshot: {snapshot}\n");
    Question {
        system: prompts::CRITIC,
        user,
        png: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"failure_type":"execution_failure","reason":"no lift",
        "confidence":0.7,"evidence_tags":["stall"]}"#;

    #[test]
    fn the_rules_win_and_the_critic_is_clamped() {
        let critic = CriticOutput::parse(&GOOD.replace("0.7", "7.0")).expect("valid");
        assert!((critic.confidence - 1.0).abs() < 1e-12);
        let (label, _) = critic.merged(FailureType::TargetFailure, 0.4);
        assert_eq!(label, FailureType::TargetFailure);
        let (label, confidence) = critic.merged(FailureType::None, 0.9);
        assert_eq!(label, FailureType::ExecutionFailure);
        assert!(confidence <= 0.5);
        let done = CriticOutput::parse(&GOOD.replace("execution_failure", "success"));
        let merged = done.expect("valid").merged(FailureType::None, 0.9);
        assert_eq!(merged.0, FailureType::None);
    }

    #[test]
    fn bad_answers_are_refused() {
        for (from, to) in [
            ("execution_failure", "grab_the_knife"),
            ("\"reason\"", "\"waypoint\":[1,2,3],\"reason\""),
            ("\"confidence\":0.7,", ""),
            (
                "\"stall\"",
                "\"a\",\"b\",\"c\",\"d\",\"e\",\"f\",\"g\",\"h\",\"i\"",
            ),
        ] {
            let bad = GOOD.replace(from, to);
            assert_ne!(bad, GOOD);
            assert!(CriticOutput::parse(&bad).is_err(), "{to}");
        }
        let long = GOOD.replace("no lift", &"x".repeat(300));
        assert!(CriticOutput::parse(&long).is_err());
    }

    #[test]
    fn the_snapshot_has_the_papers_keys() {
        let value = serde_json::to_value(Snapshot::default()).expect("json");
        assert_eq!(value.as_object().expect("object").len(), 17);
    }
}
