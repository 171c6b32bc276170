//! What the last filter does where the setpoint generator does not keep its limits.

use crate::{
    Controller, Params,
    filter::Commanded,
    message::{Command, Input, StateSample},
    shaping::Shaper,
};

const EE_M: [f64; 3] = [0.4, 0.0, 0.3];

/// Ticks with a robot that stands still.
fn tick(controller: &mut Controller, n: u64) -> Command {
    let sample = StateSample {
        sequence: n,
        session: 1,
        stamp_ns: n * 4_000_000,
        ee_position_m: EE_M,
        ..StateSample::default()
    };
    let input = Input {
        state: Some(&sample),
        ..Input::default()
    };
    controller.tick(sample.stamp_ns, &input).command
}

#[test]
fn a_setpoint_that_leaps_is_limited_and_the_generator_goes_on_from_what_was_let_through() {
    let params = Params::guarded();
    let mut controller = Controller::new(params.validate().expect("the profile is valid"));
    let first = tick(&mut controller, 1);
    assert_eq!(first.setpoint_position_m, EE_M);
    // A generator 5 cm away from what was commanded.
    let away = StateSample {
        ee_position_m: [EE_M[0] + 0.05, EE_M[1], EE_M[2]],
        ..StateSample::default()
    };
    controller.state.shaper = Some((Shaper::at(&away), Commanded::at_rest(EE_M)));
    // The action was limited too: the flag stays.
    controller.state.current.flags = Command::LIMITED;
    let limited = tick(&mut controller, 2);
    assert_eq!(limited.flags & Command::LIMITED, Command::LIMITED);
    let moved_m = limited.setpoint_position_m[0] - EE_M[0];
    assert!(moved_m > 0.0 && moved_m < 1e-3, "{moved_m}");
    controller.state.current.flags = 0;
    for n in 3..50 {
        let command = tick(&mut controller, n);
        assert_eq!(command.flags & Command::LIMITED, 0, "tick {n}");
        let moved_m = command.setpoint_position_m[0] - EE_M[0];
        assert!(moved_m.abs() < 0.02, "tick {n}: {moved_m}");
    }
}
