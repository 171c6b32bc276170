//! What a policy step sees: gripper, target, destination, other things
//! (equation 2), and the steadying of poses behind it.

use fitmac_core::{
    message::{ObjectSample, StateSample},
    params::{Grasp, Params},
    wire::{GraspClass, PlaceRelation},
};

use super::space::{Frame, Point, apart, between, flat, length, minus, plus};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pads {
    Open,
    Closing,
    Holding,
    Empty,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) id: u16,
    pub(super) at: Point,
    pub(super) quaternion: [f64; 4],
    pub(super) half: Point,
    pub(super) half_height: f64,
    /// Centre above the underside; a bowl stands on a foot of 0.6 of its rim.
    pub(super) depth: f64,
    pub(super) class: GraspClass,
    pub(super) distance: f64,
    pub(super) beside: f64,
    pub(super) above: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) at: Point,
    pub(super) half: Point,
    pub(super) relation: PlaceRelation,
    pub(super) distance: f64,
    pub(super) beside: f64,
    pub(super) clearance: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Other {
    pub(super) id: u16,
    pub(super) distance: f64,
    pub(super) at: Point,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) ee: Point,
    pub(super) width: f64,
    pub(super) pads: Pads,
    pub(super) target: Option<Target>,
    pub(super) place: Option<Place>,
    pub(super) other: Option<Other>,
}

impl Look {
    pub(super) fn closed(&self) -> bool {
        [Pads::Holding, Pads::Empty].contains(&self.pads)
    }

    /// Whether the target lies where it should; unknown without both.
    pub(super) fn in_region(&self) -> Option<bool> {
        let (target, place) = (self.target?, self.place?);
        let inside = (0..2).all(|i| (target.at[i] - place.at[i]).abs() <= place.half[i]);
        let level = match place.relation {
            PlaceRelation::On => -0.02 < place.clearance && place.clearance < 0.03,
            PlaceRelation::In => {
                let sunk = place.at[2] - target.at[2];
                0.0 < sunk && sunk < place.half[2] + target.half_height
            }
        };
        Some(inside && level)
    }
}

/// The anchor of a direct destination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Anchor {
    pub(super) object: u16,
    pub(super) relation: PlaceRelation,
    pub(super) offset: Point,
    pub(super) half: Point,
}

pub(super) fn things(sample: &StateSample) -> &[ObjectSample] {
    &sample.objects[..sample.object_count as usize]
}

pub(super) fn thing(sample: &StateSample, id: u16) -> Option<&ObjectSample> {
    things(sample).iter().find(|o| id != 0 && o.id == id)
}

pub(super) fn class(object: &ObjectSample) -> GraspClass {
    GraspClass::ALL
        .iter()
        .copied()
        .find(|c| c.code() == object.grasp_class)
        .expect("validated")
}

fn depth(object: &ObjectSample) -> f64 {
    let [x, y, z] = object.half_extent_m;
    let half = match class(object) {
        GraspClass::Bowl => [0.6 * x, 0.6 * y, z],
        _ => [x, y, z],
    };
    Frame::new(object.orientation).half_height(half)
}

pub(super) fn half_height(object: &ObjectSample) -> f64 {
    Frame::new(object.orientation).half_height(object.half_extent_m)
}

/// Height of the grasp point above the centre.
fn grasp_height(p: &Grasp, class: GraspClass, half_height: f64) -> f64 {
    let wanted = if class == GraspClass::Bowl {
        half_height - p.rim_depth_m
    } else if 2.0 * half_height > p.tall_m {
        half_height - p.below_top_m
    } else {
        0.0
    };
    wanted.max(p.floor_m - half_height)
}

/// Radius of the rim that is grasped; 0 for what is grasped at its axis.
pub(super) fn rim(p: &Grasp, class: GraspClass, half: Point) -> f64 {
    if class == GraspClass::Bowl {
        (half[0].min(half[1]) - p.rim_inset_m).max(0.0)
    } else {
        0.0
    }
}

/// The grasp point's height, base frame.
pub(super) fn grasp_z(p: &Grasp, target: &Target) -> f64 {
    target.at[2] + grasp_height(p, target.class, target.half_height)
}

/// From the nearest grasp point of a thing at `at` to the end effector.
fn reach(p: &Grasp, object: &ObjectSample, at: Point, ee: Point) -> Point {
    let [dx, dy, dz] = minus(ee, at);
    let up = dz - grasp_height(p, class(object), half_height(object));
    let radius = rim(p, class(object), object.half_extent_m);
    let away = flat([dx, dy, 0.0]);
    if radius <= 0.0 {
        [dx, dy, up]
    } else if away > 1e-9 {
        let share = (away - radius) / away;
        [dx * share, dy * share, up]
    } else {
        [radius, 0.0, up]
    }
}

pub(super) fn pads(p: &Params, sample: &StateSample, before: f64, told_closed: bool) -> Pads {
    let g = &p.gripper;
    let width = sample.gripper_width_m;
    let thin = things(sample).iter().any(|o| {
        let reach = o.half_extent_m[0].max(o.half_extent_m[1]) + g.held_radius_m;
        class(o) == GraspClass::Bowl && apart(o.position_m, sample.ee_position_m) < reach
    });
    let narrow = width < g.closed_ratio * g.open_width_m;
    let change = width - before;
    let rules = [
        // Fingers that give way while they are told to close are not opening.
        (change > g.moving_m && !(told_closed && narrow), Pads::Open),
        (!narrow && !told_closed, Pads::Open),
        (change < -g.moving_m, Pads::Closing),
        (
            !narrow && width > g.open_width_m - 2.0 * g.moving_m,
            Pads::Open,
        ),
        (
            width
                < if thin {
                    g.empty_thin_width_m
                } else {
                    g.empty_width_m
                },
            Pads::Empty,
        ),
    ];
    let first = rules.iter().find(|(holds, _)| *holds);
    first.map_or(Pads::Holding, |(_, pads)| *pads)
}

