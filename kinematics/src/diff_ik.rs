//! Differential inverse kinematics: joint velocities for a twist of the tip.
//!
//! Damped least squares (Nakamura and Hanafusa 1986; Wampler 1986) with a posture in the null
//! space. A joint that would leave its range or its speed limit is held at the bound, and the
//! others take over what it leaves (saturation in the null space, Flacco, De Luca and Khatib
//! 2015), one joint after the other: at most `N` rounds.

use crate::chain::{JointLimits, JointOutOfRange, Solution};
use crate::elementary::sqrt_pos;
use crate::jacobian::Jacobian;
use crate::linear::Cholesky;

/// How velocities are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Manipulability below which damping sets in: sqrt(m^2), a small part of what the arm has in
    /// its usual postures (0.08 for the Panda's). Default 0.01.
    pub manipulability_min: f64,
    /// Damping in a singular configuration, in m/rad. It grows up to this value as the
    /// manipulability falls to 0. Default 0.05.
    pub damping_max: f64,
    /// Time in seconds in which a joint may at the earliest reach the end of its range: the tick,
    /// or longer for a softer approach. Default 0.02.
    pub horizon_s: f64,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            manipulability_min: 0.01,
            damping_max: 0.05,
            horizon_s: 0.02,
        }
    }
}

/// Joint velocities, and how well they do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion<const N: usize> {
    /// Joint velocities in rad/s or m/s, within all limits.
    pub velocity: [f64; N],
    /// Asked twist minus the one that the velocities give.
    pub missing: [f64; 6],
    /// What stands in the way.
    pub outcome: Outcome<N>,
}

/// How a twist was followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<const N: usize> {
    /// As asked, but for rounding.
    Followed,
    /// Near a singular configuration: damped, so that joint velocities stay bounded.
    Damped {
        /// The damping used, in m/rad.
        damping: f64,
    },
    /// Joints are at their limits; the others do what they can.
    Limited {
        /// Which joints are held at a bound.
        held: [bool; N],
    },
}

/// Why there are no velocities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A joint coordinate cannot be computed with.
    Joint(JointOutOfRange),
    /// The twist or the posture velocity is not finite or beyond 1e6.
    Twist,
    /// The horizon is not a positive time, or damping or threshold not a positive number.
    Tuning,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Joint(joint) => write!(f, "{joint}"),
            Self::Twist => write!(f, "the twist or the posture velocity is not finite"),
            Self::Tuning => write!(f, "horizon, damping and threshold must be positive numbers"),
        }
    }
}

impl core::error::Error for Refusal {}

/// Joint velocities that move the tip by `twist` (base axes, reference point at the tip, m/s over
/// rad/s) from the configuration `q`, whose solution is `at`, and follow `posture` (joint
/// velocities) as far as the twist leaves room.
///
/// # Errors
/// A [`Refusal`] names what cannot be computed with. A singular configuration or a joint at its
/// limit is no error but an [`Outcome`].
pub fn velocities<const N: usize>(
    at: &Solution<N>,
    q: &[f64; N],
    limits: &[JointLimits; N],
    twist: &[f64; 6],
    posture: &[f64; N],
    tuning: &Tuning,
) -> Result<JointMotion<N>, Refusal> {
    crate::chain::forward::check(q).map_err(Refusal::Joint)?;
    let usable = |x: &f64| x.abs() <= 1e6;
    if !(twist.iter().all(usable) && posture.iter().all(usable)) {
        return Err(Refusal::Twist);
    }
    let positive = |x: f64| x > 0.0 && x.is_finite();
    let Tuning {
        manipulability_min,
        damping_max,
        horizon_s,
    } = *tuning;
    if !(positive(manipulability_min) && positive(damping_max) && positive(horizon_s)) {
        return Err(Refusal::Tuning);
    }
    let bounds = bounds(q, limits, horizon_s);
    let mut held = [false; N];
    let mut velocity = *posture;
    let mut damping = 0.0;
    for _ in 0..=N {
        (velocity, damping) = least_squares(&at.jacobian, twist, &velocity, posture, &held, tuning);
        let Some(worst) = worst_violation(&velocity, &bounds, &held) else {
            break;
        };
        if let (Some(v), Some((low, high)), Some(flag)) = (
            velocity.get_mut(worst),
            bounds.get(worst),
            held.get_mut(worst),
        ) {
            *v = v.max(*low).min(*high);
            *flag = true;
        }
    }
    // The last round may have left the bounds by rounding.
    for (v, (low, high)) in velocity.iter_mut().zip(&bounds) {
        *v = v.max(*low).min(*high);
    }
    let given = at.jacobian.times(&velocity);
    let mut missing = *twist;
    missing.iter_mut().zip(given).for_each(|(m, g)| *m -= g);
    let outcome = if held.contains(&true) {
        Outcome::Limited { held }
    } else if damping > 0.0 {
        Outcome::Damped { damping }
    } else {
        Outcome::Followed
    };
    Ok(JointMotion {
        velocity,
        missing,
        outcome,
    })
}

