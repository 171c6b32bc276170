//! The diagnosis over every set of evidence.

use super::*;
use crate::evidence::*;

/// Bits that the rules look at; the others are for the trace.
const BITS: u32 = 20;

/// Every set of evidence with every phase, and eight of the sixteen flags.
fn every_question(mut look: impl FnMut(&Question)) {
    for evidence in 0..1_u64 << BITS {
        for &phase in Phase::ALL {
            // Spread the flags over the sets: each meets each kind of evidence.
            for flags in [evidence % 16, (evidence / 16 + 5) % 16] {
                look(&Question {
                    evidence,
                    phase,
                    success: flags & 1 != 0 && flags & 6 == 0,
                    pending: flags & 2 != 0,
                    young: flags & 4 != 0,
                    binding_settled: flags & 8 != 0,
                });
            }
        }
    }
}

const TIME: u64 = STALL | TIMEOUT | REVERSAL | MOVING_AWAY;

#[test]
fn inv_34_the_binding_is_doubted_before_the_execution() {
    every_question(|q| {
        let counted = q.evidence & !(if q.young { TIME } else { 0 });
        let doubted = KAPPA_LOW | LOCK_INCOMPATIBLE | LOCK_JUMPED | NO_LOCK | FLAPPING;
        let wrong = WRONG_TARGET | WRONG_OBJECT_HELD;
        let target = counted & doubted != 0 || (counted & wrong != 0 && !q.binding_settled);
        let acted = EMPTY_GRASP | DROPPED | VERIFIER_NEGATIVE | MISPLACED | WRONG_DESTINATION;
        let execution =
            counted & (TIME | acted) != 0 || (counted & wrong != 0 && q.binding_settled);
        let expected = match (q.success, q.pending, target, execution) {
            (true, ..) => Diagnosis::Success,
            (_, true, ..) => Diagnosis::RecoveryInProgress,
            (_, _, true, _) => Diagnosis::TargetCorrection,
            (_, _, _, true) => match q.phase {
                Phase::Approach | Phase::Grasp | Phase::Lift => Diagnosis::PickFailure,
                Phase::Transport | Phase::Descend | Phase::Release | Phase::Stabilise => {
                    Diagnosis::PlaceFailure
                }
                Phase::Complete => Diagnosis::None,
            },
            _ => Diagnosis::None,
        };
        assert_eq!(q.diagnose(), expected, "{q:?}");
    });
}

#[test]
fn inv_35_a_pick_does_not_fail_at_placing_nor_the_reverse() {
    every_question(|q| match q.diagnose() {
        Diagnosis::PickFailure => assert!(is_pick(q.phase)),
        Diagnosis::PlaceFailure => assert!(is_place(q.phase)),
        _ => {}
    });
}

#[test]
fn inv_27_time_alone_says_nothing_about_a_young_attempt() {
    every_question(|q| {
        if q.young && q.evidence & !(TIME | PROGRESS) == 0 && !q.success && !q.pending {
            assert_eq!(q.diagnose(), Diagnosis::None, "{q:?}");
        }
    });
}

#[test]
fn inv_30_what_the_critic_adds_changes_nothing() {
    let noted = CRITIC_TARGET | CRITIC_EXECUTION | PROGRESS;
    every_question(|q| {
        let without = Question {
            evidence: q.evidence & !noted,
            ..*q
        };
        assert_eq!(q.diagnose(), without.diagnose());
    });
}

#[test]
fn inv_33_more_evidence_never_silences_a_failure() {
    every_question(|q| {
        if crate::gate::FailureKind::of(q.diagnose()).is_some() {
            for bit in [
                DROPPED,
                EMPTY_GRASP,
                WRONG_TARGET,
                VERIFIER_NEGATIVE,
                NO_LOCK,
            ] {
                let more = Question {
                    evidence: q.evidence | bit,
                    ..*q
                };
                assert!(crate::gate::FailureKind::of(more.diagnose()).is_some());
            }
        }
    });
}

#[test]
fn the_sets_of_evidence_are_disjoint_and_the_strong_ones_count() {
    assert_eq!(TARGET & EXECUTION, 0);
    assert_eq!(WRONG_OBJECT & (TARGET | EXECUTION), 0);
    assert_eq!(STRONG & !(TARGET | EXECUTION | WRONG_OBJECT), 0);
    assert_eq!(STRONG & TIME_BASED, 0, "time alone is never strong");
    let highest = ALL.iter().map(|&(bit, _)| bit).max();
    assert_eq!(
        highest,
        Some(1 << (BITS - 1)),
        "the tests above know every bit"
    );
}

#[test]
fn the_history_keeps_the_last_sixteen_newest_first() {
    let mut history = DiagnosisHistory::new();
    for n in 0..40 {
        let diagnosis = Diagnosis::ALL[n % Diagnosis::ALL.len()];
        history.push(diagnosis);
        for (ago, found) in history.newest_first().iter().enumerate().take(n + 1) {
            assert_eq!(*found, Diagnosis::ALL[(n - ago) % Diagnosis::ALL.len()]);
        }
    }
}
