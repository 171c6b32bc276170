//! The last filter at its limits.

use super::*;

const DT_S: f64 = 0.5;

/// A metre each way, and limits that are met exactly.
fn limits() -> Filter {
    Filter {
        velocity_m_s: 1.0,
        acceleration_m_s2: 4.0,
        jerk_m_s3: 16.0,
        workspace_min_x_m: -1.0,
        workspace_min_y_m: -1.0,
        workspace_min_z_m: -1.0,
        workspace_max_x_m: 1.0,
        workspace_max_y_m: 1.0,
        workspace_max_z_m: 1.0,
    }
}

fn scale() -> ActionScale {
    ActionScale {
        translation_m: 0.5,
        ..ActionScale::default()
    }
}

#[test]
fn an_action_reaches_the_edge_of_the_workspace_and_no_farther() {
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let limited = |ee: f64, x: f64| {
                let (mut ee_m, mut wanted) = ([0.0; 3], [0.0; 7]);
                (ee_m[axis], wanted[axis]) = (side * ee, side * x);
                let out = limit_action(&scale(), &limits(), ee_m, 1.0, &wanted);
                (side * out.value[axis], out.limited)
            };
            assert_eq!(limited(0.5, 1.0), (1.0, false), "to the edge");
            assert_eq!(limited(0.75, 1.0), (0.5, true), "half of the way is left");
            assert_eq!(limited(1.0, 1.0), (0.0, true));
            assert_eq!(limited(1.5, 0.5), (0.0, true), "outside already");
            assert_eq!(limited(1.5, -0.5), (-0.5, false), "back inwards");
            assert_eq!(limited(0.0, 1.5), (1.0, true), "the action box");
        }
    }
}

#[test]
fn a_setpoint_within_all_limits_passes_as_it_is() {
    let now = Commanded::at_rest([0.0; 3]);
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let passes = |p: f64, v: f64, a: f64| {
                let mut wanted = now;
                wanted.position_m[axis] = side * p;
                wanted.velocity_m_s[axis] = side * v;
                wanted.acceleration_m_s2[axis] = side * a;
                let out = now.step(&limits(), &wanted, DT_S);
                assert!(out.limited || out.value == wanted);
                !out.limited
            };
            assert!(passes(0.5, 1.0, 4.0), "each at its limit");
            assert!(!passes(0.501, 0.0, 0.0), "a step too far");
            assert!(!passes(0.0, 1.001, 0.0), "too fast");
            assert!(!passes(0.0, 0.0, 4.001), "too much acceleration");
        }
    }
    let brisk = Filter {
        velocity_m_s: 3.0,
        ..limits()
    };
    let mut wanted = now;
    wanted.velocity_m_s = [2.0, 0.0, 0.0];
    assert!(!now.step(&brisk, &wanted, DT_S).limited);
    wanted.velocity_m_s = [2.001, 0.0, 0.0];
    assert!(
        now.step(&brisk, &wanted, DT_S).limited,
        "the velocity leaps"
    );
    let smooth = Filter {
        jerk_m_s3: 4.0,
        ..limits()
    };
    wanted = now;
    wanted.acceleration_m_s2 = [2.0, 0.0, 0.0];
    assert!(!now.step(&smooth, &wanted, DT_S).limited);
    wanted.acceleration_m_s2 = [2.001, 0.0, 0.0];
    assert!(now.step(&smooth, &wanted, DT_S).limited, "the jerk");
}

#[test]
fn without_time_nothing_moves() {
    let now = Commanded::at_rest([0.25; 3]);
    let wanted = Commanded::at_rest([0.5; 3]);
    for dt_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let out = now.step(&limits(), &wanted, dt_s);
        assert_eq!((out.value, out.limited), (now, true), "{dt_s}");
        assert!(!now.step(&limits(), &now, dt_s).limited);
    }
}