/// Least and greatest velocity of each joint: by its speed, and by what is left of its range.
fn bounds<const N: usize>(
    q: &[f64; N],
    limits: &[JointLimits; N],
    horizon_s: f64,
) -> [(f64, f64); N] {
    let mut bounds = [(0.0, 0.0); N];
    for ((bound, q), limit) in bounds.iter_mut().zip(q).zip(limits) {
        let fastest = limit.velocity.min(1e6);
        let within = |x: f64| x.max(-fastest).min(fastest);
        // A joint beyond its range may only come back.
        *bound = (
            within((limit.lower - q) / horizon_s),
            within((limit.upper - q) / horizon_s),
        );
    }
    bounds
}

/// The free joint that is farthest outside its bounds.
fn worst_violation<const N: usize>(
    velocity: &[f64; N],
    bounds: &[(f64, f64); N],
    held: &[bool; N],
) -> Option<usize> {
    let mut worst = (1e-12, None);
    let joints = velocity.iter().zip(bounds).zip(held).enumerate();
    for (joint, ((v, (low, high)), held)) in joints {
        let excess = (low - v).max(v - high);
        if !held && excess > worst.0 {
            worst = (excess, Some(joint));
        }
    }
    worst.1
}

/// Velocities of the joints that are not held: as near to the posture as the twist allows. Held
/// joints keep their velocity. Also the damping used.
fn least_squares<const N: usize>(
    jacobian: &Jacobian<N>,
    twist: &[f64; 6],
    velocity: &[f64; N],
    posture: &[f64; N],
    held: &[bool; N],
    tuning: &Tuning,
) -> ([f64; N], f64) {
    let mut free = *jacobian;
    let mut base = *posture;
    for (((column, base), held), v) in free
        .columns
        .iter_mut()
        .zip(&mut base)
        .zip(held)
        .zip(velocity)
    {
        if *held {
            *column = [0.0; 6];
            *base = *v;
        }
    }
    // What is left to do beside held joints and posture.
    let mut left = *twist;
    left.iter_mut()
        .zip(jacobian.times(&base))
        .for_each(|(l, done)| *l -= done);
    let (factor, damping) = damped_factor(&free, tuning);
    if let Some(factor) = factor {
        let correction = free.transpose_times(&factor.solve(&left));
        base.iter_mut().zip(correction).for_each(|(b, c)| *b += c);
    }
    (base, damping)
}

/// Factor of `J J^T + d^2`, with a damping `d` that sets in below the manipulability threshold.
fn damped_factor<const N: usize>(
    jacobian: &Jacobian<N>,
    tuning: &Tuning,
) -> (Option<Cholesky<6>>, f64) {
    let Tuning {
        manipulability_min,
        damping_max,
        ..
    } = *tuning;
    let plain = Cholesky::of(&jacobian.gram(0.0));
    let manipulability = plain.as_ref().map_or(0.0, Cholesky::root_determinant);
    if manipulability >= manipulability_min {
        return (plain, 0.0);
    }
    let ratio = manipulability / manipulability_min;
    let damping = damping_max * sqrt_pos(1.0 - ratio * ratio);
    (
        Cholesky::of(&jacobian.gram(damping * damping)).or(plain),
        damping,
    )
}

#[cfg(test)]
mod tests;
