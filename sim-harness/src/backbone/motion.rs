//! How the arm answers to an action, as a policy that was trained on demonstrations has learnt it.

use nalgebra::Vector3;

use crate::action::{POLICY_STEP_S, POSITION_SCALE_M};
use crate::osc::Gains;

/// Share of a critically damped unit mass's motion that the arm really makes: translation and
/// rotation are controlled as if decoupled, so holding the orientation drags on the translation.
/// Measured on this arm between 0.6 (towards and away from the base) and 0.95 (sideways).
const DRAG: f64 = 0.8;

/// The tool centre point as a critically damped unit mass that is pulled to the goal, dragging a
/// little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMass {
    /// Position, base frame, m.
    pub position_m: Vector3<f64>,
    /// Velocity, base frame, m/s.
    pub velocity_m_s: Vector3<f64>,
}

impl PointMass {
    /// The state after one policy step with the translation part of an action.
    #[must_use]
    pub fn after(&self, translation: Vector3<f64>) -> Self {
        let rate = libm::sqrt(Gains::default().stiffness);
        let goal = self.position_m + POSITION_SCALE_M * translation;
        let offset = self.position_m - goal;
        let slope = self.velocity_m_s + rate * offset;
        let decay = libm::exp(-rate * POLICY_STEP_S);
        let now = offset + slope * POLICY_STEP_S;
        let ideal = goal + now * decay;
        Self {
            position_m: self.position_m + DRAG * (ideal - self.position_m),
            velocity_m_s: DRAG * (slope - rate * now) * decay,
        }
    }

    /// The state after the arm was left alone for `wait_s` with its last goal: it comes to rest.
    #[must_use]
    pub fn coasting(&self, wait_s: f64) -> Self {
        let rate = libm::sqrt(Gains::default().stiffness);
        let decay = libm::exp(-rate * wait_s);
        Self {
            position_m: self.position_m + self.velocity_m_s * ((1.0 - decay) / rate),
            velocity_m_s: self.velocity_m_s * decay,
        }
    }

    /// The translation that leads to a waypoint without passing it, no longer than `speed`.
    #[must_use]
    pub fn towards(&self, waypoint_m: Vector3<f64>, speed: f64) -> Vector3<f64> {
        let wish = (waypoint_m - self.position_m) / POSITION_SCALE_M;
        let length = wish.norm();
        if length > speed {
            wish * (speed / length)
        } else {
            wish
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_goal_is_reached_without_overshoot() {
        let goal = Vector3::new(0.3, -0.2, 0.1);
        let mut mass = PointMass {
            position_m: Vector3::zeros(),
            velocity_m_s: Vector3::zeros(),
        };
        for _ in 0..120 {
            mass = mass.after(mass.towards(goal, 1.0));
            assert!(mass.position_m.norm() <= goal.norm() + 1e-9);
        }
        assert!((mass.position_m - goal).norm() < 1e-4, "{mass:?}");
    }
}
