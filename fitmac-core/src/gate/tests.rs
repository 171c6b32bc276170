//! The gate, all of it: every state of its streaks and every question, against
//! rules that are written down one by one.

use super::*;
use crate::{route::route, wire::Route};

const SWITCHES: u8 = 16;

fn switches(bits: u8) -> Switches {
    Switches {
        target_corrector: bits & 1 != 0,
        execution_corrector: bits & 2 != 0,
        hard_pick: bits & 4 != 0,
        hard_place: bits & 8 != 0,
    }
}

const ROUTINES: [Routine; 3] = [Routine::Pick, Routine::Place, Routine::Indirect];
const KAPPAS: [f64; 5] = [f64::NAN, 0.0, 0.119_999, 0.12, 1.0];
const FAILURES: [Option<(FailureKind, u8)>; 11] = [
    None,
    Some((FailureKind::Target, 1)),
    Some((FailureKind::Target, 2)),
    Some((FailureKind::Target, 3)),
    Some((FailureKind::Target, 4)),
    Some((FailureKind::Target, 255)),
    Some((FailureKind::Execution, 1)),
    Some((FailureKind::Execution, 2)),
    Some((FailureKind::Execution, 3)),
    Some((FailureKind::Execution, 4)),
    Some((FailureKind::Execution, 255)),
];

