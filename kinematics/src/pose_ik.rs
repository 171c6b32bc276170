//! Inverse kinematics for a pose, in a bounded number of steps.
//!
//! Levenberg and Marquardt's method within the joint ranges, from the seed and then, where it
//! gets stuck, from further starts spread evenly over the ranges. No randomness: the same request
//! has the same answer.

use crate::arm::Arm;
use crate::chain::{JointLimits, JointOutOfRange};
use crate::linear::Cholesky;
use crate::pose::Pose;
use crate::vector::{distance, norm};

/// How long to search, and when to be content.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Steps from one start, each a forward kinematics and a 6 by 6 system. Default 100.
    pub steps: u16,
    /// Starts after the seed. Default 32.
    pub restarts: u16,
    /// Accepted distance in metres. Default 1e-6.
    pub position_tolerance_m: f64,
    /// Accepted angle in radians. Default 1e-6.
    pub rotation_tolerance_rad: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            steps: 100,
            restarts: 32,
            position_tolerance_m: 1e-6,
            rotation_tolerance_rad: 1e-6,
        }
    }
}

/// What a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer<const N: usize> {
    /// A configuration within all ranges whose tip is at the target within the tolerances.
    Reached(Candidate<N>),
    /// The target is farther from the base than the arm is long.
    OutOfReach,
    /// The best configuration within all ranges that was found. The target may be out of reach,
    /// or the search too short.
    NotReached(Candidate<N>),
}

/// A configuration and how near to the target it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<const N: usize> {
    /// Joint coordinates, rad or m.
    pub q: [f64; N],
    /// Distance to the target in metres.
    pub position_error_m: f64,
    /// Angle to the target in radians.
    pub rotation_error_rad: f64,
    /// Steps taken over all starts.
    pub steps: u32,
}

/// Why there was no search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The target is not a pose: a coordinate is not finite, or the quaternion not a unit one.
    Target,
    /// A seed coordinate cannot be computed with.
    Seed(JointOutOfRange),
    /// A tolerance is not a positive number.
    Tolerance,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Target => write!(
                f,
                "the target is not finite or its quaternion not of length 1"
            ),
            Self::Seed(joint) => write!(f, "seed: {joint}"),
            Self::Tolerance => write!(f, "the tolerances must be positive numbers"),
        }
    }
}

impl core::error::Error for Refusal {}

/// Metres that a radian counts for in the error that is minimised.
const METRES_PER_RADIAN: f64 = 0.3;

/// Searches a configuration of `arm` whose tip is at `target` (in the base frame), from `seed`.
///
/// # Errors
/// A [`Refusal`] names what cannot be computed with; a target that is not found is an [`Answer`].
pub fn solve<const N: usize>(
    arm: &impl Arm<N>,
    target: &Pose,
    seed: &[f64; N],
    search: &Search,
) -> Result<Answer<N>, Refusal> {
    if !target.is_valid() {
        return Err(Refusal::Target);
    }
    let positive = |x: f64| x > 0.0 && x.is_finite();
    if !(positive(search.position_tolerance_m) && positive(search.rotation_tolerance_rad)) {
        return Err(Refusal::Tolerance);
    }
    crate::chain::forward::check(seed).map_err(Refusal::Seed)?;
    if norm(target.position) > arm.reach_m() + search.position_tolerance_m {
        return Ok(Answer::OutOfReach);
    }
    let mut steps = 0;
    let mut best: Option<Candidate<N>> = None;
    for start in 0..=search.restarts {
        let q = if start == 0 {
            *seed
        } else {
            spread(arm.limits(), start)
        };
        let mut candidate = descend(arm, target, &q, search).map_err(Refusal::Seed)?;
        steps += candidate.steps;
        candidate.steps = steps;
        if content(&candidate, search) {
            return Ok(Answer::Reached(candidate));
        }
        if best.is_none_or(|b| cost_of(&candidate) < cost_of(&b)) {
            best = Some(candidate);
        }
    }
    Ok(best.map_or(Answer::OutOfReach, |b| {
        Answer::NotReached(Candidate { steps, ..b })
    }))
}

fn content<const N: usize>(candidate: &Candidate<N>, search: &Search) -> bool {
    candidate.position_error_m <= search.position_tolerance_m
        && candidate.rotation_error_rad <= search.rotation_tolerance_rad
}

