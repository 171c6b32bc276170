//! Torque-level operational-space control of the arm, with robosuite's `OSC_POSE` conventions as
//! LIBERO configures them.
//!
//! At each policy step the goal becomes the *measured* pose plus the action's increment; at each
//! physics step the arm is driven to the goal as a critically damped unit mass, translation and
//! rotation decoupled (O. Khatib, "A unified approach for motion and force control of robot
//! manipulators: the operational space formulation", IEEE J. Robotics and Automation 3(1), 1987).
//! A zero rotation keeps the last commanded orientation, as robosuite does: an arm that was handed
//! over tilted stays tilted until somebody levels it.

use nalgebra::{Matrix3, Matrix6, Rotation3, SMatrix, SVector, Vector3, Vector6};

use crate::action::{Action, PHYSICS_STEP_S, POSITION_SCALE_M, ROTATION_SCALE_RAD};
use crate::panda::{
    ARM_JOINTS, GRIPPER_CLOSE_SETPOINT_M, GRIPPER_OPEN_SETPOINT_M, GRIPPER_RATE_M_S, HOME_RAD,
};

/// A column of joint quantities.
pub type JointVector = SVector<f64, ARM_JOINTS>;
/// The geometric Jacobian of the tool centre point: linear rows first, base frame.
pub type Jacobian = SMatrix<f64, 6, ARM_JOINTS>;
/// The joint-space inertia.
pub type JointInertia = SMatrix<f64, ARM_JOINTS, ARM_JOINTS>;

/// Gains. The defaults are robosuite's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Stiffness of the unit-mass task dynamics, 1/s^2.
    pub stiffness: f64,
    /// Damping ratio of the task dynamics; 1 is critical.
    pub damping_ratio: f64,
    /// Stiffness of the posture in the null space, 1/s^2.
    pub posture_stiffness: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self {
            stiffness: 150.0,
            damping_ratio: 1.0,
            posture_stiffness: 10.0,
        }
    }
}

/// What the controller needs to know of the arm at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmDynamics {
    /// Joint positions, rad.
    pub position_rad: JointVector,
    /// Joint velocities, rad/s.
    pub velocity_rad_s: JointVector,
    /// Tool centre point, base frame, m.
    pub tcp_m: Vector3<f64>,
    /// Orientation of the tool, base frame.
    pub tcp_rotation: Rotation3<f64>,
    /// Geometric Jacobian of the tool centre point.
    pub jacobian: Jacobian,
    /// Joint-space inertia, kg m^2.
    pub inertia: JointInertia,
    /// Coriolis, centrifugal and gravity torque, N m.
    pub bias_nm: JointVector,
}

/// The controller: gains and the latched goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Osc {
    gains: Gains,
    goal_m: Vector3<f64>,
    goal_rotation: Rotation3<f64>,
    gripper_goal_m: f64,
    gripper_setpoint_m: f64,
}

impl Osc {
    /// Holds the given pose with the gripper open.
    #[must_use]
    pub fn new(gains: Gains, tcp_m: Vector3<f64>, tcp_rotation: Rotation3<f64>) -> Self {
        Self {
            gains,
            goal_m: tcp_m,
            goal_rotation: tcp_rotation,
            gripper_goal_m: GRIPPER_OPEN_SETPOINT_M,
            gripper_setpoint_m: GRIPPER_OPEN_SETPOINT_M,
        }
    }

    /// Takes an action at a policy step: the goal becomes the measured pose plus the increment.
    ///
    /// Components outside [-1, 1] are clipped, as robosuite clips them; a component that is not
    /// finite counts as zero, so that no goal is ever undefined. A gripper value of zero keeps the
    /// last command.
    pub fn latch(&mut self, tcp_m: Vector3<f64>, tcp_rotation: Rotation3<f64>, action: &Action) {
        let unit = |i: usize| {
            if action[i].is_finite() {
                action[i].clamp(-1.0, 1.0)
            } else {
                0.0
            }
        };
        self.goal_m = tcp_m + POSITION_SCALE_M * Vector3::new(unit(0), unit(1), unit(2));
        let turn = ROTATION_SCALE_RAD * Vector3::new(unit(3), unit(4), unit(5));
        if turn != Vector3::zeros() {
            self.goal_rotation = Rotation3::from_scaled_axis(turn) * tcp_rotation;
        }
        match unit(6) {
            g if g > 0.0 => self.gripper_goal_m = GRIPPER_CLOSE_SETPOINT_M,
            g if g < 0.0 => self.gripper_goal_m = GRIPPER_OPEN_SETPOINT_M,
            _ => {}
        }
    }

    /// Moves the gripper's set point on by one physics step and returns it: the half opening, m;
    /// negative presses.
    pub fn slew_gripper_m(&mut self) -> f64 {
        let reach = GRIPPER_RATE_M_S * PHYSICS_STEP_S;
        let missing = self.gripper_goal_m - self.gripper_setpoint_m;
        self.gripper_setpoint_m += missing.clamp(-reach, reach);
        self.gripper_setpoint_m
    }