/// Calls `look` with every question that differs in what the gate may see.
fn every_question(mut look: impl FnMut(&Switches, &Question)) {
    for bits in 0..SWITCHES {
        let switches = switches(bits);
        for &diagnosis in Diagnosis::ALL {
            for failure in FAILURES {
                for confident in [0, 1, 2, 3, 255] {
                    for kappa in KAPPAS {
                        for flags in 0..256_u16 {
                            let flag = |n: u16| flags >> n & 1 == 1;
                            for routine in ROUTINES {
                                look(
                                    &switches,
                                    &Question {
                                        diagnosis,
                                        strong: flag(0),
                                        initial: flag(1),
                                        streaks: Streaks { failure, confident },
                                        kappa,
                                        young: flag(2),
                                        progress: flag(3),
                                        cooling: flag(4),
                                        budget: flag(5),
                                        rebinds: flag(6),
                                        plan_certain: flag(7),
                                        routine,
                                    },
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}

fn decide(switches: &Switches, q: &Question) -> Authorisation {
    authorise(&GateParams::default(), switches, q)
}

#[test]
fn inv_21_execution_needs_both_streaks_or_strong_evidence() {
    every_question(|switches, q| {
        if let Authorisation::Execution(_) = decide(switches, q) {
            let persists = q.streaks.failures_of(FailureKind::Execution) >= 3;
            let trusted = q.streaks.confident() >= 2;
            assert!(q.strong || (persists && trusted), "{q:?}");
            assert!(q.budget && !q.cooling && q.plan_certain, "{q:?}");
            assert!(q.routine != Routine::Indirect, "{q:?}");
            let hard = match q.routine {
                Routine::Pick => switches.hard_pick,
                _ => switches.hard_place,
            };
            assert!(switches.execution_corrector && hard, "{q:?}");
        }
    });
}

#[test]
fn inv_22_a_rebind_needs_a_streak_or_strong_evidence() {
    every_question(|switches, q| {
        if let Authorisation::Target(bits) = decide(switches, q) {
            let persists = q.streaks.failures_of(FailureKind::Target) >= 3;
            if q.initial {
                assert_eq!(bits, reason::INITIAL_GROUNDING);
            } else {
                assert!(q.strong || persists, "{q:?}");
                assert!(q.rebinds && q.plan_certain && switches.target_corrector);
            }
        }
    });
}

#[test]
fn inv_25_what_is_no_failure_authorises_nothing() {
    every_question(|switches, q| {
        let actionable = matches!(
            q.diagnosis,
            Diagnosis::TargetCorrection | Diagnosis::PickFailure | Diagnosis::PlaceFailure
        );
        if !actionable {
            assert_eq!(decide(switches, q), Authorisation::Closed(0), "{q:?}");
        }
    });
}

#[test]
fn inv_26_a_diagnosis_alone_authorises_nothing_and_the_gate_says_why() {
    let mut closed = 0_u32;
    every_question(|switches, q| {
        if let Authorisation::Closed(bits) = decide(switches, q) {
            let failure = FailureKind::of(q.diagnosis).is_some();
            assert_eq!(failure, bits != 0, "{q:?}");
            closed += u32::from(failure);
        }
    });
    assert!(closed > 1_000_000);
}

#[test]
fn inv_27_a_young_attempt_needs_more_than_time() {
    every_question(|switches, q| {
        if q.young && !q.strong {
            let executes = matches!(decide(switches, q), Authorisation::Execution(_));
            assert!(!executes, "{q:?}");
        }
    });
    // And to be old enough is not enough: see inv_26.
}

#[test]
fn inv_28_progress_keeps_the_gate_closed_unless_the_evidence_is_strong() {
    every_question(|switches, q| {
        if q.progress && !q.strong {
            let executes = matches!(decide(switches, q), Authorisation::Execution(_));
            assert!(!executes, "{q:?}");
        }
        let off = GateParams {
            progress_guard_steps: 0,
            ..GateParams::default()
        };
        let unguarded = authorise(&off, switches, q);
        let calm = Question {
            progress: false,
            ..*q
        };
        assert_eq!(unguarded, authorise(&off, switches, &calm), "{q:?}");
    });
}

#[test]
fn inv_29_a_weak_target_drives_no_waypoint() {
    every_question(|switches, q| {
        if let Authorisation::Execution(_) = decide(switches, q) {
            assert!(q.kappa >= 0.12, "{q:?}");
        }
    });
}

#[test]
fn inv_31_one_query_opens_one_way_at_most_and_it_is_the_diagnosed_one() {
    every_question(|switches, q| match decide(switches, q) {
        Authorisation::Closed(_) => {}
        Authorisation::Target(bits) => {
            assert_ne!(bits, 0);
            assert_eq!(FailureKind::of(q.diagnosis), Some(FailureKind::Target));
        }
        Authorisation::Execution(bits) => {
            assert_ne!(bits, 0);
            assert_eq!(FailureKind::of(q.diagnosis), Some(FailureKind::Execution));
        }
    });
}

fn opens(gate: Authorisation) -> bool {
    !matches!(gate, Authorisation::Closed(_))
}

#[test]
fn inv_32_a_lower_streak_opens_whatever_a_higher_one_does() {
    every_question(|switches, q| {
        for n in 2..=4 {
            let streak = |failure_streak| GateParams {
                failure_streak,
                ..GateParams::default()
            };
            if opens(authorise(&streak(n), switches, q)) {
                assert!(opens(authorise(&streak(n - 1), switches, q)), "{n} {q:?}");
            }
        }
    });
}

#[test]
fn inv_33_stronger_evidence_closes_nothing() {
    every_question(|switches, q| {
        let strong = Question { strong: true, ..*q };
        if opens(decide(switches, q)) {
            assert!(opens(decide(switches, &strong)), "{q:?}");
        }
    });
}

#[test]
fn the_gate_opens_exactly_when_nothing_keeps_it_closed() {
    every_question(|switches, q| {
        let kind = FailureKind::of(q.diagnosis);
        let streak = kind.is_some_and(|k| q.streaks.failures_of(k) >= 3);
        let target = kind == Some(FailureKind::Target)
            && (q.initial
                || (switches.target_corrector
                    && q.rebinds
                    && q.plan_certain
                    && (streak || q.strong)));
        let routine_on = match q.routine {
            Routine::Pick => switches.hard_pick,
            Routine::Place => switches.hard_place,
            Routine::Indirect => false,
        };
        let patient = streak && q.streaks.confident() >= 2 && !q.young && !q.progress;
        let execution = kind == Some(FailureKind::Execution)
            && switches.execution_corrector
            && routine_on
            && q.budget
            && !q.cooling
            && q.plan_certain
            && q.kappa >= 0.12
            && (patient || q.strong);
        let found = decide(switches, q);
        assert_eq!(matches!(found, Authorisation::Target(_)), target, "{q:?}");
        assert_eq!(
            matches!(found, Authorisation::Execution(_)),
            execution,
            "{q:?}"
        );
    });
}

/// Section 6 of the method, rule by rule, for any limits: what the gate says.
fn restated(limits: &GateParams, on: &Switches, q: &Question) -> Authorisation {
    use reason::*;
    let all = |rules: &[(bool, u64)]| {
        let held = rules.iter().filter(|(holds, _)| *holds);
        held.fold(0, |bits, (_, bit)| bits | bit)
    };
    let target = q.diagnosis == Diagnosis::TargetCorrection;
    let pick = q.diagnosis == Diagnosis::PickFailure;
    if !(target || pick || q.diagnosis == Diagnosis::PlaceFailure) {
        return Authorisation::Closed(0);
    }
    let kind = if target {
        FailureKind::Target
    } else {
        FailureKind::Execution
    };
    let run = match q.streaks.failure {
        Some((of, n)) if of == kind => u32::from(n),
        _ => 0,
    };
    let (long, sure) = (
        run >= limits.failure_streak,
        u32::from(q.streaks.confident) >= limits.confidence_streak,
    );
    let patient = !q.strong;
    if target && q.initial {
        Authorisation::Target(INITIAL_GROUNDING)
    } else if target {
        match all(&[
            (!on.target_corrector, SWITCHED_OFF),
            (!q.rebinds, BUDGET_SPENT),
            (!q.plan_certain, PLAN_UNCERTAIN),
            (patient && !long, STREAK_SHORT),
        ]) {
            0 => Authorisation::Target(all(&[(long, TARGET_STREAK), (q.strong, STRONG_EVIDENCE)])),
            shut => Authorisation::Closed(shut),
        }
    } else {
        let hard = match q.routine {
            Routine::Pick => on.hard_pick,
            Routine::Place | Routine::Indirect => on.hard_place,
        };
        let certain = q.kappa >= limits.confidence;
        match all(&[
            (!(on.execution_corrector && hard), SWITCHED_OFF),
            (q.routine == Routine::Indirect, DESTINATION_INDIRECT),
            (!q.budget, BUDGET_SPENT),
            (q.cooling, COOL_DOWN),
            (!q.plan_certain, PLAN_UNCERTAIN),
            (!certain, CONFIDENCE_LOW),
            (patient && !long, STREAK_SHORT),
            (patient && !sure, CONFIDENCE_STREAK_SHORT),
            (patient && q.young, ATTEMPT_YOUNG),
            (
                patient && q.progress && limits.progress_guard_steps != 0,
                PROGRESS,
            ),
        ]) {
            0 => Authorisation::Execution(all(&[
                (long && sure, EXECUTION_STREAK),
                (q.strong, STRONG_EVIDENCE),
            ])),
            shut => Authorisation::Closed(shut),
        }
    }
}

/// Gate and router, every state: each streak from none to one beyond its limit,
/// each kind of failure, each routine, trust, cool-down, budgets, switches.
#[test]
fn gate_and_router_do_what_the_rules_say_for_every_limit() {
    let mut states = 0_u64;
    let mut routes = [0_u64; 4];
    for (limit, trust, guard) in [(1, 1, 8), (2, 3, 0), (3, 2, 8), (4, 1, 0)] {
        let limits = GateParams {
            failure_streak: limit,
            confidence_streak: trust,
            progress_guard_steps: guard,
            ..GateParams::default()
        };
        let (most, sure) = (limit as u8 + 1, trust as u8 + 1);
        let of = |kind| (1..=most).map(move |n| Some((kind, n)));
        let failures = core::iter::once(None)
            .chain(of(FailureKind::Target))
            .chain(of(FailureKind::Execution));
        for failure in failures {
            for confident in 0..=sure {
                let streaks = Streaks { failure, confident };
                every_flag(streaks, |switches, q| {
                    let found = authorise(&limits, switches, q);
                    assert_eq!(found, restated(&limits, switches, q), "{limits:?} {q:?}");
                    for pending in [false, true] {
                        let expected = match found {
                            _ if pending => Route::Pending,
                            Authorisation::Target(_) => Route::Target,
                            Authorisation::Execution(_) => Route::Execution,
                            Authorisation::Closed(_) => Route::Base,
                        };
                        let route = route(pending, found);
                        assert_eq!(route, expected, "{q:?}");
                        routes[usize::from(route.code())] += 1;
                        states += 1;
                    }
                });
            }
        }
    }
    assert_eq!(
        states,
        2 * (5 * 3 + 7 * 5 + 9 * 4 + 11 * 3) * 16 * 6 * 3 * 256 * 3
    );
    assert!(routes.iter().all(|n| *n > 10_000), "{routes:?}");
}

/// Everything that a question may hold besides its streaks.
fn every_flag(streaks: Streaks, mut look: impl FnMut(&Switches, &Question)) {
    for (bits, &diagnosis) in (0..SWITCHES).flat_map(|b| Diagnosis::ALL.iter().map(move |d| (b, d)))
    {
        for kappa in [f64::NAN, 0.119_999, 0.12] {
            for (flags, routine) in (0..256_u16).flat_map(|f| ROUTINES.map(|r| (f, r))) {
                let flag = |n: u16| flags >> n & 1 == 1;
                look(
                    &switches(bits),
                    &Question {
                        diagnosis,
                        strong: flag(0),
                        initial: flag(1),
                        streaks,
                        kappa,
                        young: flag(2),
                        progress: flag(3),
                        cooling: flag(4),
                        budget: flag(5),
                        rebinds: flag(6),
                        plan_certain: flag(7),
                        routine,
                    },
                );
            }
        }
    }
}

#[test]
fn the_reasons_name_each_lock_on_the_gate() {
    use reason::*;
    every_question(|switches, q| {
        let Authorisation::Closed(bits) = decide(switches, q) else {
            return;
        };
        match FailureKind::of(q.diagnosis) {
            None => assert_eq!(bits, 0),
            Some(FailureKind::Target) => {
                let has = |bit| bits & bit != 0;
                assert_eq!(has(SWITCHED_OFF), !switches.target_corrector);
                assert_eq!(has(BUDGET_SPENT), !q.rebinds);
                assert_eq!(has(PLAN_UNCERTAIN), !q.plan_certain);
                let short = q.streaks.failures_of(FailureKind::Target) < 3;
                assert_eq!(has(STREAK_SHORT), short && !q.strong);
                let known = SWITCHED_OFF | BUDGET_SPENT | PLAN_UNCERTAIN | STREAK_SHORT;
                assert_eq!(bits & !known, 0);
            }
            Some(FailureKind::Execution) => {
                let has = |bit| bits & bit != 0;
                assert_eq!(has(DESTINATION_INDIRECT), q.routine == Routine::Indirect);
                assert_eq!(has(BUDGET_SPENT), !q.budget);
                assert_eq!(has(COOL_DOWN), q.cooling);
                assert_eq!(has(PLAN_UNCERTAIN), !q.plan_certain);
                assert_eq!(has(CONFIDENCE_LOW), q.kappa.is_nan() || q.kappa < 0.12);
                let short = q.streaks.failures_of(FailureKind::Execution) < 3;
                assert_eq!(has(STREAK_SHORT), short && !q.strong);
                let unsure = q.streaks.confident() < 2;
                assert_eq!(has(CONFIDENCE_STREAK_SHORT), unsure && !q.strong);
                assert_eq!(has(ATTEMPT_YOUNG), q.young && !q.strong);
                assert_eq!(has(PROGRESS), q.progress && !q.strong);
            }
        }
    });
}

#[test]
fn inv_23_and_24_streaks_count_restart_clear_and_saturate() {
    let params = GateParams::default();
    let mut states = 0;
    for kind in [
        None,
        Some(FailureKind::Target),
        Some(FailureKind::Execution),
    ] {
        for n in 0..=u8::MAX {
            for confident in [0, 1, 254, 255] {
                let before = Streaks {
                    failure: kind.map(|k| (k, n)),
                    confident,
                };
                for &diagnosis in Diagnosis::ALL {
                    for kappa in KAPPAS {
                        let mut after = before;
                        after.count(&params, diagnosis, kappa);
                        let now = FailureKind::of(diagnosis);
                        let expected = match now {
                            None => 0,
                            Some(k) if kind == Some(k) && n == u8::MAX => u8::MAX,
                            Some(k) if kind == Some(k) => n + 1,
                            Some(_) => 1,
                        };
                        assert_eq!(after.failures(), expected);
                        for k in [FailureKind::Target, FailureKind::Execution] {
                            let of = if now == Some(k) { expected } else { 0 };
                            assert_eq!(after.failures_of(k), of);
                        }
                        let sure = if kappa >= 0.12 {
                            confident.saturating_add(1)
                        } else {
                            0
                        };
                        assert_eq!(after.confident(), sure);
                        states += 1;
                    }
                }
            }
        }
    }
    assert_eq!(states, 3 * 256 * 4 * 6 * 5);
}
