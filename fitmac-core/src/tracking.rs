//! Tracking: steadies the poses of target and destination, and carries the
//! target along with the hand.
//!
//! Poses come late, noisy, or not at all. An object at rest is averaged over
//! its observations. A held one is followed in the frame of the hand, each
//! observation compared with where the hand was *then*, so that a late or
//! missing pose does not look like a drop.

use kinematics::vector::{self, Vector3};

use crate::{
    intake::robot,
    message::{ObjectId, ObjectSample, StateSample},
    params::{Params, Tracking as TrackingParams},
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

/// The steadied place of one object.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Track {
    id: ObjectId,
    stamp_ns: u64,
    position_m: Vector3,
}

/// A steadied vector: part of the way to the new observation, all of it after
/// a jump.
fn steady(params: &TrackingParams, before_m: Vector3, seen_m: Vector3) -> Vector3 {
    if vector::distance(before_m, seen_m) > params.jump_m {
        seen_m
    } else {
        vector::lerp(before_m, seen_m, params.gain)
    }
}

impl Track {
    /// Takes an observation of `object`, once.
    fn follow(params: &TrackingParams, before: Option<Self>, object: &ObjectSample) -> Self {
        let position_m = match before {
            Some(t) if t.id == object.id && t.stamp_ns == object.stamp_ns => t.position_m,
            Some(t) if t.id == object.id => steady(params, t.position_m, object.position_m),
            _ => object.position_m,
        };
        Self {
            id: object.id,
            stamp_ns: object.stamp_ns,
            position_m,
        }
    }
}

/// The tracker's memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracking {
    past: [Option<HandAt>; PAST],
    target: Option<Track>,
    anchor: Option<Track>,
    in_hand_m: Option<Vector3>,
}

impl Tracking {
    pub(crate) const fn new() -> Self {
        Self {
            past: [None; PAST],
            target: None,
            anchor: None,
            in_hand_m: None,
        }
    }

    /// True while the target is held and followed in the hand's frame.
    #[must_use]
    pub const fn is_carried(&self) -> bool {
        self.in_hand_m.is_some()
    }

    /// Centre of the target, base frame, m.
    #[must_use]
    pub fn target_m(&self, sample: &StateSample) -> Option<Vector3> {
        match self.in_hand_m {
            Some(offset) => Some(hand(sample).transform_point(offset)),
            None => self.target.map(|t| t.position_m),
        }
    }

    /// Centre of the destination's anchor, base frame, m.
    #[must_use]
    pub fn anchor_m(&self) -> Option<Vector3> {
        self.anchor.map(|t| t.position_m)
    }

    /// Notes a policy step: the hand, and whether it holds something.
    pub(crate) fn step(
        &mut self,
        params: &Params,
        sample: &StateSample,
        target: ObjectId,
        anchor: ObjectId,
        holding: bool,
    ) {
        self.past.rotate_right(1);
        if let Some(newest) = self.past.first_mut() {
            *newest = Some(HandAt {
                stamp_ns: sample.stamp_ns,
                ee_m: sample.ee_position_m,
            });
        }
        self.anchor = robot::object(sample, anchor)
            .map(|object| Track::follow(&params.tracking, self.anchor, object));
        let Some(object) = robot::object(sample, target) else {
            self.target = None;
            self.in_hand_m = None;
            return;
        };
        let is_news = self
            .target
            .is_none_or(|t| t.id != target || t.stamp_ns != object.stamp_ns);
        let was_m = self
            .in_hand_m
            .map(|offset| hand(sample).transform_point(offset));
        self.in_hand_m = holding
            .then(|| self.grip(params, sample, object, is_news))
            .flatten();
        self.target = Some(match (was_m, self.in_hand_m) {
            // Let go: it starts from where the hand had it.
            (Some(position_m), None) => {
                let left = Track {
                    id: target,
                    stamp_ns: object.stamp_ns,
                    position_m,
                };
                if is_news {
                    Track::follow(
                        &params.tracking,
                        Some(Track {
                            stamp_ns: 0,
                            ..left
                        }),
                        object,
                    )
                } else {
                    left
                }
            }
            _ => Track::follow(&params.tracking, self.target, object),
        });
    }

    /// Where in the hand's frame the target is, if it is in the hand, m.
    fn grip(
        &self,
        params: &Params,
        sample: &StateSample,
        object: &ObjectSample,
        is_news: bool,
    ) -> Option<Vector3> {
        if object.visible == 0 || !is_news {
            return self.in_hand_m;
        }
        let then_m = self
            .hand_at(object.stamp_ns)
            .unwrap_or(sample.ee_position_m);
        let seen_m = vector::add(object.position_m, vector::sub(sample.ee_position_m, then_m));
        let offset_m = hand(sample).inverse().transform_point(seen_m);
        let near = vector::norm(offset_m) < params.gripper.held_radius_m;
        near.then(|| match self.in_hand_m {
            Some(before_m) => steady(&params.tracking, before_m, offset_m),
            None => offset_m,
        })
    }

    /// The tool centre point at `stamp_ns`, interpolated, m.
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

#[cfg(test)]
mod tests;
