//! How long an open question to the agents stays open.

use super::*;

#[test]
fn a_question_is_open_for_as_long_as_the_wait_and_no_longer() {
    let params = Params::guarded();
    let wait_ns = crate::intake::ms_to_ns(params.lock.rebind_wait_ms);
    let asked = Rebind::Asked { since_ns: 7 };
    for (waited_ns, left) in [
        (0, asked),
        (wait_ns, asked),
        (wait_ns + 1, Rebind::Unanswered),
        (u64::MAX - 7, Rebind::Unanswered),
    ] {
        let mut subtask = Subtask::fresh(0, 0);
        subtask.rebind = asked;
        let decided = correct_target(
            &params,
            7 + waited_ns,
            &mut Episode::new(),
            &mut subtask,
            &mut GroundingIntake::new(),
            Authorisation::Target(reason::TARGET_STREAK),
        );
        let reasons = reason::TARGET_STREAK | reason::AWAITING_REBIND;
        assert_eq!(decided, (Decided::Policy, reasons, false), "{waited_ns}");
        assert_eq!(subtask.rebind, left, "{waited_ns}");
    }
}
