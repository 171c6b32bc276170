//! Showing what another simulator or a robot measured.

use super::{STATE, Sim};
use crate::error::SimError;
use crate::panda::ARM_JOINTS;
use crate::pose::Pose;

impl Sim {
    /// Shows what another simulator or a robot measured: for pictures of it. Velocities are zero;
    /// furniture and objects that are not named stay where they are.
    ///
    /// # Errors
    /// [`SimError::Invalid`] if a number is not finite or an orientation has no length.
    pub fn show(
        &mut self,
        joint_position_rad: &[f64; ARM_JOINTS],
        gripper_width_m: f64,
        objects: &[(u16, Pose)],
    ) -> Result<(), SimError> {
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        if !finite(joint_position_rad) || !finite(&[gripper_width_m]) {
            return Err(SimError::invalid("robot to show", "it is not finite"));
        }
        for (id, pose) in objects {
            let length2: f64 = pose.orientation.iter().map(|x| x * x).sum();
            if !finite(&pose.position_m) || !length2.is_finite() || length2 < 0.5 {
                let problem = "its pose is not finite, or its orientation no unit quaternion";
                return Err(SimError::invalid(format!("object {id} to show"), problem));
            }
        }
        self.data.qvel_mut().fill(0.0);
        let qpos = self.data.qpos_mut();
        qpos[..ARM_JOINTS].copy_from_slice(joint_position_rad);
        qpos[ARM_JOINTS..ARM_JOINTS + 2].fill(0.5 * gripper_width_m);
        for (id, pose) in objects {
            let index = usize::from(*id).checked_sub(1);
            let index = index.and_then(|i| self.objects.get(i));
            if let Some((at, _)) = index.and_then(|i| i.joint) {
                qpos[at..at + 3].copy_from_slice(&pose.position_m);
                qpos[at + 3..at + 7].copy_from_slice(&pose.orientation);
            }
        }
        let state = self.data.state(STATE);
        self.load(&state);
        Ok(())
    }
}