fn cost_of<const N: usize>(candidate: &Candidate<N>) -> f64 {
    let turn = METRES_PER_RADIAN * candidate.rotation_error_rad;
    candidate.position_error_m * candidate.position_error_m + turn * turn
}

/// The start of that number: points of Kronecker's sequence on the joint ranges, which fill them
/// evenly. A joint without a range gets one turn.
fn spread<const N: usize>(limits: &[JointLimits; N], start: u16) -> [f64; N] {
    let mut q = [0.0; N];
    let mut alpha = 1.0;
    for (q, limit) in q.iter_mut().zip(limits) {
        // Powers of the inverse of the plastic-like number of eight dimensions (Roberts 2018).
        alpha *= 0.917_004_043_204_671_2;
        let share = 0.5 + alpha * f64::from(start);
        let share = share - libm::floor(share);
        let bounded = limit.lower.abs().max(limit.upper.abs()) < 1e3;
        let (low, high) = if bounded {
            (limit.lower, limit.upper)
        } else {
            (-core::f64::consts::PI, core::f64::consts::PI)
        };
        *q = limit.nearest(low + share * (high - low));
    }
    q
}

/// Error in rows of equal weight: metres, and radians times [`METRES_PER_RADIAN`].
fn weighted_error(from: &Pose, target: &Pose) -> [f64; 6] {
    let (d, r) = from.error_to(*target);
    let [rx, ry, rz] = r.map(|x| x * METRES_PER_RADIAN);
    [d[0], d[1], d[2], rx, ry, rz]
}

fn square(error: &[f64; 6]) -> f64 {
    error.iter().map(|x| x * x).sum()
}

/// One descent within the joint ranges.
fn descend<const N: usize>(
    arm: &impl Arm<N>,
    target: &Pose,
    seed: &[f64; N],
    search: &Search,
) -> Result<Candidate<N>, JointOutOfRange> {
    let limits = arm.limits();
    let mut q = *seed;
    q.iter_mut()
        .zip(limits)
        .for_each(|(q, limit)| *q = limit.nearest(*q));
    let mut at = arm.solve(&q)?;
    let mut pose = at.tip.pose();
    let mut error = weighted_error(&pose, target);
    let mut damping = 1e-3;
    let mut steps = 0;
    while steps < u32::from(search.steps) {
        let here = candidate(&q, &pose, target, steps);
        if content(&here, search) {
            return Ok(here);
        }
        steps += 1;
        let mut jacobian = at.jacobian;
        for column in &mut jacobian.columns {
            column
                .iter_mut()
                .skip(3)
                .for_each(|x| *x *= METRES_PER_RADIAN);
        }
        // A joint at its bound does not take part in a step that would push it out.
        let push = jacobian.transpose_times(&error);
        for (((column, q), limit), push) in
            jacobian.columns.iter_mut().zip(&q).zip(limits).zip(push)
        {
            if (*q >= limit.upper && push > 0.0) || (*q <= limit.lower && push < 0.0) {
                *column = [0.0; 6];
            }
        }
        let Some(factor) = Cholesky::of(&jacobian.gram(damping)) else {
            damping *= 10.0;
            continue;
        };
        let step = jacobian.transpose_times(&factor.solve(&error));
        let mut next = q;
        for ((next, step), limit) in next.iter_mut().zip(step).zip(limits) {
            // Half a radian at most: beyond, the linearisation says nothing.
            *next = limit.nearest(*next + step.clamp(-0.5, 0.5));
        }
        let next_at = arm.solve(&next)?;
        let next_pose = next_at.tip.pose();
        let next_error = weighted_error(&next_pose, target);
        if square(&next_error) < square(&error) {
            let gain = square(&error) - square(&next_error);
            let stuck = gain < 1e-9 * square(&error);
            (q, at, pose, error) = (next, next_at, next_pose, next_error);
            damping = (damping * 0.1).max(1e-14);
            if stuck {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e3 {
                break;
            }
        }
    }
    Ok(candidate(&q, &pose, target, steps))
}

fn candidate<const N: usize>(q: &[f64; N], pose: &Pose, target: &Pose, steps: u32) -> Candidate<N> {
    Candidate {
        q: *q,
        position_error_m: distance(pose.position, target.position),
        rotation_error_rad: pose.orientation.angle_to(target.orientation),
        steps,
    }
}

#[cfg(test)]
mod tests;
