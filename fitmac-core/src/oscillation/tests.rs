//! Turns and what they came to, at their limits.

use super::*;

fn params(reversals: u32, reversal_window_steps: u32) -> Progress {
    Progress {
        reversals,
        reversal_window_steps,
        reversal_net_m: 0.25,
        ..Progress::default()
    }
}

/// The steps, from 1, in which an arm on a line at these places, a metre from its goal all the
/// time, is said to swing.
fn swings(params: &Progress, places: impl IntoIterator<Item = f64>) -> u64 {
    let mut oscillation = Oscillation::new();
    let mut steps = 0;
    for (step, x) in places.into_iter().enumerate() {
        if oscillation.step(params, [x, 0.0, 0.0], Some(1.0)) {
            steps |= 1 << step;
        }
    }
    steps
}

#[test]
fn a_turn_is_a_stride_against_the_last_one() {
    let wide = params(1, 64);
    assert_eq!(swings(&wide, [0.0, 0.5, 0.0]), 0b100);
    assert_eq!(swings(&wide, [0.0, 0.5, 0.25, 0.0]), 0b1100, "one turn");
    assert_eq!(swings(&wide, [0.0, 0.25, 0.5, 1.0]), 0);
    assert_eq!(swings(&wide, [0.0, STRIDE_M, 0.0]), 0b100, "just a stride");
    // What is shorter than a stride has no direction; it adds up from where the last one ended.
    let short = 0.99 * STRIDE_M;
    assert_eq!(swings(&wide, [0.0, 0.5, 0.5 - short, 0.5, 1.0]), 0);
    assert_eq!(
        swings(&wide, [0.0, 0.5, 0.5 - short, 0.5 - STRIDE_M]),
        0b1000
    );
    let mut sideways = Oscillation::new();
    for ee_m in [[0.0; 3], [0.5, 0.0, 0.0], [0.5, 0.5, 0.0]] {
        assert!(!sideways.step(&wide, ee_m, Some(1.0)), "a right angle");
    }
}

#[test]
fn so_many_turns_within_the_window_are_a_swing() {
    let to_and_fro = |n: usize| (0..n).map(|n| if n % 2 == 0 { 0.0 } else { 0.5 });
    // The first turn is in the third step.
    assert_eq!(swings(&params(3, 64), to_and_fro(6)), 0b11_0000);
    assert_eq!(swings(&params(0, 64), to_and_fro(6)), 0, "switched off");
    // One turn, then none: it leaves the window of four steps with the fifth.
    let once = [0.0, 0.5, 0.0, -0.5, -1.0, -1.5, -2.0, -2.5];
    assert_eq!(swings(&params(1, 4), once), 0b11_1100);
}

#[test]
fn an_arm_that_gets_nearer_by_the_net_way_does_not_swing() {
    let swings = |start_m, now_m| {
        let mut oscillation = Oscillation::new();
        let params = params(1, 64);
        oscillation.step(&params, [0.0; 3], start_m);
        oscillation.step(&params, [0.5, 0.0, 0.0], start_m);
        oscillation.step(&params, [0.0; 3], now_m)
    };
    assert!(swings(Some(1.0), Some(0.751)));
    assert!(!swings(Some(1.0), Some(0.75)));
    assert!(!swings(None, Some(1.0)) && !swings(Some(1.0), None));
}

#[test]
fn how_far_one_got_is_measured_over_one_to_two_windows() {
    let mut oscillation = Oscillation::new();
    let params = params(1, 3);
    let distances_m = [1.0, 0.9, 0.8, 0.7, 0.7, 0.7, 0.7, 0.7];
    let found = distances_m.map(|distance_m| {
        let x = if oscillation.from_m == Some([0.0; 3]) {
            0.5
        } else {
            0.0
        };
        oscillation.step(&params, [x, 0.0, 0.0], Some(distance_m))
    });
    // Windows start at steps 0, 3 and 6: from 1.0 to 0.7 it got on, from 0.7 it did not.
    assert_eq!(found, [false, false, true, false, false, false, true, true]);
}
