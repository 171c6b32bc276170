//! The monitor against a naive oracle that keeps everything.

extern crate std;

use std::vec::Vec;

use super::*;
use crate::{
    params::Gripper,
    signals::{DestinationView, GripperState, GripperView, TargetView},
    wire::{GraspClass, PlaceRelation},
};
use kinematics::rotation::UnitQuaternion;

/// A small generator: the core has no dependency on one.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % sides
    }
}

/// One step as the oracle remembers it, millimetres on a line.
#[derive(Clone, Copy)]
struct Seen {
    ee: f64,
    object: Option<f64>,
    destination: bool,
}

fn signals(seen: &Seen) -> Signals {
    let target = seen.object.map(|x| TargetView {
        id: 1,
        position_m: [x, 0.0, 0.0],
        orientation: UnitQuaternion::IDENTITY,
        half_extent_m: [0.0; 3],
        half_height_m: 0.0,
        depth_m: 0.0,
        class: GraspClass::Can,
        distance_m: (seen.ee - x).abs(),
        distance_xy_m: (seen.ee - x).abs(),
        height_m: 0.0,
    });
    let destination = seen
        .object
        .filter(|_| seen.destination)
        .map(|x| DestinationView {
            position_m: [1.0, 0.0, 0.0],
            half_extent_m: [0.0; 3],
            relation: PlaceRelation::On,
            distance_m: (1.0 - x).abs(),
            distance_xy_m: (1.0 - x).abs(),
            clearance_m: 0.0,
        });
    Signals {
        ee_m: [seen.ee, 0.0, 0.0],
        gripper: GripperView {
            width_m: Gripper::default().open_width_m,
            state: GripperState::Open,
        },
        target,
        destination,
        other: None,
    }
}

/// Equation 5, from the definitions; `None` where a pose is missing.
fn progressed(log: &[Seen], phase: Phase, p: &Progress) -> Option<bool> {
    let now = log.last()?;
    let then = log.get(log.len().checked_sub(1 + p.delta_steps as usize)?)?;
    let picking = matches!(phase, Phase::Approach | Phase::Grasp | Phase::Lift);
    if picking {
        let nearer = (then.ee - then.object?).abs() - (now.ee - now.object?).abs();
        Some(nearer > p.target_m || (now.ee - then.ee).abs() > p.end_effector_m)
    } else {
        let (was, is) = (then.object?, now.object?);
        let nearer = if then.destination && now.destination {
            (1.0 - was).abs() - (1.0 - is).abs()
        } else {
            0.0
        };
        Some(nearer > p.destination_m || (is - was).abs() > p.object_m)
    }
}

#[test]
fn inv_36_and_39_a_stall_is_w_known_steps_without_progress_in_this_phase() {
    let mut dice = Dice(36);
    let mut params = Params::guarded();
    params.progress.reversals = 0;
    let (mut stalls, mut unknown) = (0, 0);
    for _ in 0..3000 {
        params.progress.delta_steps = 1 + dice.roll(8) as u32;
        let mut monitor = Monitor::new();
        let mut log: Vec<Seen> = Vec::new();
        let mut verdicts: Vec<Option<bool>> = Vec::new();
        let mut phase = Phase::ALL[dice.roll(7) as usize];
        let (mut ee, mut object) = (0.0, 0.3);
        let mut steps = 0;
        let lazy = dice.roll(4);
        for _ in 0..60 {
            if dice.roll(25) == 0 {
                phase = Phase::ALL[dice.roll(7) as usize];
                monitor.enter_phase();
                verdicts.clear();
                steps = 0;
            }
            if dice.roll(60) == 0 {
                monitor.forget();
                log.clear();
                verdicts.clear();
            }
            if dice.roll(4) > lazy {
                ee += 0.001 * (dice.roll(7) as f64 - 3.0);
                object += 0.001 * (dice.roll(7) as f64 - 3.0);
            }
            let seen = Seen {
                ee,
                object: (dice.roll(20) != 0).then_some(object),
                destination: dice.roll(5) != 0,
            };
            log.push(seen);
            steps += 1;
            let bits = monitor.step(&params, phase, steps, &signals(&seen));
            let verdict = progressed(&log, phase, &params.progress);
            verdicts.push(verdict);
            unknown += u32::from(verdict.is_none());
            let known: Vec<bool> = verdicts.iter().flatten().copied().collect();
            let w = patience(&params.patience, phase) as usize;
            let stalled = known.len() >= w && known[known.len() - w..].iter().all(|p| !p);
            assert_eq!(bits & evidence::STALL != 0, stalled);
            assert_eq!(bits & evidence::PROGRESS != 0, verdict == Some(true));
            stalls += u32::from(stalled);
        }
    }
    assert!(stalls > 1000 && unknown > 1000, "{stalls} {unknown}");
}

#[test]
fn inv_37_a_phase_times_out_after_its_last_allowed_step() {
    let params = Params::guarded();
    for &phase in Phase::ALL {
        let t = timeout(&params.timeout, phase);
        for (steps, expected) in [
            (0, false),
            (1, false),
            (t, false),
            (t.wrapping_add(1), true),
        ] {
            let seen = Seen {
                ee: 0.0,
                object: None,
                destination: false,
            };
            let bits = Monitor::new().step(&params, phase, steps, &signals(&seen));
            let expected = expected && phase != Phase::Complete;
            assert_eq!(bits & evidence::TIMEOUT != 0, expected, "{phase} {steps}");
        }
    }
}

