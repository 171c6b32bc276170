//! Who is heard, and what a word counts.

use super::*;

fn verifier(sequence: u64, subtask: u32, verdict: u8) -> VerifierReport {
    VerifierReport {
        sequence,
        subtask,
        verdict,
        ..VerifierReport::default()
    }
}

fn critic(sequence: u64, label: CriticLabel, confidence: f64) -> CriticReport {
    CriticReport {
        sequence,
        subtask: 1,
        label: label.code(),
        confidence,
        ..CriticReport::default()
    }
}

#[test]
fn the_newest_sound_word_on_this_subtask_holds() {
    let mut verdicts = Verdicts::new();
    let mut hear = |report: &VerifierReport| {
        verdicts.hear_verifier(report, 1);
        verdicts.verdict()
    };
    let (success, fail) = (Verdict::Success.code(), Verdict::Fail.code());
    assert_eq!(hear(&verifier(4, 0, success)), Verdict::Unknown);
    assert_eq!(hear(&verifier(4, 1, 99)), Verdict::Unknown);
    assert_eq!(hear(&verifier(4, 1, success)), Verdict::Success);
    assert_eq!(hear(&verifier(4, 1, fail)), Verdict::Success, "the same");
    assert_eq!(
        hear(&verifier(3, 1, fail)),
        Verdict::Success,
        "an older one"
    );
    assert_eq!(hear(&verifier(5, 1, fail)), Verdict::Fail);
}

#[test]
fn the_critic_counts_from_its_least_confidence_on() {
    let params = Evidence {
        critic_confidence: 0.5,
        ..Evidence::default()
    };
    let says = |label, confidence| {
        let mut verdicts = Verdicts::new();
        verdicts.hear_critic(&critic(1, label, confidence), 1);
        verdicts.critic_evidence(&params)
    };
    let (target, execution) = (CriticLabel::TargetFailure, CriticLabel::ExecutionFailure);
    assert_eq!(says(target, 0.5), evidence::CRITIC_TARGET);
    assert_eq!(says(execution, 7.0), evidence::CRITIC_EXECUTION);
    assert_eq!(says(target, 0.499), 0);
    assert_eq!(says(target, f64::NAN), 0);
    assert_eq!(says(CriticLabel::Success, 1.0), 0);
    assert_eq!(says(CriticLabel::None, 1.0), 0);
}

#[test]
fn a_confidence_lies_between_nothing_and_one() {
    for (said, heard) in [(-1.0, 0.0), (0.25, 0.25), (2.0, 1.0), (f64::NAN, 0.0)] {
        assert_eq!(clamped(said), heard);
    }
}

#[test]
fn the_critic_is_heard_once_and_what_was_said_is_void_in_the_next_subtask() {
    let params = Evidence::default();
    let mut verdicts = Verdicts::new();
    verdicts.hear_critic(&critic(4, CriticLabel::TargetFailure, 1.0), 1);
    verdicts.hear_critic(&critic(4, CriticLabel::Success, 1.0), 1);
    verdicts.hear_critic(&critic(5, CriticLabel::Success, 1.0), 0);
    assert_eq!(verdicts.critic_evidence(&params), evidence::CRITIC_TARGET);
    verdicts.hear_verifier(&verifier(1, 1, Verdict::Fail.code()), 1);
    verdicts.forget();
    assert_eq!(verdicts.critic_evidence(&params), 0);
    assert_eq!(verdicts.verdict(), Verdict::Unknown);
    // An old word stays old.
    verdicts.hear_critic(&critic(4, CriticLabel::TargetFailure, 1.0), 1);
    assert_eq!(verdicts.critic_evidence(&params), 0);
}