/// A steadied pose: whose, of which observation, where.
type Track = (u16, u64, Point);

/// Poses of target and anchor as they are steadied.
#[derive(Clone, Debug, Default)]
pub(super) struct Steady {
    hands: Vec<(u64, Point)>,
    target: Option<Track>,
    anchor: Option<Track>,
    in_hand: Option<Point>,
}

impl Steady {
    pub(super) fn carried(&self) -> bool {
        self.in_hand.is_some()
    }

    pub(super) fn step(
        &mut self,
        p: &Params,
        sample: &StateSample,
        target: u16,
        anchor: u16,
        holding: bool,
    ) {
        let ee = sample.ee_position_m;
        let hand = Frame::new(sample.ee_orientation);
        let steady = |old: Point, new: Point| {
            if apart(old, new) > p.tracking.jump_m {
                new
            } else {
                between(old, new, p.tracking.gain)
            }
        };
        let follow = |before: Option<Track>, o: &ObjectSample| -> Track {
            let at = match before {
                Some((id, stamp, at)) if id == o.id => {
                    if stamp == o.stamp_ns {
                        at
                    } else {
                        steady(at, o.position_m)
                    }
                }
                _ => o.position_m,
            };
            (o.id, o.stamp_ns, at)
        };
        self.hands.push((sample.stamp_ns, ee));
        self.anchor = thing(sample, anchor).map(|o| follow(self.anchor, o));
        let Some(object) = thing(sample, target) else {
            (self.target, self.in_hand) = (None, None);
            return;
        };
        let known = self.target.map(|(id, stamp, _)| (id, stamp));
        let news = known != Some((target, object.stamp_ns));
        let had = self.in_hand.map(|o| plus(hand.outwards(o), ee));
        self.in_hand = if !holding {
            None
        } else if object.visible == 0 || !news {
            self.in_hand
        } else {
            let moved = minus(ee, self.hand_at(object.stamp_ns));
            let offset = hand.inwards(minus(plus(object.position_m, moved), ee));
            let near = length(offset) < p.gripper.held_radius_m;
            near.then(|| self.in_hand.map_or(offset, |old| steady(old, offset)))
        };
        self.target = Some(match (had, self.in_hand) {
            (Some(at), None) if news => {
                // Let go: the next observation is averaged with where the hand had it.
                let left = (target, 0, at);
                let (id, _, at) = if object.stamp_ns == 0 {
                    left
                } else {
                    follow(Some(left), object)
                };
                (id, object.stamp_ns, at)
            }
            (Some(at), None) => (target, object.stamp_ns, at),
            _ => follow(self.target, object),
        });
    }

    /// Where the hand was at a time: between the two of its last twelve places
    /// that enclose it.
    fn hand_at(&self, stamp: u64) -> Point {
        let last = &self.hands[self.hands.len().saturating_sub(12)..];
        match last.iter().rposition(|(at, _)| *at <= stamp) {
            None => last[0].1,
            Some(i) if i + 1 == last.len() => last[i].1,
            Some(i) => {
                let ((t0, p0), (t1, p1)) = (last[i], last[i + 1]);
                let span = t1.saturating_sub(t0);
                let share = if span == 0 {
                    0.0
                } else {
                    stamp.saturating_sub(t0) as f64 / span as f64
                };
                between(p0, p1, share)
            }
        }
    }

    pub(super) fn look(
        &self,
        p: &Params,
        sample: &StateSample,
        pads: Pads,
        target: u16,
        anchor: Option<&Anchor>,
    ) -> Look {
        let ee = sample.ee_position_m;
        let hand = Frame::new(sample.ee_orientation);
        let carried = self.in_hand.map(|o| plus(hand.outwards(o), ee));
        let seen = thing(sample, target).map(|object| {
            let at = carried
                .or(self.target.map(|(_, _, at)| at))
                .unwrap_or(object.position_m);
            let offset = reach(&p.grasp, object, at, ee);
            Target {
                id: object.id,
                at,
                quaternion: object.orientation,
                half: object.half_extent_m,
                half_height: half_height(object),
                depth: depth(object),
                class: class(object),
                distance: length(offset),
                beside: flat(offset),
                above: offset[2],
            }
        });
        let place = anchor.zip(seen).and_then(|(anchor, target)| {
            let object = thing(sample, anchor.object)?;
            let origin = self.anchor.map_or(object.position_m, |(_, _, at)| at);
            let at = plus(
                Frame::new(object.orientation).outwards(anchor.offset),
                origin,
            );
            let [dx, dy, dz] = minus(target.at, at);
            let clearance = dz - target.depth;
            Some(Place {
                at,
                half: anchor.half,
                relation: anchor.relation,
                distance: length([dx, dy, clearance]),
                beside: flat([dx, dy, 0.0]),
                clearance,
            })
        });
        let fixed = anchor.map_or(0, |a| a.object);
        let mut others: Vec<Other> = things(sample)
            .iter()
            .filter(|o| o.id != 0 && o.id != target && o.id != fixed)
            .filter(|o| class(o) != GraspClass::Fixture)
            .map(|o| Other {
                id: o.id,
                distance: length(reach(&p.grasp, o, o.position_m, ee)),
                at: o.position_m,
            })
            .collect();
        // Stable: among equals the first of the sample.
        others.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        Look {
            ee,
            width: sample.gripper_width_m,
            pads,
            target: seen,
            place,
            other: others.first().copied(),
        }
    }
}
