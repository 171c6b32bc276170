//! Tracking: where the hand was when an object was seen, and where in the
//! hand a held object sits, so that late or missing poses of a held object
//! don't look like a drop.

use kinematics::vector::{self, Vector3};

use crate::{
    intake::robot,
    message::{ObjectId, StateSample},
    params::Params,
    signals::hand,
};

/// Hand poses remembered, one a policy step.
const PAST: usize = 12;

/// Where the hand was.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HandAt {
    stamp_ns: u64,
    ee_m: Vector3,
}

/// The tracker's memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracking {
    past: [Option<HandAt>; PAST],
    in_hand_m: Option<Vector3>,
}

impl Tracking {
    pub(crate) const fn new() -> Self {
        Self {
            past: [None; PAST],
            in_hand_m: None,
        }
    }

    /// The held target's centre in the hand's frame, m.
    #[must_use]
    pub const fn in_hand_m(&self) -> Option<Vector3> {
        self.in_hand_m
    }

    /// Notes a policy step: where the hand is and whether it holds the target.
    pub(crate) fn step(
        &mut self,
        params: &Params,
        sample: &StateSample,
        target: ObjectId,
        holding: bool,
    ) {
        self.past.rotate_right(1);
        if let Some(newest) = self.past.first_mut() {
            *newest = Some(HandAt {
                stamp_ns: sample.stamp_ns,
                ee_m: sample.ee_position_m,
            });
        }
        self.in_hand_m = match robot::object(sample, target) {
            Some(object) if holding && object.visible == 1 => {
                let seen_m = self.at_hand_now(sample, object.stamp_ns, object.position_m);
                let near =
                    vector::distance(seen_m, sample.ee_position_m) < params.gripper.held_radius_m;
                near.then(|| hand(sample).inverse().transform_point(seen_m))
            }
            Some(_) if holding => self.in_hand_m,
            _ => None,
        };
    }

    /// Where a thing that moves with the hand is now, if it was at `seen_m`
    /// when it was seen.
    fn at_hand_now(&self, sample: &StateSample, seen_ns: u64, seen_m: Vector3) -> Vector3 {
        let then = self.hand_at(seen_ns).unwrap_or(sample.ee_position_m);
        vector::add(seen_m, vector::sub(sample.ee_position_m, then))
    }

    /// The tool centre point at `stamp_ns`, interpolated.
    fn hand_at(&self, stamp_ns: u64) -> Option<Vector3> {
        let mut later: Option<HandAt> = None;
        for at in self.past.iter().flatten() {
            if at.stamp_ns <= stamp_ns {
                return Some(match later {
                    None => at.ee_m,
                    Some(later) => {
                        let span = later.stamp_ns.saturating_sub(at.stamp_ns);
                        let part = stamp_ns.saturating_sub(at.stamp_ns);
                        let share = if span == 0 {
                            0.0
                        } else {
                            part as f64 / span as f64
                        };
                        vector::lerp(at.ee_m, later.ee_m, share)
                    }
                });
            }
            later = Some(*at);
        }
        later.map(|at| at.ee_m)
    }
}
