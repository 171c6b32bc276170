//! The motions of greatest displacement: one for every duration.
//!
//! Among all motions of one axis from velocity `v0` and acceleration `a0` to velocity `vf` and
//! acceleration 0 within the limits and in the time `t`, one covers the greatest displacement. It
//! has the form of [`Profile`]: full jerk up, down through the highest velocity, up again, with
//! phases of full acceleration and full velocity in between where the limits cut it. These are
//! the extremal profiles of Berscheid and Kröger, "Jerk-limited Real-time Trajectory Generation
//! with Arbitrary Target States" (2021). Here they are indexed by their duration, and then every
//! phase follows in closed form.
//!
//! All quantities are divided by the jerk limit, so that full jerk is 1. With peak acceleration
//! `p` (which may stay negative), trough `-q` and the velocity `u` at zero acceleration between
//! them, the first part of the motion is a piece of the symmetric change of velocity from
//! `w = v0 - a0^2/2` to `u`, which lasts `S(u - w)`, and the second the change from `u` to `vf`:
//!
//! ```text
//! S(x) = 2 sqrt(x)  for x <= a_max^2,   a_max + x / a_max  above
//! t    = S(u - w) - a0 + S(u - vf)
//! d    = (w + u)/2 S(u - w) + (u + vf)/2 S(u - vf) - v0 a0 + a0^3/3
//! dd/dt = u + p q / 2
//! ```
//!
//! For `p < 0` the first `S` is `2 p`, negative: the formulas continue analytically.

use super::profile::Profile;
use crate::elementary::{sqrt, sqrt_pos};

/// Error of the velocity, relative to its limit, within which a state counts as lying on the last
/// arc of a motion, where acceleration and velocity reach their targets together.
const ARC_ROUNDING: f64 = 1e-11;

/// One axis' motions of greatest displacement, jerk scaled to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Family {
    a0: f64,
    w: f64,
    vf: f64,
    /// `vf - w`, which is `p^2 - q^2` while neither acceleration is held.
    gap: f64,
    a_max: f64,
    offset: f64,
    /// Peak acceleration of the fastest motion.
    p_first: f64,
    /// Shortest possible duration: that of the fastest change of velocity.
    pub(super) t_first: f64,
    /// Duration from which on the motion cruises at the velocity limit.
    t_cruise: f64,
    /// The shape at `t_cruise`, and its displacement.
    cruising: Shape,
    d_cruise: f64,
}

/// One motion of a family.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    p: f64,
    q: f64,
    u: f64,
    hold_p: f64,
    hold_q: f64,
    cruise: f64,
}

/// Ordered times at which a function crosses a value.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Crossings {
    times: [f64; 4],
    count: u8,
}

impl Crossings {
    fn push(&mut self, t: f64) {
        if let Some(slot) = self.times.get_mut(usize::from(self.count)) {
            *slot = t;
            self.count = self.count.wrapping_add(1);
        }
    }

    /// The crossings in order.
    pub(super) fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        self.times.iter().copied().take(usize::from(self.count))
    }
}

impl Family {
    /// The motions from (`v0`, `a0`) to (`vf`, 0). The start must be within the limits, or be
    /// brought there by a brake first; rounding beyond them widens the limits by as much.
    pub(super) fn new(v0: f64, a0: f64, vf: f64, v_max: f64, a_max: f64) -> Self {
        let a_max = a_max.max(a0.abs());
        let w = v0 - 0.5 * a0 * a0;
        let crest = if a0 > 0.0 { v0 + 0.5 * a0 * a0 } else { v0 };
        let v_top = v_max.max(crest).max(vf);
        // On the last arc of a motion the state leaves no choice, and its rounding would show as
        // a short extra swing, of the length of its root.
        let arc = a0 * a0.max(0.0);
        let on_arc = (vf - w - arc).abs() <= ARC_ROUNDING * v_max;
        let gap = if on_arc { arc } else { vf - w };
        let vf = w + gap;
        let p_first = if gap > arc { sqrt(gap).min(a_max) } else { a0 };
        let (tp, tq) = (sides(v_top - w, a_max), sides(v_top - vf, a_max));
        let mut family = Self {
            a0,
            w,
            vf,
            gap,
            a_max,
            offset: a0 * (a0 * a0 * (1.0 / 3.0) - v0),
            p_first,
            t_first: 0.0,
            t_cruise: 2.0 * (tp.0 + tq.0) + tp.1 + tq.1 - a0,
            cruising: Shape {
                p: tp.0,
                q: tq.0,
                u: v_top,
                hold_p: tp.1,
                hold_q: tq.1,
                cruise: 0.0,
            },
            d_cruise: 0.0,
        };
        family.t_first = family.shortest();
        family.d_cruise = family.displacement(&family.cruising);
        family
    }

