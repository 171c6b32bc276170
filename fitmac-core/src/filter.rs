//! The last filter: unconditional limits on what leaves the core. It knows
//! limits, not reasons.
//!
//! Two things pass it. The action of a policy step: finite, inside the action
//! box, not out of the workspace. And the setpoint of a tick: finite, not out
//! of the workspace, and within velocity, acceleration and jerk of the last
//! *command*, whatever was measured meanwhile. What is outside already stays
//! or comes back, as it is asked to, and goes no further out.

use kinematics::vector::{self, Vector3};

use crate::{
    message::Action,
    params::{ActionScale, Filter},
};

/// Tolerance of the comparison between wanted and allowed: the setpoint
/// generator keeps its limits to rounding.
const ROUNDING: f64 = 1e-9;

/// A filtered value and whether the filter changed it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filtered<T> {
    /// What may leave.
    pub value: T,
    /// It differs from what was asked.
    pub limited: bool,
}

/// Limits an action that starts at `ee_m`. One that is not finite becomes a
/// zero increment with `gripper` kept.
#[must_use]
pub fn limit_action(
    scale: &ActionScale,
    workspace: &Filter,
    ee_m: Vector3,
    gripper: f64,
    wanted: &Action,
) -> Filtered<Action> {
    if !wanted.iter().all(|x| x.is_finite()) {
        return Filtered {
            value: still(gripper),
            limited: true,
        };
    }
    let mut value = wanted.map(|x| if x.abs() > 1.0 { x.clamp(-1.0, 1.0) } else { x });
    let [lower, upper] = workspace.workspace();
    for (((x, ee), lo), hi) in value.iter_mut().zip(ee_m).zip(lower).zip(upper) {
        let goal = ee + *x * scale.translation_m;
        // A hand that is already outside may move inwards, not further out.
        if (goal > hi && *x > 0.0) || (goal < lo && *x < 0.0) {
            let room = if *x > 0.0 {
                (hi - ee).max(0.0)
            } else {
                (lo - ee).min(0.0)
            };
            *x = room / scale.translation_m;
        }
    }
    Filtered {
        value,
        limited: value != *wanted,
    }
}

impl Filter {
    /// True if `p` lies in the workspace; false for a NaN.
    #[must_use]
    pub fn contains(&self, p: Vector3) -> bool {
        is_in(self.workspace(), p)
    }

    /// Least and greatest corner of the workspace, base frame, m.
    #[must_use]
    pub const fn workspace(&self) -> [Vector3; 2] {
        [
            [
                self.workspace_min_x_m,
                self.workspace_min_y_m,
                self.workspace_min_z_m,
            ],
            [
                self.workspace_max_x_m,
                self.workspace_max_y_m,
                self.workspace_max_z_m,
            ],
        ]
    }

    /// The same, large enough for `p`: what is outside may stay or come back,
    /// but go no further out.
    #[must_use]
    pub fn workspace_and(&self, p: Vector3) -> [Vector3; 2] {
        let ([lower, upper], [x, y, z]) = (self.workspace(), p);
        let ([lx, ly, lz], [ux, uy, uz]) = (lower, upper);
        [
            [lx.min(x), ly.min(y), lz.min(z)],
            [ux.max(x), uy.max(y), uz.max(z)],
        ]
    }
}

fn is_in([lower, upper]: [Vector3; 2], p: Vector3) -> bool {
    let mut axes = p.iter().zip(lower).zip(upper);
    axes.all(|((&x, lo), hi)| x >= lo && x <= hi)
}

/// The action of a hold: no increment, the gripper as it was.
#[must_use]
pub const fn still(gripper: f64) -> Action {
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, gripper]
}

/// The setpoint's translation as last commanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Commanded {
    /// Position, m.
    pub position_m: Vector3,
    /// Velocity, m/s.
    pub velocity_m_s: Vector3,
    /// Acceleration, m/s^2.
    pub acceleration_m_s2: Vector3,
}

impl Commanded {
    /// At rest at `position_m`.
    #[must_use]
    pub const fn at_rest(position_m: Vector3) -> Self {
        Self {
            position_m,
            velocity_m_s: [0.0; 3],
            acceleration_m_s2: [0.0; 3],
        }
    }

    /// The next command towards `wanted`, `dt_s` later: the wanted state if it
    /// keeps the limits against this one, else the nearest that does.
    #[must_use]
    pub fn step(&self, limits: &Filter, wanted: &Self, dt_s: f64) -> Filtered<Self> {
        if dt_s <= 0.0 || !dt_s.is_finite() {
            return Filtered {
                value: *self,
                limited: wanted.position_m != self.position_m,
            };
        }
        if self.allows(limits, wanted, dt_s) {
            return Filtered {
                value: *wanted,
                limited: false,
            };
        }
        let wanted_m = if vector::is_finite(wanted.position_m) {
            wanted.position_m
        } else {
            self.position_m
        };
        let [x, y, z] = [0, 1, 2].map(|axis| self.axis(limits, wanted_m, axis, dt_s));
        Filtered {
            value: Self {
                position_m: [x.0, y.0, z.0],
                velocity_m_s: [x.1, y.1, z.1],
                acceleration_m_s2: [x.2, y.2, z.2],
            },
            limited: true,
        }
    }

    fn allows(&self, limits: &Filter, wanted: &Self, dt_s: f64) -> bool {
        let slack = 1.0 + ROUNDING;
        let within = |v: Vector3, limit: f64| v.iter().all(|x| x.abs() <= limit * slack);
        let rate =
            |now: Vector3, before: Vector3| vector::scale(vector::sub(now, before), 1.0 / dt_s);
        is_in(limits.workspace_and(self.position_m), wanted.position_m)
            && within(
                rate(wanted.position_m, self.position_m),
                limits.velocity_m_s,
            )
            && within(wanted.velocity_m_s, limits.velocity_m_s)
            && within(wanted.acceleration_m_s2, limits.acceleration_m_s2)
            && within(
                rate(wanted.velocity_m_s, self.velocity_m_s),
                limits.acceleration_m_s2,
            )
            && within(
                rate(wanted.acceleration_m_s2, self.acceleration_m_s2),
                limits.jerk_m_s3,
            )
    }

    /// One axis: position, velocity and acceleration after `dt_s`, the jerk
    /// limited first, then the acceleration, then the velocity.
    fn axis(&self, limits: &Filter, wanted_m: Vector3, axis: usize, dt_s: f64) -> (f64, f64, f64) {
        let pick = |v: Vector3| v.get(axis).copied().unwrap_or(0.0);
        let [lower, upper] = limits.workspace_and(self.position_m).map(pick);
        let (p, v, a) = (
            pick(self.position_m),
            pick(self.velocity_m_s),
            pick(self.acceleration_m_s2),
        );
        let clip = |x: f64, limit: f64| x.max(-limit).min(limit);
        let wanted_v = (pick(wanted_m).max(lower).min(upper) - p) / dt_s;
        let wanted_a = (wanted_v - v) / dt_s;
        let jerk = clip((wanted_a - a) / dt_s, limits.jerk_m_s3);
        let acceleration = clip(a + jerk * dt_s, limits.acceleration_m_s2);
        let velocity = clip(v + acceleration * dt_s, limits.velocity_m_s);
        let acceleration = (velocity - v) / dt_s;
        (
            (p + velocity * dt_s).max(lower).min(upper),
            velocity,
            acceleration,
        )
    }
}

#[cfg(test)]
mod tests;
