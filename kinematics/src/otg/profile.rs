//! Motion of one axis in phases of constant jerk.

use crate::elementary::sqrt_pos;

/// Position, velocity and acceleration of one axis at one time, in the unit of the axis (metre or
/// radian) and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct AxisState {
    pub(super) position: f64,
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
}

impl AxisState {
    /// The state after `t` seconds of constant `jerk`.
    #[inline(always)]
    pub(super) fn after(self, jerk: f64, t: f64) -> Self {
        let Self {
            position: p,
            velocity: v,
            acceleration: a,
        } = self;
        Self {
            position: p + t * (v + t * (0.5 * a + t * (jerk * (1.0 / 6.0)))),
            velocity: v + t * (a + t * (0.5 * jerk)),
            acceleration: a + t * jerk,
        }
    }
}

/// Seven phases of jerk +, 0, -, 0, -, 0, + times `jerk`: up to a peak acceleration, through the
/// highest velocity, down to a trough and back to zero acceleration. A negative `jerk` mirrors it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Profile {
    /// Signed jerk of the first phase.
    pub(super) jerk: f64,
    /// Durations of the phases in seconds, none negative.
    pub(super) durations: [f64; 7],
}

/// Jerk of the seven phases of a [`Profile`], relative to the first.
const PATTERN: [f64; 7] = [1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0];

impl Profile {
    /// The state `t` seconds after `start`.
    #[inline]
    pub(super) fn at(&self, start: AxisState, t: f64) -> AxisState {
        let mut state = start;
        let mut left = t;
        for (duration, pattern) in self.durations.iter().zip(PATTERN) {
            let jerk = self.jerk * pattern;
            if left <= *duration {
                return state.after(jerk, left);
            }
            state = state.after(jerk, *duration);
            left -= *duration;
        }
        state.after(0.0, left)
    }
}

/// What brings an axis back within its limits before the planned motion begins: at most four
/// phases. Empty for a state that is within them already.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Brake {
    /// Jerk and duration of the phases.
    phases: [(f64, f64); 4],
    /// How many of them count.
    count: u8,
}

/// Excess over a limit, relative to it, that is taken for rounding.
const ROUNDING: f64 = 1e-12;

impl Brake {
    /// Total duration in seconds.
    #[inline]
    pub(super) fn duration(&self) -> f64 {
        if self.count == 0 {
            0.0
        } else {
            self.phases.iter().map(|(_, t)| t).sum()
        }
    }

    /// The state `t` seconds after `start`, for `t` within the duration.
    pub(super) fn at(&self, start: AxisState, t: f64) -> AxisState {
        let mut state = start;
        let mut left = t;
        for (jerk, duration) in self.phases.iter().take(usize::from(self.count)) {
            if left <= *duration {
                return state.after(*jerk, left);
            }
            state = state.after(*jerk, *duration);
            left -= *duration;
        }
        state
    }

    fn push(&mut self, state: &mut AxisState, jerk: f64, duration: f64) {
        if let Some(phase) = self.phases.get_mut(usize::from(self.count))
            && duration > 0.0
        {
            *phase = (jerk, duration);
            self.count = self.count.wrapping_add(1);
            *state = state.after(jerk, duration);
        }
    }

    /// The shortest way back into the set from which the limits can be kept, and where it ends.
    ///
    /// The acceleration is brought within its limit first. Where the velocity is above its limit,
    /// or would be carried above it by the acceleration, the axis decelerates at full jerk and
    /// acceleration until the velocity is back at the limit; the planned motion goes on from there.
    pub(super) fn into_limits(
        start: AxisState,
        v_max: f64,
        a_max: f64,
        jerk: f64,
    ) -> (Self, AxisState) {
        let mut brake = Self::default();
        let mut state = start;
        let a = state.acceleration;
        if a.abs() > a_max * (1.0 + ROUNDING) {
            brake.push(&mut state, -jerk.copysign(a), (a.abs() - a_max) / jerk);
            state.acceleration = a_max.copysign(a);
        }
        // Once from above and once from below: each leaves the other alone unless the limits
        // contradict the state, and then the planned motion still ends inside them.
        for sign in [1.0, -1.0] {
            brake.velocity_side(&mut state, sign, v_max, a_max, jerk);
        }
        (brake, state)
    }

    /// Handles too high a velocity in the direction of `sign`.
    fn velocity_side(
        &mut self,
        state: &mut AxisState,
        sign: f64,
        v_max: f64,
        a_max: f64,
        jerk: f64,
    ) {
        let v = sign * state.velocity;
        let a = sign * state.acceleration;
        // Velocity at zero acceleration on the way of full negative jerk through this state.
        let crest = v + a * a / (2.0 * jerk);
        let highest = if a > 0.0 { crest } else { v };
        if highest <= v_max * (1.0 + ROUNDING) {
            return;
        }
        let drop = crest - v_max;
        let full = sqrt_pos(2.0 * jerk * drop);
        // Deeper than 2 sqrt(v j) the axis would overshoot the opposite limit.
        let deepest = a_max.min(2.0 * sqrt_pos(v_max * jerk)).max(-a);
        if full <= deepest {
            self.push(state, -sign * jerk, (a + full) / jerk);
        } else {
            self.push(state, -sign * jerk, (a + deepest) / jerk);
            self.push(
                state,
                0.0,
                (drop - deepest * deepest / (2.0 * jerk)) / deepest,
            );
        }
        state.velocity = sign * v_max;
    }
}
