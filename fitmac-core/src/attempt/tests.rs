//! The events of an attempt, each at the limit that makes it one.

use super::*;
use crate::{
    evidence::*,
    monitor::Monitor,
    signals::{DestinationView, OtherView, TargetView},
    stand::{hand, surface, target},
    wire::Phase,
};

/// Limits that a binary fraction meets exactly.
fn params() -> Params {
    let mut params = Params::guarded();
    params.gripper.held_radius_m = 0.25;
    params.phase.lifted_m = 0.25;
    params.evidence = EvidenceParams {
        wrong_target_margin_m: 0.25,
        wrong_target_distance_m: 0.5,
        wrong_target_steps: 3,
        moving_away_m: 0.25,
        moving_away_steps: 2,
        dropped_m: 0.25,
        wrong_destination_steps: 2,
        wrong_destination_xy_m: 0.5,
        wrong_destination_drop_m: 0.25,
        wrong_destination_away_m: 0.375,
        rest_distance_m: 0.25,
        rest_steps: 2,
        ..params.evidence
    };
    params
}

/// A hand that sees the target this far away.
fn sees(state: GripperState, distance_m: f64) -> Signals {
    Signals {
        target: Some(TargetView {
            distance_m,
            ..target([0.0; 3])
        }),
        ..hand([0.0; 3], state)
    }
}

/// And another instance, so far away and so high.
fn sees_another(state: GripperState, distance_m: f64, other_m: f64, z_m: f64) -> Signals {
    Signals {
        other: Some(OtherView {
            id: 2,
            distance_m: other_m,
            position_m: [0.0, 0.0, z_m],
        }),
        ..sees(state, distance_m)
    }
}

/// An attempt under way, with all that it looks at.
struct Stand {
    params: Params,
    attempt: Attempt,
    monitor: Monitor,
    estimator: PhaseEstimator,
    verdict: Verdict,
}

impl Stand {
    fn new() -> Self {
        Self {
            params: params(),
            attempt: Attempt::first(),
            monitor: Monitor::new(),
            estimator: PhaseEstimator::new(),
            verdict: Verdict::Unknown,
        }
    }

    /// What one step adds, the estimator aside.
    fn step(&mut self, signals: &Signals) -> u64 {
        self.monitor.step(&self.params, Phase::Approach, 1, signals);
        self.attempt.clear_latched();
        self.attempt.step(
            &self.params,
            signals,
            &self.estimator,
            self.monitor.history(),
            self.verdict,
        );
        self.attempt.latched()
    }

    /// The estimator follows, too.
    fn follow(&mut self, signals: &Signals) -> u64 {
        self.estimator.step(&self.params.phase, signals);
        self.step(signals)
    }
}

#[test]
fn evidence_that_awaits_a_query_outlives_its_attempt_and_nothing_else_does() {
    let mut stand = Stand::new();
    stand.step(&sees(GripperState::Open, 1.0));
    stand.step(&sees(GripperState::Empty, 1.0));
    assert!(stand.attempt.has_acted());
    let mut attempt = stand.attempt;
    attempt.latched = DROPPED;
    attempt.next();
    let fresh = Attempt {
        latched: DROPPED,
        ..Attempt::numbered(2)
    };
    assert_eq!(attempt, fresh);
}

#[test]
fn evidence_adds_up_until_the_query() {
    let mut stand = Stand::new();
    stand.attempt.latched = DROPPED;
    let monitor = Monitor::new();
    for _ in 0..3 {
        let signals = sees_another(GripperState::Open, 1.0, 0.375, 0.0);
        stand.attempt.step(
            &stand.params,
            &signals,
            &stand.estimator,
            monitor.history(),
            Verdict::Unknown,
        );
    }
    assert_eq!(stand.attempt.latched(), DROPPED | WRONG_TARGET);
    assert_eq!(stand.attempt.steps(), 3);
}

