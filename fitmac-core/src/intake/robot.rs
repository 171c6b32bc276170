//! Intake of robot state.

use kinematics::{rotation::UnitQuaternion, vector};

use super::{Refusal, age_ns, is_newer, ms_to_ns};
use crate::{
    message::{OBJECT_CAPACITY, ObjectId, ObjectSample, StateSample},
    params::StateIntake as StateParams,
};

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// A new sample; `discontinuous` if it doesn't continue the last one (a
    /// restart, or a jump that persisted), so that no difference may span it.
    Accepted {
        /// Differences to earlier samples are meaningless.
        discontinuous: bool,
    },
    /// The sample was seen before.
    Duplicate,
    /// Refused.
    Refused(Refusal),
}

/// The newest acceptable robot state.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotIntake {
    latest: Option<StateSample>,
    jumps: u32,
    /// The last sample that was refused as a jump.
    jumped: Option<u64>,
    /// Session and number of the newest sample; `None` where numbers begin anew.
    numbered: Option<(u64, u64)>,
}

impl RobotIntake {
    pub(crate) const fn new() -> Self {
        Self {
            latest: None,
            jumps: 0,
            jumped: None,
            numbered: None,
        }
    }

    /// A new episode: whatever number the next sample has, it is taken. A
    /// corrupt number may have shut out every sound one until now.
    pub(crate) fn number_afresh(&mut self) {
        self.numbered = None;
    }

    /// The newest accepted sample.
    #[must_use]
    pub const fn latest(&self) -> Option<&StateSample> {
        self.latest.as_ref()
    }

    /// Age of the newest accepted sample.
    #[must_use]
    pub fn age_ns(&self, now_ns: u64) -> Option<u64> {
        self.latest.as_ref().map(|s| age_ns(now_ns, s.stamp_ns))
    }

    pub(crate) fn step(
        &mut self,
        params: &StateParams,
        now_ns: u64,
        sample: &StateSample,
    ) -> Outcome {
        let restarted = match self.numbered {
            None => true,
            Some((session, _)) if session != sample.session => true,
            Some((_, last)) if last == sample.sequence => return Outcome::Duplicate,
            Some(_) if self.jumped == Some(sample.sequence) => return Outcome::Duplicate,
            Some((_, last)) if !is_newer(sample.sequence, last) => {
                return Outcome::Refused(Refusal::Sequence);
            }
            Some(_) => false,
        };
        if let Err(refusal) = validate(params, now_ns, sample) {
            return Outcome::Refused(refusal);
        }
        let jumped = !restarted && self.is_jump(params, sample);
        if jumped && self.jumps < params.jump_samples {
            self.jumps = self.jumps.saturating_add(1);
            self.jumped = Some(sample.sequence);
            return Outcome::Refused(Refusal::Jump);
        }
        self.jumps = 0;
        self.jumped = None;
        self.numbered = Some((sample.session, sample.sequence));
        self.keep(sample);
        Outcome::Accepted {
            discontinuous: restarted || jumped,
        }
    }

    /// Copies the objects in use only: a full sample has room for 32. The other
    /// slots may hold anything; they are emptied, as a snapshot must equal itself.
    fn keep(&mut self, sample: &StateSample) {
        let Some(kept) = &mut self.latest else {
            let kept = self.latest.insert(*sample);
            let unused = kept.objects.iter_mut().skip(sample.object_count as usize);
            unused.for_each(|o| *o = ObjectSample::default());
            return;
        };
        let used_before = kept.object_count as usize;
        // All fields are named, so that a new one cannot be forgotten.
        let StateSample {
            sequence,
            session,
            stamp_ns,
            applied_command,
            joint_position_rad,
            joint_velocity_rad_s,
            ee_position_m,
            ee_orientation,
            ee_velocity_m_s,
            gripper_width_m,
            object_count,
            reserved,
            objects,
        } = sample;
        kept.sequence = *sequence;
        kept.session = *session;
        kept.stamp_ns = *stamp_ns;
        kept.applied_command = *applied_command;
        kept.joint_position_rad = *joint_position_rad;
        kept.joint_velocity_rad_s = *joint_velocity_rad_s;
        kept.ee_position_m = *ee_position_m;
        kept.ee_orientation = *ee_orientation;
        kept.ee_velocity_m_s = *ee_velocity_m_s;
        kept.gripper_width_m = *gripper_width_m;
        kept.object_count = *object_count;
        kept.reserved = *reserved;
        let used = *object_count as usize;
        for (slot, object) in kept.objects.iter_mut().zip(objects).take(used) {
            *slot = *object;
        }
        for slot in kept.objects.iter_mut().take(used_before).skip(used) {
            *slot = ObjectSample::default();
        }
    }