    /// Duration of the fastest change of velocity: up and back to zero, or down and back.
    fn shortest(&self) -> f64 {
        let Self { a0, gap, a_max, .. } = *self;
        let up = gap > a0 * a0.max(0.0);
        let (peak, hold) = sides(if up { gap } else { a0 * a0 - gap }, a_max);
        let t = 2.0 * peak + hold + if up { -a0 } else { a0 };
        t.max(0.0)
    }

    /// The motion of duration `t`; the fastest one where `t` is shorter than that.
    #[inline]
    pub(super) fn shape(&self, t: f64) -> Shape {
        let Self {
            a0,
            w,
            vf,
            gap,
            a_max,
            ..
        } = *self;
        if t >= self.t_cruise {
            return Shape {
                cruise: t - self.t_cruise,
                ..self.cruising
            };
        }
        let sum = 0.5 * (t.max(self.t_first) + a0);
        let difference = if sum > 0.0 { gap / sum } else { 0.0 };
        let p = (0.5 * (sum + difference)).max(self.p_first);
        let q = (sum - p).max(0.0);
        if p <= a_max && q <= a_max {
            return Shape {
                p,
                q,
                u: w + p * p,
                hold_p: 0.0,
                hold_q: 0.0,
                cruise: 0.0,
            };
        }
        if gap > 0.0 {
            let q = (sqrt_pos(2.0 * a_max * sum - gap) - a_max).max(0.0);
            let u = vf + q * q;
            if q <= a_max {
                let hold_p = ((u - w) / a_max - a_max).max(0.0);
                return Shape {
                    p: a_max,
                    q,
                    u,
                    hold_p,
                    hold_q: 0.0,
                    cruise: 0.0,
                };
            }
        } else {
            let p = (sqrt_pos(2.0 * a_max * sum + gap) - a_max).max(self.p_first);
            let u = w + p * p;
            if p <= a_max {
                let hold_q = ((u - vf) / a_max - a_max).max(0.0);
                return Shape {
                    p,
                    q: a_max,
                    u,
                    hold_p: 0.0,
                    hold_q,
                    cruise: 0.0,
                };
            }
        }
        let u = 0.5 * (w + vf) + a_max * (sum - a_max);
        Shape {
            p: a_max,
            q: a_max,
            u,
            hold_p: ((u - w) / a_max - a_max).max(0.0),
            hold_q: ((u - vf) / a_max - a_max).max(0.0),
            cruise: 0.0,
        }
    }

    /// Displacement of a motion of this family.
    #[inline]
    pub(super) fn displacement(&self, shape: &Shape) -> f64 {
        let Shape {
            p,
            q,
            u,
            hold_p,
            hold_q,
            cruise,
        } = *shape;
        (self.w + u) * (p + 0.5 * hold_p)
            + (u + self.vf) * (q + 0.5 * hold_q)
            + u * cruise
            + self.offset
    }

    /// The motion of duration `t`, with the signed jerk `jerk` for full jerk.
    pub(super) fn profile(&self, shape: &Shape, jerk: f64) -> Profile {
        let Shape {
            p,
            q,
            hold_p,
            hold_q,
            cruise,
            ..
        } = *shape;
        let (fall, fall_after) = if cruise > 0.0 {
            (p, q)
        } else {
            ((p + q).max(0.0), 0.0)
        };
        let rise = (p - self.a0).max(0.0);
        Profile {
            jerk,
            durations: [rise, hold_p, fall, cruise, fall_after, hold_q, q],
        }
    }

    /// The times after `t_first` at which the displacement crosses `d`, in order; `above` says on
    /// which side it starts. Dips through `d` by less than `tolerance` do not count.
    pub(super) fn crossings(&self, d: f64, above: bool, tolerance: f64) -> Crossings {
        let mut found = Crossings::default();
        let mut above = above;
        let mut from = self.t_first;
        let turns = self.turning_times();
        for to in turns.iter().chain([self.t_cruise]) {
            if to <= from {
                continue;
            }
            let end = if to >= self.t_cruise {
                self.d_cruise
            } else {
                self.displacement_at(to)
            };
            let crosses = if above { end < d - tolerance } else { end >= d };
            if crosses {
                found.push(self.solve(d, from, to, !above));
                above = !above;
            }
            from = to;
        }
        if !above {
            found.push(self.t_cruise + (d - self.d_cruise).max(0.0) / self.cruising.u);
        }
        found
    }