#[test]
fn only_a_hand_that_was_seen_open_can_grasp_nothing() {
    let mut stand = Stand::new();
    let empty = sees(GripperState::Empty, 1.0);
    assert_eq!(stand.step(&empty), 0, "a gripper that starts closed");
    assert!(!stand.attempt.has_acted());
    assert_eq!(stand.step(&sees(GripperState::Open, 1.0)), 0);
    assert!(!stand.attempt.has_acted());
    assert_eq!(stand.step(&sees(GripperState::Closing, 1.0)), 0);
    assert!(!stand.attempt.has_acted());
    assert_eq!(stand.step(&empty), EMPTY_GRASP);
    assert!(stand.attempt.has_acted());
    stand.step(&sees(GripperState::Open, 1.0));
    assert!(stand.attempt.has_acted(), "what was done stays done");
}

#[test]
fn another_instance_is_approached_when_it_is_nearer_by_more_than_the_margin_and_near() {
    for (target_m, other_m, wrong) in [
        (0.626, 0.375, true),
        (0.625, 0.375, false),
        (1.0, 0.499, true),
        (1.0, 0.5, false),
    ] {
        let mut stand = Stand::new();
        for step in 1..=4 {
            let bits = stand.step(&sees_another(GripperState::Open, target_m, other_m, 0.0));
            let expected = if wrong && step >= 3 { WRONG_TARGET } else { 0 };
            assert_eq!(bits & WRONG_TARGET, expected, "{target_m} {other_m} {step}");
        }
    }
}

#[test]
fn an_approach_ends_where_it_recedes_from_its_nearest_or_the_instance_changes() {
    let look = |other_m: [f64; 3], id: ObjectId| {
        let mut stand = Stand::new();
        let mut last = 0;
        for (n, other_m) in other_m.into_iter().enumerate() {
            let mut signals = sees_another(GripperState::Open, 1.0, other_m, 0.0);
            if n == 2
                && let Some(other) = &mut signals.other
            {
                other.id = id;
            }
            last = stand.step(&signals) & WRONG_TARGET;
        }
        last
    };
    assert_eq!(look([0.25, 0.25, 0.25], 2), WRONG_TARGET);
    assert_eq!(look([0.25, 0.25, 0.25], 3), 0, "another one");
    assert_eq!(look([0.25, 0.25, 0.269], 2), WRONG_TARGET, "noise");
    assert_eq!(look([0.25, 0.25, 0.25 + RECEDING_M], 2), 0);
    assert_eq!(look([0.25, 0.26, 0.269], 2), WRONG_TARGET);
    assert_eq!(look([0.25, 0.26, 0.275], 2), 0, "the nearest counts");
}

#[test]
fn another_object_is_held_when_it_rises_with_the_closed_hand() {
    let rises = |state, other_m, z_m: f64| {
        let mut stand = Stand::new();
        stand.step(&sees_another(state, 0.5, other_m, 1.0));
        stand.step(&sees_another(state, 0.5, other_m, 1.0 + z_m)) & WRONG_OBJECT_HELD
    };
    assert_eq!(
        rises(GripperState::Holding, 0.125, 0.251),
        WRONG_OBJECT_HELD
    );
    assert_eq!(rises(GripperState::Holding, 0.125, 0.25), 0);
    assert_eq!(rises(GripperState::Open, 0.125, 0.5), 0);
    assert_eq!(
        rises(GripperState::Holding, 0.25, 0.5),
        0,
        "not in the hand"
    );
    let mut stand = Stand::new();
    stand.step(&sees_another(GripperState::Holding, 0.125, 0.125, 1.0));
    assert_eq!(
        stand.attempt.held_other(),
        None,
        "no nearer than the target"
    );
    stand.step(&sees_another(GripperState::Holding, 0.126, 0.125, 1.0));
    assert_eq!(stand.attempt.held_other(), Some((2, 1.0)));
    // Another one that is higher has not risen.
    let mut third = sees_another(GripperState::Holding, 0.5, 0.125, 2.0);
    third.other = third.other.map(|o| OtherView { id: 3, ..o });
    assert_eq!(stand.step(&third) & WRONG_OBJECT_HELD, 0);
    assert_eq!(stand.attempt.held_other(), Some((3, 2.0)));
}