/// Feeds a path along x and returns the step at which an oscillation shows.
fn first_reversal(params: &Params, path: impl Iterator<Item = f64>) -> Option<usize> {
    let mut monitor = Monitor::new();
    path.enumerate().find_map(|(n, ee)| {
        let seen = Seen {
            ee,
            object: Some(1.0),
            destination: false,
        };
        let bits = monitor.step(params, Phase::Approach, n as u32, &signals(&seen));
        (bits & evidence::REVERSAL != 0).then_some(n)
    })
}

#[test]
fn an_arm_that_swings_makes_progress_by_equation_5_but_oscillates() {
    let params = Params::guarded();
    let swing = (0..40).map(|n| if n / 2 % 2 == 0 { 0.0 } else { 0.05 });
    // Six turns, two steps apart, and back where it began.
    assert_eq!(first_reversal(&params, swing.clone()), Some(16));
    let approach = (0..40).map(|n| 0.01 * f64::from(n));
    assert_eq!(first_reversal(&params, approach), None);
    // Two steps on, one back: it turns, and it arrives.
    let staggering = (0..40).map(|n| 0.01 * f64::from(n / 3 + [0, 2, 1][n as usize % 3]));
    assert_eq!(first_reversal(&params, staggering), None);
    let off = Params::paper();
    assert_eq!(first_reversal(&off, swing), None);
}

#[test]
fn the_history_holds_the_newest_nine_steps() {
    let mut monitor = Monitor::new();
    let params = Params::guarded();
    assert!(monitor.history().is_empty());
    for n in 0..20_u32 {
        let seen = Seen {
            ee: f64::from(n),
            object: None,
            destination: false,
        };
        monitor.step(&params, Phase::Approach, n, &signals(&seen));
        assert_eq!(monitor.history().len(), (n as usize + 1).min(HISTORY));
        for ago in 0..12 {
            let expected = n.checked_sub(ago).filter(|_| ago < HISTORY as u32);
            let found = monitor.history().ago(ago).map(|s| s.ee_m[0] as u32);
            assert_eq!(found, expected, "{n} {ago}");
        }
    }
}

#[test]
fn patience_and_time_out_are_looked_up_by_phase() {
    let params = Params::guarded();
    let found: Vec<_> = Phase::ALL
        .iter()
        .map(|&p| (patience(&params.patience, p), timeout(&params.timeout, p)))
        .collect();
    let expected = [
        (16, 80),
        (12, 30),
        (8, 20),
        (16, 60),
        (12, 30),
        (8, 12),
        (10, 20),
        (u32::MAX, u32::MAX),
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_history_is_empty_until_a_step_was_noted_and_no_longer_once_it_is_forgotten() {
    let mut monitor = Monitor::new();
    assert!(monitor.history().is_empty());
    let seen = signals(&Seen {
        ee: 0.0,
        object: None,
        destination: false,
    });
    monitor.step(&Params::guarded(), Phase::Approach, 1, &seen);
    assert!(!monitor.history().is_empty());
    monitor.forget();
    assert!(monitor.history().is_empty());
}

/// Whether a step from the first to the second is progress; the limits are a quarter of a metre.
fn is_progress(phase: Phase, then: &Signals, now: &Signals) -> bool {
    let mut params = Params::guarded();
    params.progress.delta_steps = 1;
    params.progress.target_m = 0.25;
    params.progress.end_effector_m = 0.25;
    params.progress.destination_m = 0.25;
    params.progress.object_m = 0.25;
    let mut monitor = Monitor::new();
    monitor.step(&params, phase, 1, then);
    monitor.step(&params, phase, 2, now) & evidence::PROGRESS != 0
}

#[test]
fn progress_is_more_than_the_limit() {
    let at = |ee: f64, away: f64, object: f64, left: f64| {
        let mut signals = signals(&Seen {
            ee,
            object: Some(object),
            destination: true,
        });
        if let (Some(t), Some(d)) = (&mut signals.target, &mut signals.destination) {
            t.distance_m = away;
            d.distance_m = left;
        }
        signals
    };
    let start = at(0.0, 1.0, 0.0, 1.0);
    let more = 0.251;
    for phase in [Phase::Approach, Phase::Grasp, Phase::Lift] {
        let progress = |now| is_progress(phase, &start, &now);
        assert!(!progress(at(0.25, 0.75, 1.0, 0.0)), "{phase}");
        assert!(progress(at(more, 1.0, 0.0, 1.0)), "{phase}: the hand moved");
        assert!(progress(at(0.0, 1.0 - more, 0.0, 1.0)), "{phase}: nearer");
    }
    for phase in [
        Phase::Transport,
        Phase::Descend,
        Phase::Release,
        Phase::Stabilise,
    ] {
        let progress = |now| is_progress(phase, &start, &now);
        assert!(!progress(at(1.0, 0.0, 0.25, 0.75)), "{phase}");
        assert!(progress(at(0.0, 1.0, more, 1.0)), "{phase}: it moved");
        assert!(progress(at(0.0, 1.0, 0.0, 1.0 - more)), "{phase}: nearer");
    }
}