    fn is_jump(&self, params: &StateParams, sample: &StateSample) -> bool {
        self.latest.as_ref().is_some_and(|last| {
            let seconds = age_ns(sample.stamp_ns, last.stamp_ns) as f64 * 1e-9;
            let reach = params.jump_margin_m + params.jump_speed_m_s * seconds;
            vector::distance(last.ee_position_m, sample.ee_position_m) > reach
        })
    }
}

fn validate(params: &StateParams, now_ns: u64, sample: &StateSample) -> Result<(), Refusal> {
    let count = sample.object_count as usize;
    if count > OBJECT_CAPACITY {
        return Err(Refusal::TooLong);
    }
    if sample.stamp_ns.saturating_sub(now_ns) > ms_to_ns(params.future_skew_ms) {
        return Err(Refusal::FromFuture);
    }
    let finite = sample.joint_position_rad.iter().all(|x| x.is_finite())
        && sample.joint_velocity_rad_s.iter().all(|x| x.is_finite())
        && vector::is_finite(sample.ee_velocity_m_s)
        && sample.gripper_width_m.is_finite();
    if !finite {
        return Err(Refusal::NotFinite);
    }
    validate_pose(params, sample.ee_position_m, sample.ee_orientation)?;
    sample
        .objects
        .iter()
        .take(count)
        .try_for_each(|object| validate_object(params, object))
}

fn validate_object(params: &StateParams, object: &ObjectSample) -> Result<(), Refusal> {
    if crate::wire::GraspClass::try_from(object.grasp_class).is_err() || object.visible > 1 {
        return Err(Refusal::UnknownCode);
    }
    let extent_ok = object
        .half_extent_m
        .iter()
        .all(|&h| h >= 0.0 && h <= params.plausible_position_m);
    if !extent_ok || !object.confidence.is_finite() {
        return Err(Refusal::NotFinite);
    }
    validate_pose(params, object.position_m, object.orientation)
}

fn validate_pose(
    params: &StateParams,
    position: [f64; 3],
    orientation: [f64; 4],
) -> Result<(), Refusal> {
    if !vector::is_finite(position) || !orientation.iter().all(|x| x.is_finite()) {
        return Err(Refusal::NotFinite);
    }
    if position
        .iter()
        .any(|x| x.abs() > params.plausible_position_m)
    {
        return Err(Refusal::Implausible);
    }
    let square: f64 = orientation.iter().map(|x| x * x).sum();
    // |q| within 1e-5 of 1, as libfranka demands of a transformation.
    if (square - 1.0).abs() > 2e-5 || UnitQuaternion::from_wxyz(orientation).is_none() {
        return Err(Refusal::Quaternion);
    }
    Ok(())
}

/// The object `id` in `sample`.
#[must_use]
pub fn object(sample: &StateSample, id: ObjectId) -> Option<&ObjectSample> {
    if id == 0 {
        return None;
    }
    objects(sample).find(|o| o.id == id)
}

/// The objects in use.
pub fn objects(sample: &StateSample) -> impl Iterator<Item = &ObjectSample> {
    sample.objects.iter().take(sample.object_count as usize)
}