#[test]
fn an_open_hand_that_draws_back_by_more_than_the_limit_moves_away() {
    let away = |state, m: f64| {
        let mut stand = Stand::new();
        for distance_m in [0.5, 0.5, 0.5 + m] {
            stand.step(&sees(state, distance_m));
        }
        stand.attempt.latched() & MOVING_AWAY
    };
    assert_eq!(away(GripperState::Open, 0.251), MOVING_AWAY);
    assert_eq!(away(GripperState::Open, 0.25), 0);
    assert_eq!(away(GripperState::Closing, 0.5), 0);
}

/// The hand at the height `ee_m`, the target at `z_m`, this far from its destination.
fn carries(state: GripperState, ee_m: f64, z_m: f64, xy_m: f64) -> Signals {
    Signals {
        target: Some(target([0.0, 0.0, z_m])),
        destination: Some(DestinationView {
            distance_xy_m: xy_m,
            ..surface([0.0; 3])
        }),
        ..hand([0.0, 0.0, ee_m], state)
    }
}

/// The target lifted by a metre, the hand a quarter above it.
fn carrying() -> Stand {
    let mut stand = Stand::new();
    stand.follow(&carries(GripperState::Open, 0.25, 0.0, 1.0));
    for _ in 0..6 {
        stand.follow(&carries(GripperState::Holding, 1.25, 1.0, 1.0));
    }
    assert!(stand.estimator.is_lifted());
    assert_eq!(stand.estimator.phase(), Phase::Transport);
    stand
}

#[test]
fn what_hangs_lower_in_the_hand_by_more_than_the_limit_has_dropped() {
    let fell = |z_m| {
        let mut stand = carrying();
        stand.follow(&carries(GripperState::Holding, 1.25, z_m, 1.0)) & DROPPED
    };
    assert_eq!(fell(0.749), DROPPED);
    assert_eq!(fell(0.75), 0);
    let mut stand = carrying();
    let together = carries(GripperState::Holding, 0.5, 0.25, 1.0);
    assert_eq!(stand.follow(&together) & DROPPED, 0, "lowered by the hand");
}

#[test]
fn what_is_lowered_beside_its_destination_strays() {
    let lowered = |z_m: f64, xy_m| {
        let mut stand = carrying();
        let signals = carries(GripperState::Holding, z_m + 0.25, z_m, xy_m);
        stand.follow(&signals);
        assert_eq!(stand.attempt.latched() & WRONG_DESTINATION, 0, "one step");
        stand.follow(&signals) & WRONG_DESTINATION
    };
    assert_eq!(lowered(0.749, 0.501), WRONG_DESTINATION);
    assert_eq!(lowered(0.75, 0.501), 0);
    assert_eq!(lowered(0.749, 0.5), 0);
}

#[test]
fn what_is_carried_away_from_where_it_came_nearest_strays() {
    let away = |patience, steps, xy_m: f64| {
        let mut stand = carrying();
        stand.params.evidence.wrong_destination_steps = patience;
        stand.follow(&carries(GripperState::Holding, 1.25, 1.0, 0.125));
        for _ in 0..steps {
            stand.follow(&carries(GripperState::Holding, 1.25, 1.0, xy_m));
        }
        stand.attempt.latched() & WRONG_DESTINATION
    };
    assert_eq!(away(2, 2, 0.501), WRONG_DESTINATION);
    assert_eq!(away(2, 1, 0.501), 0);
    assert_eq!(away(2, 2, 0.5), 0);
    assert_eq!(away(0, 5, 0.9), 0, "switched off");
}