    /// The goal position, base frame, m.
    #[must_use]
    pub fn goal_m(&self) -> Vector3<f64> {
        self.goal_m
    }

    /// Joint torques, N m, before the motors' limits.
    #[must_use]
    pub fn torque_nm(&self, arm: &ArmDynamics) -> JointVector {
        let Gains {
            stiffness,
            damping_ratio,
            posture_stiffness,
        } = self.gains;
        let damping = 2.0 * damping_ratio * libm::sqrt(stiffness);
        let velocity: Vector6<f64> = arm.jacobian * arm.velocity_rad_s;
        let linear = velocity.fixed_rows::<3>(0);
        let angular = velocity.fixed_rows::<3>(3);
        let force = stiffness * (self.goal_m - arm.tcp_m) - damping * linear;
        let moment =
            stiffness * rotation_error(&self.goal_rotation, &arm.tcp_rotation) - damping * angular;

        let inertia_inverse = invert_spd(&arm.inertia);
        let mobility: Matrix6<f64> = arm.jacobian * inertia_inverse * arm.jacobian.transpose();
        let linear_mobility: Matrix3<f64> = mobility.fixed_view::<3, 3>(0, 0).into_owned();
        let angular_mobility: Matrix3<f64> = mobility.fixed_view::<3, 3>(3, 3).into_owned();
        let mut wrench = Vector6::zeros();
        wrench
            .fixed_rows_mut::<3>(0)
            .copy_from(&(invert_spd(&linear_mobility) * force));
        wrench
            .fixed_rows_mut::<3>(3)
            .copy_from(&(invert_spd(&angular_mobility) * moment));

        let posture_damping = 2.0 * libm::sqrt(posture_stiffness);
        let posture = arm.inertia
            * (posture_stiffness * (JointVector::from(HOME_RAD) - arm.position_rad)
                - posture_damping * arm.velocity_rad_s);
        let jacobian_inverse = inertia_inverse * arm.jacobian.transpose() * invert_spd(&mobility);
        let null_space = JointInertia::identity() - jacobian_inverse * arm.jacobian;
        arm.jacobian.transpose() * wrench + arm.bias_nm + null_space.transpose() * posture
    }
}

/// robosuite's orientation error: half the sum of the cross products of the axes, which is the
/// sine of the angle times its axis.
fn rotation_error(goal: &Rotation3<f64>, now: &Rotation3<f64>) -> Vector3<f64> {
    let (g, n) = (goal.matrix(), now.matrix());
    0.5 * (0..3)
        .map(|i| n.column(i).cross(&g.column(i)))
        .sum::<Vector3<f64>>()
}

/// Inverse of a symmetric positive matrix. At a singular posture a mobility loses rank: a ridge
/// of 1e-6 of its trace then keeps the torque bounded instead of failing.
fn invert_spd<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let ridge = 1e-9 * matrix.trace();
    let try_with = |ridge: f64| {
        nalgebra::Cholesky::new(matrix + SMatrix::<f64, N, N>::identity() * ridge)
            .map(|factor| factor.inverse())
    };
    try_with(ridge)
        .or_else(|| try_with(1e3 * ridge))
        .unwrap_or_else(SMatrix::<f64, N, N>::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_small_turn_is_its_rotation_vector() {
        let turn = Vector3::new(0.01, -0.02, 0.015);
        let now = Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let error = rotation_error(&(Rotation3::from_scaled_axis(turn) * now), &now);
        assert!((error - turn).norm() < 1e-5, "{error}");
    }

    #[test]
    fn a_zero_rotation_keeps_the_commanded_orientation() {
        let start = Rotation3::from_euler_angles(core::f64::consts::PI, 0.0, 0.0);
        let mut osc = Osc::new(Gains::default(), Vector3::zeros(), start);
        let drifted = Rotation3::from_euler_angles(3.0, 0.1, 0.0);
        osc.latch(
            Vector3::zeros(),
            drifted,
            &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        );
        assert_eq!(osc.goal_rotation, start);
        assert_eq!(osc.goal_m(), Vector3::new(0.05, 0.0, 0.0));
        osc.latch(
            Vector3::zeros(),
            drifted,
            &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        );
        let expected = Rotation3::from_scaled_axis(Vector3::new(0.0, 0.0, 0.5)) * drifted;
        assert!((osc.goal_rotation.matrix() - expected.matrix()).norm() < 1e-12);
        assert_eq!(
            osc.gripper_goal_m, GRIPPER_CLOSE_SETPOINT_M,
            "zero keeps the gripper"
        );
    }

    #[test]
    fn an_action_that_is_not_finite_moves_nothing() {
        let start = Rotation3::identity();
        let here = Vector3::new(0.4, 0.1, 0.3);
        let mut osc = Osc::new(Gains::default(), here, start);
        osc.latch(here, start, &[f64::NAN; 7]);
        assert_eq!((osc.goal_m(), osc.goal_rotation), (here, start));
        osc.latch(here, start, &[9.0, -9.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(osc.goal_m(), here + Vector3::new(0.05, -0.05, 0.0));
    }
}
