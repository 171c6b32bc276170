//! Where the setpoint goes on after the last filter let something else pass.

use super::*;

#[test]
fn it_goes_on_from_what_was_commanded() {
    let params = Params::guarded();
    let mut shaper = Shaper::at(&StateSample::default());
    let commanded = Commanded {
        position_m: [0.5, -0.25, 0.125],
        velocity_m_s: [0.1, 0.0, -0.1],
        acceleration_m_s2: [0.0; 3],
    };
    shaper.follow(&commanded);
    let dt_s = 1e-3;
    let next = shaper.step(&params, dt_s);
    for axis in 0..3 {
        let on_m = commanded.position_m[axis] + commanded.velocity_m_s[axis] * dt_s;
        let miss_m = (next.position_m[axis] - on_m).abs();
        assert!(miss_m < 1e-6, "{axis}: {miss_m} m");
    }
}
