//! The ladder, all of it: every combination of faults on both sides of each
//! threshold, against the table of reactions.

use super::*;

const OTHERS: u64 = reason::STATE_REFUSED | reason::CHUNK_REFUSED;

/// Every combination of faults, each on both sides of its thresholds.
fn every_fault(params: &Params, mut look: impl FnMut(&Faults)) {
    let (s, c) = (&params.state, &params.chunk);
    let (hold, stop) = (ms_to_ns(s.hold_age_ms), ms_to_ns(s.stop_age_ms));
    let (late, silent) = (ms_to_ns(c.hold_after_ms), ms_to_ns(c.stop_after_ms));
    let applied = ms_to_ns(s.applied_hold_ms);
    for noticed in [0, reason::POLICY_FROZEN, OTHERS] {
        for age in [
            None,
            Some(0),
            Some(hold),
            Some(hold + 1),
            Some(stop),
            Some(stop + 1),
        ] {
            for waiting in [
                None,
                Some(late),
                Some(late + 1),
                Some(silent),
                Some(silent + 1),
            ] {
                for chunks_accepted in [0, 1] {
                    for chunks_refused in [
                        0,
                        c.refusals_hold - 1,
                        c.refusals_hold,
                        c.refusals_stop - 1,
                        c.refusals_stop,
                    ] {
                        for unapplied_ns in [0, applied, applied + 1] {
                            for bits in 0..4 {
                                look(&Faults {
                                    noticed,
                                    state_age_ns: age,
                                    waiting_ns: waiting,
                                    chunks_accepted,
                                    chunks_refused,
                                    unapplied_ns,
                                    suspended: bits & 1 != 0,
                                    stop_asked: bits & 2 != 0,
                                });
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Whether a reaction of the table applies, by its reason and mode.
fn applies(params: &Params, faults: &Faults, reaction: &Reaction) -> bool {
    let (s, c) = (&params.state, &params.chunk);
    let older = |ms| faults.state_age_ns.is_some_and(|age| age > ms_to_ns(ms));
    let owed = |ms| faults.waiting_ns.is_some_and(|w| w > ms_to_ns(ms));
    let heard = faults.chunks_accepted > 0;
    match (reaction.mode, reaction.reason) {
        (Mode::Warn, bit) => faults.noticed & bit != 0,
        (Mode::Hold, reason::NO_STATE) => faults.state_age_ns.is_none(),
        (Mode::Hold, reason::STATE_STALE) => older(s.hold_age_ms),
        (Mode::Hold, reason::NO_CHUNK) => owed(c.hold_after_ms) && !heard,
        (Mode::Hold, reason::STARVED) => owed(c.hold_after_ms) && heard,
        (Mode::Hold, reason::CHUNK_REFUSALS) => faults.chunks_refused >= c.refusals_hold,
        (Mode::Hold, reason::COMMAND_NOT_APPLIED) => {
            faults.unapplied_ns > ms_to_ns(s.applied_hold_ms)
        }
        // The controller's own hold: the ladder does not see it.
        (Mode::Hold, reason::AWAITING_REBIND) => false,
        (Mode::Stop, reason::OPERATOR_STOP) => faults.stop_asked,
        (Mode::Stop, reason::TIME_FAULT) => faults.suspended,
        (Mode::Stop, reason::STATE_STALE) => older(s.stop_age_ms),
        (Mode::Stop, reason::STARVED) => heard && owed(c.stop_after_ms),
        (Mode::Stop, reason::CHUNK_REFUSALS) => faults.chunks_refused >= c.refusals_stop,
        (mode, bit) => panic!("the table has a reaction {mode} to {bit:#x} that the test lacks"),
    }
}

#[test]
fn the_ladder_does_what_its_table_says() {
    let params = Params::guarded();
    let mut seen = 0;
    every_fault(&params, |faults| {
        let of = |mode| {
            REACTIONS
                .iter()
                .filter(|r| r.mode == mode && applies(&params, faults, r))
                .fold(0, |bits, r| bits | r.reason)
        };
        let (warn, hold, stop) = (of(Mode::Warn), of(Mode::Hold), of(Mode::Stop));
        let expected = if stop != 0 {
            (Mode::Stop, stop)
        } else if hold != 0 {
            (Mode::Hold, hold | warn)
        } else if warn != 0 {
            (Mode::Warn, warn)
        } else {
            (Mode::Normal, 0)
        };
        assert_eq!(Ladder::new().step(&params, faults), expected, "{faults:?}");
        seen += 1;
    });
    assert_eq!(seen, 3 * 6 * 5 * 2 * 5 * 3 * 4);
}

#[test]
fn a_stop_stays_and_gathers_reasons() {
    let params = Params::guarded();
    every_fault(&params, |first| {
        let mut ladder = Ladder::new();
        let (mode, why) = ladder.step(&params, first);
        if mode != Mode::Stop {
            return;
        }
        let calm = Faults {
            noticed: 0,
            state_age_ns: Some(0),
            waiting_ns: None,
            chunks_accepted: 1,
            chunks_refused: 0,
            unapplied_ns: 0,
            suspended: false,
            stop_asked: false,
        };
        assert_eq!(ladder.step(&params, &calm), (Mode::Stop, why));
        let asked = Faults {
            stop_asked: true,
            ..calm
        };
        let both = (Mode::Stop, why | reason::OPERATOR_STOP);
        assert_eq!(ladder.step(&params, &asked), both);
        assert_eq!(ladder.step(&params, &calm), both);
    });
}

#[test]
fn the_table_goes_from_mild_to_severe_and_names_each_reaction_once() {
    assert!(REACTIONS.is_sorted_by_key(|r| r.mode));
    for (i, a) in REACTIONS.iter().enumerate() {
        assert_eq!(a.reason.count_ones(), 1, "{}", a.when);
        assert!(!a.when.is_empty() && a.mode != Mode::Normal);
        for b in REACTIONS.iter().skip(i + 1) {
            assert!((a.mode, a.reason) != (b.mode, b.reason), "{}", b.when);
        }
    }
}

#[test]
fn what_is_noticed_in_two_ways_is_told() {
    let params = Params::guarded();
    let faults = Faults {
        noticed: reason::STATE_STALE | reason::STATE_REFUSED,
        state_age_ns: Some(ms_to_ns(params.state.hold_age_ms) + 1),
        waiting_ns: None,
        chunks_accepted: 1,
        chunks_refused: 0,
        unapplied_ns: 0,
        suspended: false,
        stop_asked: false,
    };
    let told = reason::STATE_STALE | reason::STATE_REFUSED;
    let found = Ladder::new().step(&params, &faults);
    assert_eq!(found, (Mode::Hold, told));
}

#[test]
fn a_robot_that_names_no_command_is_not_judged() {
    let mut applied = Applied::new();
    applied.note(1_000, 0);
    assert_eq!(applied.standing_ns(9_000), 0);
    applied.note(2_000, 7);
    applied.note(3_000, 7);
    assert_eq!(applied.standing_ns(9_000), 7_000);
    applied.note(4_000, 8);
    assert_eq!(applied.standing_ns(9_000), 5_000);
}
