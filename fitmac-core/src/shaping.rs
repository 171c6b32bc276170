//! Shaping: a jerk-limited setpoint towards the goal of the running action,
//! for robots that take a pose at control rate.
//!
//! The goal is LIBERO's: the measured pose at the start of the action, plus the
//! increment. A zero rotation keeps the orientation that was last asked for.

use kinematics::{
    otg::{Input, Limits, Otg, State, Target},
    rotation::{self, UnitQuaternion},
    vector::{self, Vector3},
};

use crate::{
    filter::Commanded,
    message::{Action, StateSample},
    params::Params,
    signals::hand,
};

/// The setpoint of one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setpoint {
    /// Tool centre point, base frame, m.
    pub position_m: Vector3,
    /// Its velocity, m/s.
    pub velocity_m_s: Vector3,
    /// Its acceleration, m/s^2.
    pub acceleration_m_s2: Vector3,
    /// Orientation.
    pub orientation: UnitQuaternion,
}

/// Goal and motion of the setpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaper {
    translation: Otg<3>,
    translation_goal: Target<3>,
    /// Motion of the rotation vector that leads from `rotation_base`.
    rotation: Otg<3>,
    rotation_goal: Target<3>,
    rotation_base: UnitQuaternion,
    /// The last setpoint's.
    orientation: UnitQuaternion,
}

impl Shaper {
    /// At rest where the robot is.
    pub(crate) fn at(sample: &StateSample) -> Self {
        let pose = hand(sample);
        Self {
            translation: Otg::new(State::at_rest(sample.ee_position_m)),
            translation_goal: Target::Stop,
            rotation: Otg::new(State::at_rest([0.0; 3])),
            rotation_goal: Target::Stop,
            rotation_base: pose.orientation,
            orientation: pose.orientation,
        }
    }

    /// A new action starts: its goal is the measured pose plus the increment,
    /// which does not lead out of the workspace.
    pub(crate) fn aim(&mut self, params: &Params, sample: &StateSample, action: &Action) {
        let [x, y, z, rx, ry, rz, _] = *action;
        let step = vector::scale([x, y, z], params.action.translation_m);
        let [gx, gy, gz] = vector::add(sample.ee_position_m, step);
        let [lower, upper] = params.filter.workspace_and(sample.ee_position_m);
        let ([lx, ly, lz], [ux, uy, uz]) = (lower, upper);
        let position = [gx.max(lx).min(ux), gy.max(ly).min(uy), gz.max(lz).min(uz)];
        self.translation_goal = Target::Reach {
            position,
            velocity: [0.0; 3],
        };
        if [rx, ry, rz] != [0.0; 3] {
            let turn = vector::scale([rx, ry, rz], params.action.rotation_rad);
            self.aim_rotation(
                UnitQuaternion::from_rotation_vector(turn) * hand(sample).orientation,
            );
        }
    }

    /// The rotation goes on from where it is: its vector stays short, however far the hand turns.
    fn aim_rotation(&mut self, goal: UnitQuaternion) {
        let now = self.rotation.state();
        let (velocity, acceleration) =
            rotation::angular_motion(now.position, now.velocity, now.acceleration);
        self.rotation_base = self.orientation;
        self.rotation = Otg::new(State {
            position: [0.0; 3],
            velocity,
            acceleration,
        });
        self.rotation_goal = Target::Reach {
            position: (goal * self.rotation_base.inverse()).to_rotation_vector(),
            velocity: [0.0; 3],
        };
    }

    /// The last filter let something else pass: go on from there.
    pub(crate) fn follow(&mut self, commanded: &Commanded) {
        self.translation = Otg::new(State {
            position: commanded.position_m,
            velocity: commanded.velocity_m_s,
            acceleration: commanded.acceleration_m_s2,
        });
    }

    /// Come to rest as soon as the limits allow.
    pub(crate) fn halt(&mut self) {
        self.translation_goal = Target::Stop;
        self.rotation_goal = Target::Stop;
    }

    /// The setpoint `dt_s` later.
    pub(crate) fn step(&mut self, params: &Params, dt_s: f64) -> Setpoint {
        let p = &params.shaping;
        let limits = |velocity: f64, acceleration: f64, jerk: f64| Limits {
            velocity: [velocity; 3],
            acceleration: [acceleration; 3],
            jerk: [jerk; 3],
        };
        let linear = limits(p.velocity_m_s, p.acceleration_m_s2, p.jerk_m_s3);
        let angular = limits(
            p.angular_velocity_rad_s,
            p.angular_acceleration_rad_s2,
            p.angular_jerk_rad_s3,
        );
        let moved = self
            .translation
            .update(
                &Input {
                    target: self.translation_goal,
                    limits: linear,
                },
                dt_s,
            )
            .state;
        let turned = self.rotation.update(
            &Input {
                target: self.rotation_goal,
                limits: angular,
            },
            dt_s,
        );
        self.orientation =
            UnitQuaternion::from_rotation_vector(turned.state.position) * self.rotation_base;
        Setpoint {
            position_m: moved.position,
            velocity_m_s: moved.velocity,
            acceleration_m_s2: moved.acceleration,
            orientation: self.orientation,
        }
    }
}

#[cfg(test)]
mod tests;
