//! One axis: its shortest duration, the durations it cannot have, and its motion for a given one.

use super::family::Family;
use super::profile::{AxisState, Brake, Profile};

/// Position error, relative to the size of the positions, that is taken for rounding. It decides
/// only between a motion that hits the target directly and one that takes a detour.
const ROUNDING: f64 = 1e-10;
/// Final position error, relative to the same size, above which a motion is rejected.
const REJECTED: f64 = 1e-8;

/// Limits of one axis, in the unit of the axis and seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisLimits {
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

/// What one axis has to do, analysed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    origin: AxisState,
    brake: Brake,
    brake_s: f64,
    start: AxisState,
    target_position: f64,
    target_velocity: f64,
    limits: AxisLimits,
    /// Displacement to cover after the brake, and the tolerance of it, divided by the jerk limit.
    displacement: f64,
    tolerance: f64,
    rising: Family,
    /// `true` where the shortest motion is of the rising family.
    rises: bool,
    /// Shortest duration in seconds.
    pub(super) shortest_s: f64,
    /// Open intervals of longer durations that are impossible.
    pub(super) blocked_s: [(f64, f64); 3],
}

/// No interval at all.
const EMPTY: (f64, f64) = (f64::INFINITY, f64::INFINITY);

impl Axis {
    /// Analyses the motion from `origin` to the target.
    pub(super) fn new(
        origin: AxisState,
        target_position: f64,
        target_velocity: f64,
        limits: AxisLimits,
    ) -> Self {
        let AxisLimits {
            velocity,
            acceleration,
            jerk,
        } = limits;
        let (brake, start) = Brake::into_limits(origin, velocity, acceleration, jerk);
        let size = 1.0 + start.position.abs() + target_position.abs();
        let mut axis = Self {
            origin,
            brake,
            brake_s: brake.duration(),
            start,
            target_position,
            target_velocity,
            limits,
            displacement: (target_position - start.position) / jerk,
            tolerance: ROUNDING * size / jerk,
            rising: Family::new(
                start.velocity / jerk,
                start.acceleration / jerk,
                target_velocity / jerk,
                velocity / jerk,
                acceleration / jerk,
            ),
            rises: true,
            shortest_s: 0.0,
            blocked_s: [EMPTY; 3],
        };
        axis.analyse();
        axis
    }

    /// The family of greatest displacement in the negative direction, mirrored.
    fn falling(&self) -> Family {
        let jerk = self.limits.jerk;
        Family::new(
            -self.start.velocity / jerk,
            -self.start.acceleration / jerk,
            -self.target_velocity / jerk,
            self.limits.velocity / jerk,
            self.limits.acceleration / jerk,
        )
    }

    fn analyse(&mut self) {
        let first = self.rising.shape(self.rising.t_first);
        let ahead = self.displacement - self.rising.displacement(&first);
        let direct = ahead.abs() <= self.tolerance;
        self.rises = ahead >= 0.0;
        let at_rest = self.target_velocity == 0.0;
        if at_rest {
            // An axis at rest at the target can wait there: no longer duration is impossible.
            self.shortest_s = self.brake_s
                + if direct {
                    self.rising.t_first
                } else if self.rises {
                    self.rising.only_crossing(self.displacement)
                } else {
                    self.falling().only_crossing(-self.displacement)
                };
            return;
        }
        let falling = self.falling();
        let (near, far) = if self.rises {
            (&self.rising, &falling)
        } else {
            (&falling, &self.rising)
        };
        let d = if self.rises {
            self.displacement
        } else {
            -self.displacement
        };
        let near_times = near.crossings(d, direct, self.tolerance);
        let far_times = far.crossings(-d, true, self.tolerance);
        let mut times = near_times.iter();
        let shortest = if direct {
            near.t_first
        } else {
            times.next().unwrap_or(near.t_first)
        };
        let brake_s = self.brake_s;
        let mut blocked = self.blocked_s.iter_mut();
        let mut far_times = far_times.iter();
        while let (Some(from), Some(to)) = (times.next(), times.next()) {
            if let Some(slot) = blocked.next() {
                *slot = (brake_s + from.max(shortest), brake_s + to);
            }
        }
        while let (Some(from), Some(to)) = (far_times.next(), far_times.next()) {
            if let Some(slot) = blocked.next() {
                *slot = (brake_s + from.max(shortest), brake_s + to);
            }
        }
        self.shortest_s = brake_s + shortest;
    }

