use proptest::prelude::*;

use super::*;
use crate::vector::sub;

const H_S: f64 = 1e-4;

proptest! {
    /// Against differences of the rotation itself, below and above the angle at which closed forms
    /// take over from series.
    #[test]
    fn angular_motion_is_the_change_of_the_rotation(
        v in prop::array::uniform3(-1.5..1.5_f64),
        size in prop::sample::select(&[0.0, 1e-6, 0.1, 1.0][..]),
        rate in prop::array::uniform3(-1.0..1.0_f64),
        acceleration in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let v = scale(v, size);
        let then = |t_s: f64| {
            let moved = add(scale(rate, t_s), scale(acceleration, 0.5 * t_s * t_s));
            (add(v, moved), add(rate, scale(acceleration, t_s)))
        };
        let turn = |t_s: f64| UnitQuaternion::from_rotation_vector(then(t_s).0);
        let (velocity, change) = angular_motion(v, rate, acceleration);
        let turned = (turn(H_S) * turn(-H_S).inverse()).to_rotation_vector();
        let difference = scale(turned, 0.5 / H_S);
        prop_assert!(norm(sub(velocity, difference)) < 1e-6, "{velocity:?} {difference:?}");
        let velocity_at = |t_s: f64| {
            let (v, rate) = then(t_s);
            angular_motion(v, rate, acceleration).0
        };
        let difference = scale(sub(velocity_at(H_S), velocity_at(-H_S)), 0.5 / H_S);
        prop_assert!(norm(sub(change, difference)) < 1e-6, "{change:?} {difference:?}");
    }
}

#[test]
fn the_series_meets_the_closed_form() {
    let (below, above) = (jacobian_series(0.25_f64.next_down()), jacobian_series(0.25));
    for (a, b) in below.into_iter().zip(above) {
        assert!((a - b).abs() < 1e-11, "{a} {b}");
    }
}

#[test]
fn about_one_axis_it_is_the_vectors_own() {
    let along = |x: f64| [0.0, 0.0, x];
    assert_eq!(
        angular_motion(along(2.0), along(0.3), along(-4.0)),
        (along(0.3), along(-4.0))
    );
}