#[test]
fn what_asks_too_much_gets_the_jerk_then_the_acceleration_then_the_velocity() {
    let from = |p: f64, v: f64, a: f64| Commanded {
        position_m: [p, 0.0, 0.0],
        velocity_m_s: [v, 0.0, 0.0],
        acceleration_m_s2: [a, 0.0, 0.0],
    };
    let next = |limits: &Filter, now: Commanded, wanted_m: f64| {
        let out = now.step(limits, &Commanded::at_rest([wanted_m, 0.0, 0.0]), DT_S);
        assert!(out.limited);
        let value = out.value;
        [
            value.position_m[0],
            value.velocity_m_s[0],
            value.acceleration_m_s2[0],
        ]
    };
    let jerky = Filter {
        jerk_m_s3: 2.0,
        ..limits()
    };
    // Jerk 2 for half a second, and again.
    assert_eq!(next(&jerky, from(-0.5, 0.0, 0.0), 1.0), [-0.25, 0.5, 1.0]);
    assert_eq!(next(&jerky, from(-0.5, 0.0, -1.0), 1.0), [-0.5, 0.0, 0.0]);
    let brisk = Filter {
        velocity_m_s: 3.0,
        ..limits()
    };
    // Acceleration 4 at most; it takes the velocity to 2.
    assert_eq!(next(&brisk, from(-1.0, 0.0, 2.0), 1.0), [0.0, 2.0, 4.0]);
    // Velocity 1 at most; the acceleration is what it took.
    assert_eq!(next(&limits(), from(-0.5, 0.5, 0.0), 1.0), [0.0, 1.0, 1.0]);
    // A goal outside is the edge.
    let edge = next(&limits(), from(0.75, 0.0, 0.0), 5.0);
    assert_eq!(edge, [1.0, 0.5, 1.0]);
    // What is outside goes no further out, nor back unless it is asked to.
    let out = next(&limits(), from(1.5, 0.0, 0.0), 5.0);
    assert_eq!(out, [1.5, 0.0, 0.0]);
    let back = next(&limits(), from(1.5, 0.0, 0.0), 0.0);
    assert_eq!(back, [1.0, -1.0, -2.0]);
}

#[test]
fn outside_the_workspace_no_wish_is_pulled_back_and_none_goes_further_out() {
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let at = |x: f64| {
                let mut place = Commanded::at_rest([0.0; 3]);
                place.position_m[axis] = side * x;
                place
            };
            let passes = |from: f64, to: f64| {
                let out = at(from).step(&limits(), &at(to), DT_S);
                assert!(out.limited || out.value == at(to));
                !out.limited
            };
            assert!(passes(1.5, 1.5), "it stays");
            assert!(passes(1.5, 1.25), "it comes back");
            assert!(!passes(1.5, 1.5_f64.next_up()), "it goes further out");
            assert!(passes(0.75, 1.0), "to the edge");
            assert!(!passes(0.75, 1.0_f64.next_up()), "and beyond");
        }
    }
}

#[test]
fn what_just_reaches_the_edge_or_stands_still_outside_is_left_bit_for_bit() {
    let mut edge = limits();
    (edge.workspace_min_x_m, edge.workspace_max_x_m) = (-0.9, 0.9);
    let scale = ActionScale {
        translation_m: 0.05,
        ..ActionScale::default()
    };
    let passes = |ee_x: f64, x: f64| {
        let wanted = [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let out = limit_action(&scale, &edge, [ee_x, 0.0, 0.0], 1.0, &wanted);
        assert_eq!(out.value[0].to_bits(), x.to_bits(), "{ee_x} {x}");
        assert!(!out.limited);
    };
    // The room that is left, divided by the scale, would be rounded to another number.
    let x = 0.025;
    let ee_x = 0.9 - x * 0.05;
    assert!(ee_x + x * 0.05 == 0.9 && (0.9 - ee_x) / 0.05 != x);
    passes(ee_x, x);
    passes(-ee_x, -x);
    for outside in [1.5, -1.5] {
        passes(outside, 0.0);
        passes(outside, -0.0);
    }
}