/// Lets go at the origin, then moves the target by `by_m` in each step, so high above the surface.
fn released(by_m: f64, clearance_m: f64, verdict: Verdict, steps: u32) -> (u64, Stand) {
    let mut stand = carrying();
    stand.verdict = verdict;
    for _ in 0..4 {
        stand.follow(&carries(GripperState::Holding, 1.25, 1.0, 0.0));
    }
    let mut bits = 0;
    for n in 0..steps {
        let mut signals = carries(GripperState::Open, 1.25, 0.0, 0.0);
        if let (Some(t), Some(d)) = (&mut signals.target, &mut signals.destination) {
            t.position_m[0] = f64::from(n) * by_m;
            d.clearance_m = clearance_m;
            d.half_extent_m = [8.0, 8.0, 0.0];
        }
        bits = stand.follow(&signals);
    }
    (bits, stand)
}

#[test]
fn what_was_let_go_is_judged_once_it_rests() {
    let judged = |by_m, clearance_m, verdict, steps| {
        let (bits, _) = released(by_m, clearance_m, verdict, steps);
        bits & (VERIFIER_NEGATIVE | MISPLACED)
    };
    let both = VERIFIER_NEGATIVE | MISPLACED;
    let unknown = Verdict::Unknown;
    // Four steps after it moved, and two more.
    assert_eq!(judged(0.0, 0.5, unknown, 5), 0);
    assert_eq!(judged(0.0, 0.5, unknown, 6), both);
    assert_eq!(judged(0.0, 0.0, unknown, 6), 0, "in its place");
    assert_eq!(judged(0.0, 0.5, Verdict::Success, 6), 0);
    assert_eq!(judged(0.0, 0.0, Verdict::Fail, 6), VERIFIER_NEGATIVE);
    assert_eq!(
        judged(0.0624, 0.5, unknown, 6),
        both,
        "slower than the limit"
    );
    assert_eq!(
        judged(0.0625, 0.5, unknown, 20),
        0,
        "a quarter in four steps"
    );
}

#[test]
fn what_rests_in_its_region_is_placed() {
    let placed = |clearance_m, steps| {
        let (_, stand) = released(0.0, clearance_m, Verdict::Unknown, steps);
        let mut signals = carries(GripperState::Open, 1.25, 0.0, 0.0);
        if let Some(d) = &mut signals.destination {
            d.clearance_m = clearance_m;
        }
        stand.attempt.is_placed(&stand.params.evidence, &signals)
    };
    assert!(placed(0.0, 6));
    assert!(!placed(0.0, 5), "not at rest yet");
    assert!(!placed(0.5, 6), "held above");
}

#[test]
fn a_region_ends_at_its_edges_its_surface_and_its_rim() {
    let inside = |relation, [x, y, z]: [f64; 3], clearance_m| {
        let signals = Signals {
            target: Some(TargetView {
                half_height_m: 0.125,
                ..target([x, y, z])
            }),
            destination: Some(DestinationView {
                relation,
                half_extent_m: [0.5, 0.25, 0.5],
                clearance_m,
                ..surface([1.0, 0.0, 1.0])
            }),
            ..hand([0.0; 3], GripperState::Open)
        };
        in_region(&signals)
    };
    let on = |at, clearance_m| inside(PlaceRelation::On, at, clearance_m);
    assert_eq!(on([1.5, 0.25, 1.0], 0.0), Some(true));
    assert_eq!(on([0.5, -0.25, 1.0], 0.0), Some(true));
    assert_eq!(on([1.501, 0.25, 1.0], 0.0), Some(false));
    assert_eq!(on([1.5, 0.251, 1.0], 0.0), Some(false));
    for (clearance_m, level) in [(-0.02, false), (-0.019, true), (0.029, true), (0.03, false)] {
        assert_eq!(
            on([1.0, 0.0, 1.0], clearance_m),
            Some(level),
            "{clearance_m}"
        );
    }
    let within = |z| inside(PlaceRelation::In, [1.0, 0.0, z], 0.0);
    for (z, level) in [(1.0, false), (0.999, true), (0.376, true), (0.375, false)] {
        assert_eq!(within(z), Some(level), "{z}");
    }
    assert_eq!(in_region(&hand([0.0; 3], GripperState::Open)), None);
}

impl Attempt {
    /// The same with this evidence waiting for a query.
    pub(crate) fn with(self, latched: u64) -> Self {
        Self { latched, ..self }
    }
}