    /// The one time at which the displacement reaches `d`, where the final velocity is 0: from
    /// then on the axis could wait at the target, so that there is no second crossing.
    pub(super) fn only_crossing(&self, d: f64) -> f64 {
        if d >= self.d_cruise {
            self.t_cruise + (d - self.d_cruise) / self.cruising.u
        } else {
            self.solve(d, self.t_first, self.t_cruise, true)
        }
    }

    fn displacement_at(&self, t: f64) -> f64 {
        self.displacement(&self.shape(t))
    }

    /// The crossing of `d` between `low` and `high` by Newton's method kept in its bracket.
    /// The displacement is convex in time where the peak acceleration is positive, so that it
    /// converges from above without a detour.
    fn solve(&self, d: f64, low: f64, high: f64, rising: bool) -> f64 {
        let sign = if rising { 1.0 } else { -1.0 };
        let (mut low, mut high) = (low, high);
        let mut t = high;
        for _ in 0..80 {
            let shape = self.shape(t);
            let error = sign * (self.displacement(&shape) - d);
            let slope = sign * (shape.u + 0.5 * shape.p * shape.q);
            if error > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let step = error / slope;
            let next = t - step;
            if slope > 0.0 && next >= low && next <= high {
                if step.abs() <= 1e-10 * t {
                    return next;
                }
                t = next;
            } else {
                let middle = 0.5 * (low + high);
                if (high - low) <= 1e-15 * high {
                    return middle;
                }
                t = middle;
            }
        }
        t
    }

    /// The times between `t_first` and `t_cruise` at which the displacement turns round, where
    /// `u + p q / 2 = 0`; at most two, in order. Each of the four combinations of held and free
    /// accelerations has its own closed form.
    fn turning_times(&self) -> Crossings {
        let Self {
            a0,
            w,
            vf,
            gap,
            a_max: a,
            ..
        } = *self;
        let square = a * a;
        let mut times = [f64::NAN; 6];
        let c = w + vf;
        let root = c * c - 0.75 * gap * gap;
        if root >= 0.0 {
            let root = sqrt(root);
            for (time, sign) in times.iter_mut().zip([-1.0, 1.0]) {
                let s = sqrt_pos((sign * root - c) * (2.0 / 3.0));
                let (p, q) = (0.5 * (s + gap / s), 0.5 * (s - gap / s));
                if s > 0.0 && p <= a && q <= a && q >= 0.0 {
                    *time = 2.0 * s - a0;
                }
            }
        }
        let root = square - 16.0 * w;
        if root >= 0.0 {
            let root = sqrt(root);
            for (time, sign) in times.iter_mut().skip(2).zip([-1.0, 1.0]) {
                let p = 0.25 * (sign * root - a);
                if p <= a && p * p - gap >= square {
                    *time = 2.0 * p - a0 + a + (p * p - gap) / a;
                }
            }
        }
        let root = square - 16.0 * vf;
        if root >= 0.0 {
            let q = 0.25 * (sqrt(root) - a);
            if q >= 0.0 && q <= a && q * q + gap >= square {
                times[4] = 2.0 * q - a0 + a + (q * q + gap) / a;
            }
        }
        let u = -0.5 * square;
        if u - w >= square && u - vf >= square {
            times[5] = 2.0 * a - a0 + (2.0 * u - c) / a;
        }
        self.inside_in_order(&times)
    }

    fn inside_in_order(&self, times: &[f64; 6]) -> Crossings {
        let mut ordered = Crossings::default();
        let mut after = self.t_first;
        for _ in 0..4 {
            let next = times
                .iter()
                .copied()
                .filter(|t| *t > after && *t < self.t_cruise)
                .fold(f64::INFINITY, f64::min);
            if next == f64::INFINITY {
                break;
            }
            ordered.push(next);
            after = next;
        }
        ordered
    }
}

/// Peak and hold time of the symmetric change of velocity by `x`.
#[inline(always)]
fn sides(x: f64, a_max: f64) -> (f64, f64) {
    let square = a_max * a_max;
    if x > square {
        (a_max, x / a_max - a_max)
    } else {
        (sqrt_pos(x), 0.0)
    }
}
