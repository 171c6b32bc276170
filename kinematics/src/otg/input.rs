//! What goes in: states, limits and targets, and what is refused of them.

/// Position, velocity and acceleration of `N` axes; metres or radians, and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const N: usize> {
    /// Positions, m or rad.
    pub position: [f64; N],
    /// Velocities, m/s or rad/s.
    pub velocity: [f64; N],
    /// Accelerations, m/s^2 or rad/s^2.
    pub acceleration: [f64; N],
}

impl<const N: usize> Default for State<N> {
    fn default() -> Self {
        Self::at_rest([0.0; N])
    }
}

impl<const N: usize> State<N> {
    /// At rest at `position`.
    #[must_use]
    pub fn at_rest(position: [f64; N]) -> Self {
        Self {
            position,
            velocity: [0.0; N],
            acceleration: [0.0; N],
        }
    }

    /// Whether a motion can begin here.
    ///
    /// # Errors
    /// Names the first value that is not finite or beyond [`MAGNITUDE_MAX`].
    pub fn check(&self) -> Result<(), Refusal> {
        check(Quantity::Position, &self.position, in_range)?;
        check(Quantity::Velocity, &self.velocity, in_range)?;
        check(Quantity::Acceleration, &self.acceleration, in_range)
    }
}

/// Symmetric limits of `N` axes, all positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const N: usize> {
    /// Greatest speed, m/s or rad/s.
    pub velocity: [f64; N],
    /// Greatest acceleration, m/s^2 or rad/s^2.
    pub acceleration: [f64; N],
    /// Greatest jerk, m/s^3 or rad/s^3.
    pub jerk: [f64; N],
}

/// Where the axes shall go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target<const N: usize> {
    /// Be at `position` with `velocity` and no acceleration, all axes at the same time, as soon
    /// as possible.
    Reach {
        /// Target position, m or rad.
        position: [f64; N],
        /// Target velocity, m/s or rad/s, within the velocity limit.
        velocity: [f64; N],
    },
    /// Come to rest, each axis as soon as possible, wherever that is.
    Stop,
}

/// Target and limits: what [`super::Otg::update`] takes every tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<const N: usize> {
    /// Where to go.
    pub target: Target<N>,
    /// What not to exceed on the way.
    pub limits: Limits<N>,
}

impl<const N: usize> Input<N> {
    /// Stop, with limits that are never used because the axes rest already.
    pub(super) fn hold() -> Self {
        let limits = Limits {
            velocity: [1.0; N],
            acceleration: [1.0; N],
            jerk: [1.0; N],
        };
        Self {
            target: Target::Stop,
            limits,
        }
    }

    /// Whether this input can be followed.
    ///
    /// # Errors
    /// Names the first value that cannot be used: a limit outside [`LIMIT_MIN`] to
    /// [`MAGNITUDE_MAX`], a target that is not finite or beyond [`MAGNITUDE_MAX`], a target
    /// velocity above the velocity limit.
    pub fn check(&self) -> Result<(), Refusal> {
        let usable = |x: f64| (LIMIT_MIN..=MAGNITUDE_MAX).contains(&x);
        check(Quantity::VelocityLimit, &self.limits.velocity, usable)?;
        check(
            Quantity::AccelerationLimit,
            &self.limits.acceleration,
            usable,
        )?;
        check(Quantity::JerkLimit, &self.limits.jerk, usable)?;
        if let Target::Reach { position, velocity } = &self.target {
            check(Quantity::TargetPosition, position, in_range)?;
            check(Quantity::TargetVelocity, velocity, in_range)?;
            let mut pairs = velocity.iter().zip(&self.limits.velocity);
            if let Some(axis) = pairs.position(|(v, limit)| v.abs() > *limit) {
                return Err(Refusal::TargetTooFast { axis });
            }
        }
        Ok(())
    }
}

/// Smallest usable limit: below it durations leave the range in which they can be computed.
pub const LIMIT_MIN: f64 = 1e-6;
/// Greatest usable magnitude of any position, velocity, acceleration or limit.
pub const MAGNITUDE_MAX: f64 = 1e9;

/// Which of the numbers a refusal is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Present position.
    Position,
    /// Present velocity.
    Velocity,
    /// Present acceleration.
    Acceleration,
    /// Target position.
    TargetPosition,
    /// Target velocity.
    TargetVelocity,
    /// Velocity limit.
    VelocityLimit,
    /// Acceleration limit.
    AccelerationLimit,
    /// Jerk limit.
    JerkLimit,
}

/// Why an input is not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A number is not finite or out of range; give one that is.
    OutOfRange {
        /// Which number.
        quantity: Quantity,
        /// Of which axis, counted from 0.
        axis: usize,
    },
    /// The target velocity exceeds the velocity limit; lower it or raise the limit.
    TargetTooFast {
        /// Of which axis, counted from 0.
        axis: usize,
    },
    /// The time step is negative, not finite or longer than [`super::DT_MAX_S`].
    TimeStep,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::OutOfRange { quantity, axis } => {
                let name = match quantity {
                    Quantity::Position => "current position",
                    Quantity::Velocity => "current velocity",
                    Quantity::Acceleration => "current acceleration",
                    Quantity::TargetPosition => "target position",
                    Quantity::TargetVelocity => "target velocity",
                    Quantity::VelocityLimit => "velocity limit",
                    Quantity::AccelerationLimit => "acceleration limit",
                    Quantity::JerkLimit => "jerk limit",
                };
                write!(f, "axis {axis}: the {name} is not finite or out of range")
            }
            Self::TargetTooFast { axis } => {
                write!(
                    f,
                    "axis {axis}: the target velocity exceeds the velocity limit"
                )
            }
            Self::TimeStep => write!(f, "the time step is not between 0 and 10 s"),
        }
    }
}

impl core::error::Error for Refusal {}

fn in_range(x: f64) -> bool {
    x.abs() <= MAGNITUDE_MAX
}

fn check<const N: usize>(
    quantity: Quantity,
    values: &[f64; N],
    usable: impl Fn(f64) -> bool,
) -> Result<(), Refusal> {
    match values.iter().position(|x| !usable(*x)) {
        Some(axis) => Err(Refusal::OutOfRange { quantity, axis }),
        None => Ok(()),
    }
}
