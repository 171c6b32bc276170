//! Several axes together: a common duration, and what happens without one.

use super::axis::{Axis, AxisLimits, AxisMotion};
use super::profile::AxisState;
use super::{Input, Limits, Refusal, State, Target};

/// How the axes of a motion go together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Synchronisation {
    /// All axes arrive at the same time.
    Time,
    /// No common duration could be realised: every axis takes its own shortest time. The limits
    /// hold as always.
    Lost,
    /// Every axis comes to rest in its own shortest time, as [`Target::Stop`] asks.
    Stop,
}

/// A planned motion of `N` axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<const N: usize> {
    axes: [AxisMotion; N],
    duration_s: f64,
    synchronisation: Synchronisation,
}

impl<const N: usize> Trajectory<N> {
    /// Plans the motion from `start` to the target of `input` within its limits, as fast as the
    /// slowest axis allows.
    ///
    /// A start beyond the limits is braked back into them first, along the shortest way.
    ///
    /// # Errors
    /// A [`Refusal`] names what cannot be planned with; see [`Input::check`] and
    /// [`State::check`].
    pub fn plan(start: &State<N>, input: &Input<N>) -> Result<Self, Refusal> {
        input.check()?;
        start.check()?;
        Ok(match &input.target {
            Target::Reach { position, velocity } => {
                Self::reach(start, position, velocity, &input.limits)
            }
            Target::Stop => Self::stop(start, &input.limits),
        })
    }

    fn reach(
        start: &State<N>,
        position: &[f64; N],
        velocity: &[f64; N],
        limits: &Limits<N>,
    ) -> Self {
        let axes: [Axis; N] = core::array::from_fn(|i| {
            Axis::new(
                start.axis(i),
                at(position, i),
                at(velocity, i),
                limits.axis(i),
            )
        });
        let mut duration_s = 0.0_f64;
        for axis in &axes {
            duration_s = duration_s.max(axis.shortest_s);
        }
        // Every axis can push the common duration to the end of an interval that it cannot have;
        // there are at most three for each.
        for _ in 0..(3 * N + 1) {
            let pushed = axes.iter().find_map(|axis| axis.blocked_until(duration_s));
            match pushed {
                Some(longer) => duration_s = longer,
                None => break,
            }
        }
        let mut hit = true;
        let planned = axes.each_ref().map(|axis| {
            let motion = axis.motion(duration_s);
            hit &= motion.is_some();
            motion.unwrap_or_else(|| axis.change_of_velocity())
        });
        if hit && duration_s.is_finite() {
            return Self {
                axes: planned,
                duration_s,
                synchronisation: Synchronisation::Time,
            };
        }
        let alone = axes.each_ref().map(|axis| {
            axis.motion(axis.shortest_s)
                .unwrap_or_else(|| axis.change_of_velocity())
        });
        Self::apart(alone, Synchronisation::Lost)
    }

    fn stop(start: &State<N>, limits: &Limits<N>) -> Self {
        let axes = core::array::from_fn(|i| {
            let from = start.axis(i);
            Axis::new(from, from.position, 0.0, limits.axis(i)).change_of_velocity()
        });
        Self::apart(axes, Synchronisation::Stop)
    }

    fn apart(axes: [AxisMotion; N], synchronisation: Synchronisation) -> Self {
        let duration_s = axes.iter().fold(0.0_f64, |t, axis| t.max(axis.duration_s));
        Self {
            axes,
            duration_s,
            synchronisation,
        }
    }

    /// Keeps the velocity of `state` for ever; its acceleration is dropped.
    pub(super) fn constant(state: &State<N>) -> Self {
        Self::apart(
            core::array::from_fn(|i| AxisMotion::constant(state.axis(i))),
            Synchronisation::Stop,
        )
    }

    /// Duration in seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// How the axes go together.
    #[must_use]
    pub fn synchronisation(&self) -> Synchronisation {
        self.synchronisation
    }

    /// The state `t_s` seconds after the start, for `t_s >= 0`. After the end the axes keep the
    /// target velocity.
    #[must_use]
    pub fn at(&self, t_s: f64) -> State<N> {
        let mut state = State::default();
        let State {
            position,
            velocity,
            acceleration,
        } = &mut state;
        for (((axis, p), v), a) in self
            .axes
            .iter()
            .zip(position)
            .zip(velocity)
            .zip(acceleration)
        {
            let axis = axis.at(t_s);
            (*p, *v, *a) = (axis.position, axis.velocity, axis.acceleration);
        }
        state
    }
}

/// `values[i]`; the callers stay below `N`.
#[inline(always)]
fn at<const N: usize>(values: &[f64; N], i: usize) -> f64 {
    values.get(i).copied().unwrap_or(0.0)
}

impl<const N: usize> State<N> {
    #[inline(always)]
    fn axis(&self, i: usize) -> AxisState {
        AxisState {
            position: at(&self.position, i),
            velocity: at(&self.velocity, i),
            acceleration: at(&self.acceleration, i),
        }
    }
}

impl<const N: usize> Limits<N> {
    #[inline(always)]
    fn axis(&self, i: usize) -> AxisLimits {
        AxisLimits {
            velocity: at(&self.velocity, i),
            acceleration: at(&self.acceleration, i),
            jerk: at(&self.jerk, i),
        }
    }
}
