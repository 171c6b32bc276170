//! From a waypoint to an action (equations 8 and 9).

use kinematics::vector::{self, Vector3};

use crate::{
    message::Action,
    params::{ActionScale, Filter},
};

/// The gripper command of a recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// -1.
    Open,
    /// +1.
    Close,
}

impl Grip {
    /// The gripper number of an action.
    #[must_use]
    pub const fn value(self) -> f64 {
        match self {
            Self::Open => -1.0,
            Self::Close => 1.0,
        }
    }
}

/// What a recovery wants in this query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Where the tool centre point shall go, base frame, m.
    pub waypoint_m: Vector3,
    /// Rotation still to make, base frame, rotation vector, rad.
    pub rotation_rad: Vector3,
    /// The gripper.
    pub grip: Grip,
}

impl Motion {
    /// To `waypoint_m` without turning.
    #[must_use]
    pub const fn to(waypoint_m: Vector3, grip: Grip) -> Self {
        Self {
            waypoint_m,
            rotation_rad: [0.0; 3],
            grip,
        }
    }
}

/// The translation of equation 8: `(p* - p_ee)` divided by the action scale,
/// clipped to [-1, 1]. `None` (the paper's bottom) if a coordinate is not
/// finite: a NaN has no place between -1 and 1.
#[must_use]
pub fn recovery_translation(
    scale: &ActionScale,
    waypoint_m: Vector3,
    ee_m: Vector3,
) -> Option<Vector3> {
    let [dx, dy, dz] = vector::sub(waypoint_m, ee_m);
    let ratio = [
        dx / scale.recovery_divisor_xy_m,
        dy / scale.recovery_divisor_xy_m,
        dz / scale.recovery_divisor_z_m,
    ];
    vector::is_finite(ratio).then(|| ratio.map(|x| x.clamp(-1.0, 1.0)))
}

/// The action of equation 9. The paper's rotation is zero; levelling and
/// turning a hand that arrives tilted or crossed put numbers there, and
/// nothing else does. `None` if the waypoint lies outside the workspace or is
/// not finite.
#[must_use]
pub fn recovery_action(
    scale: &ActionScale,
    workspace: &Filter,
    ee_m: Vector3,
    motion: &Motion,
) -> Option<Action> {
    if !workspace.contains(motion.waypoint_m) {
        return None;
    }
    let [x, y, z] = recovery_translation(scale, motion.waypoint_m, ee_m)?;
    if !vector::is_finite(motion.rotation_rad) {
        return None;
    }
    let [rx, ry, rz] = motion
        .rotation_rad
        .map(|r| (r / scale.rotation_rad).clamp(-1.0, 1.0));
    Some([x, y, z, rx, ry, rz, motion.grip.value()])
}