    /// The end of the impossible interval that `duration_s` lies in, if it lies in one.
    #[inline]
    pub(super) fn blocked_until(&self, duration_s: f64) -> Option<f64> {
        self.blocked_s
            .iter()
            .find(|(from, to)| *from < duration_s && duration_s < *to)
            .map(|(_, to)| *to)
    }

    /// The motion of the given duration; `None` where it misses the target, which a possible
    /// duration does not.
    ///
    /// For the shortest duration it is the extremal profile. For a longer one it is the mixture
    /// of the two extremal profiles of that duration that covers the displacement: the limits
    /// bound convex sets, and so the mixture keeps them, with less jerk.
    pub(super) fn motion(&self, duration_s: f64) -> Option<AxisMotion> {
        let jerk = self.limits.jerk;
        let t = (duration_s - self.brake_s).max(0.0);
        let shortest = duration_s <= self.shortest_s;
        let d = self.displacement;
        let (mut rising, mut falling) = (Profile::default(), Profile::default());
        let (mut highest, mut lowest) = (f64::NAN, f64::NAN);
        if self.rises || !shortest {
            let shape = self.rising.shape(t);
            highest = self.rising.displacement(&shape);
            rising = self.rising.profile(&shape, jerk);
        }
        if !self.rises || !shortest {
            let family = self.falling();
            let shape = family.shape(t);
            lowest = -family.displacement(&shape);
            falling = family.profile(&shape, -jerk);
        }
        let (share, reached) = if shortest {
            if self.rises {
                (1.0, highest)
            } else {
                (0.0, lowest)
            }
        } else {
            let share = ((d - lowest) / (highest - lowest)).clamp(0.0, 1.0);
            let share = if share.is_nan() { 0.5 } else { share };
            (share, lowest + share * (highest - lowest))
        };
        let accepted = (reached - d).abs() <= self.tolerance * (REJECTED / ROUNDING);
        accepted.then_some(AxisMotion {
            origin: self.origin,
            brake: self.brake,
            brake_s: self.brake_s,
            start: self.start,
            rising,
            falling,
            share,
            duration_s,
            target_position: self.target_position,
            target_velocity: self.target_velocity,
        })
    }

    /// The fastest way to the target velocity, wherever it ends.
    pub(super) fn change_of_velocity(&self) -> AxisMotion {
        let shape = self.rising.shape(self.rising.t_first);
        let reached = self.rising.displacement(&shape) * self.limits.jerk;
        AxisMotion {
            origin: self.origin,
            brake: self.brake,
            brake_s: self.brake_s,
            start: self.start,
            rising: self.rising.profile(&shape, self.limits.jerk),
            falling: Profile::default(),
            share: 1.0,
            duration_s: self.brake_s + self.rising.t_first,
            target_position: self.start.position + reached,
            target_velocity: self.target_velocity,
        }
    }
}

/// The planned motion of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisMotion {
    origin: AxisState,
    brake: Brake,
    brake_s: f64,
    start: AxisState,
    rising: Profile,
    falling: Profile,
    /// Share of `rising` in the mixture; the rest is `falling`.
    share: f64,
    pub(super) duration_s: f64,
    target_position: f64,
    target_velocity: f64,
}

impl AxisMotion {
    /// Standing still, or moving on at constant velocity.
    pub(super) fn constant(state: AxisState) -> Self {
        Self {
            origin: state,
            brake: Brake::default(),
            brake_s: 0.0,
            start: state,
            rising: Profile::default(),
            falling: Profile::default(),
            share: 1.0,
            duration_s: 0.0,
            target_position: state.position,
            target_velocity: state.velocity,
        }
    }

    /// The state `t` seconds after the start; beyond the duration the target velocity is kept.
    #[inline]
    pub(super) fn at(&self, t: f64) -> AxisState {
        if t >= self.duration_s {
            return AxisState {
                position: self.target_position + self.target_velocity * (t - self.duration_s),
                velocity: self.target_velocity,
                acceleration: 0.0,
            };
        }
        if t < self.brake_s {
            return self.brake.at(self.origin, t);
        }
        let t = t - self.brake_s;
        if self.share >= 1.0 {
            return self.rising.at(self.start, t);
        }
        let low = self.falling.at(self.start, t);
        if self.share <= 0.0 {
            return low;
        }
        let high = self.rising.at(self.start, t);
        let mix = |low: f64, high: f64| low + self.share * (high - low);
        AxisState {
            position: mix(low.position, high.position),
            velocity: mix(low.velocity, high.velocity),
            acceleration: mix(low.acceleration, high.acceleration),
        }
    }
}
