//! Spatial relations as scores over poses.
//!
//! Each score lies in [0, 1]: about 1 where the relation plainly holds, about
//! 0 where it plainly doesn't, and 0.5 at the boundary. The boundaries are
//! conventions of table-top scenes; their softness is the noise of a modelled
//! detector.

use crate::planner::Relation;

use super::viewpoint::ViewAxes;

/// Softness of a boundary, m: about the position noise of a detection.
const SOFT_M: f64 = 0.012;

/// Largest free gap between two objects that are next to each other, m.
pub const NEXT_TO_GAP_M: f64 = 0.10;

/// Largest vertical gap between an object and its support, m.
const SUPPORT_GAP_M: f64 = 0.03;

/// An axis-aligned box in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Its centre, m.
    pub centre_m: [f64; 3],
    /// Its extents, m.
    pub size_m: [f64; 3],
}

impl Volume {
    fn top(&self) -> f64 {
        self.centre_m[2] + self.size_m[2] / 2.0
    }

    fn bottom(&self) -> f64 {
        self.centre_m[2] - self.size_m[2] / 2.0
    }

    /// Offset of the centres in the plane, from `other` to this one, m.
    fn offset_from(&self, other: &Self) -> [f64; 2] {
        [
            self.centre_m[0] - other.centre_m[0],
            self.centre_m[1] - other.centre_m[1],
        ]
    }

    /// Distance of this centre outside `other`'s footprint, negative inside, m.
    fn outside(&self, other: &Self) -> f64 {
        let [dx, dy] = self.offset_from(other);
        (dx.abs() - other.size_m[0] / 2.0).max(dy.abs() - other.size_m[1] / 2.0)
    }

    /// Free gap between the footprints, negative where they overlap, m.
    #[must_use]
    pub fn gap(&self, other: &Self) -> f64 {
        let [dx, dy] = self.offset_from(other);
        let gap_x = dx.abs() - (self.size_m[0] + other.size_m[0]) / 2.0;
        let gap_y = dy.abs() - (self.size_m[1] + other.size_m[1]) / 2.0;
        if gap_x > 0.0 && gap_y > 0.0 {
            gap_x.hypot(gap_y)
        } else {
            gap_x.max(gap_y)
        }
    }

    /// Distance of the centres in the plane, m.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f64 {
        let [dx, dy] = self.offset_from(other);
        dx.hypot(dy)
    }
}

/// 0 well below zero, 1 well above, 0.5 at zero.
pub(super) fn step(value: f64, softness: f64) -> f64 {
    1.0 / (1.0 + (-value / softness).exp())
}

/// How well `object` stands in `relation` to `references`. Relations that rank
/// candidates against each other (nearest, leftmost and so on) are scored
/// elsewhere and read 1 here.
#[must_use]
pub fn score(relation: Relation, object: &Volume, references: &[Volume], axes: &ViewAxes) -> f64 {
    match (relation, references) {
        (Relation::On, [support, ..]) => on(object, support),
        (Relation::In, [container, ..]) => inside(object, container),
        (Relation::Under, [cover, ..]) => under(object, cover),
        (Relation::NextTo, [other, ..]) => next_to(object, other),
        (Relation::Between, [one, other, ..]) => between(object, one, other),
        (Relation::AtCentre, [table, ..]) => at_centre(object, table),
        (
            Relation::LeftOf | Relation::RightOf | Relation::InFrontOf | Relation::Behind,
            [other, ..],
        ) => beside(relation, object, other, axes),
        (
            Relation::NearestTo
            | Relation::FarthestFrom
            | Relation::AtLeft
            | Relation::AtRight
            | Relation::AtFront
            | Relation::AtBack,
            _,
        ) => 1.0,
        (_, []) | (Relation::Between, _) => 0.0,
    }
}

/// The centre is over the support's footprint and the lower face at its top.
/// A shallow dish counts as a support: its inside lies below its rim.
fn on(object: &Volume, support: &Volume) -> f64 {
    let dish = support.size_m[2].min(0.06) * 0.8;
    let above = object.bottom() - support.top();
    let over = step(0.01 - object.outside(support), SOFT_M);
    over * step(SUPPORT_GAP_M - above, SOFT_M)
        * step(above + dish + 0.02, SOFT_M)
        * step(object.centre_m[2] - support.centre_m[2], SOFT_M / 2.0)
}

/// The centre is within the container's footprint and below its rim.
fn inside(object: &Volume, container: &Volume) -> f64 {
    let within = step(0.01 - object.outside(container), SOFT_M);
    let below_rim = step(container.top() + 0.03 - object.centre_m[2], SOFT_M);
    within * below_rim * step(object.centre_m[2] - container.bottom() + 0.01, SOFT_M)
}

fn under(object: &Volume, cover: &Volume) -> f64 {
    step(0.01 - object.outside(cover), SOFT_M) * step(cover.bottom() - object.top() + 0.02, SOFT_M)
}

/// A small free gap at about the same height, neither on nor under.
fn next_to(object: &Volume, other: &Volume) -> f64 {
    let near = step(NEXT_TO_GAP_M - object.gap(other), 2.0 * SOFT_M);
    near * apart(object, other) * level(object, other)
}

/// 1 unless one stands on or in the other.
fn apart(object: &Volume, other: &Volume) -> f64 {
    1.0 - step(-0.02 - object.outside(other), SOFT_M / 2.0)
}

/// 1 if the vertical extents overlap or nearly do.
fn level(object: &Volume, other: &Volume) -> f64 {
    let gap = (object.bottom() - other.top()).max(other.bottom() - object.top());
    step(0.01 - gap, SOFT_M / 2.0)
}

/// The centre projects between the references, near the line that joins them.
fn between(object: &Volume, one: &Volume, other: &Volume) -> f64 {
    let line = other.offset_from(one);
    let length_squared = line[0] * line[0] + line[1] * line[1];
    if length_squared < 1e-6 {
        return 0.0;
    }
    let length = length_squared.sqrt();
    let offset = object.offset_from(one);
    let along = (offset[0] * line[0] + offset[1] * line[1]) / length_squared;
    let across = (offset[0] * line[1] - offset[1] * line[0]).abs() / length;
    let soft = SOFT_M / length;
    let width = (0.35 * length).max(0.05);
    step(along - 0.1, soft)
        * step(0.9 - along, soft)
        * step(width - across, 1.5 * SOFT_M)
        * apart(object, one)
        * apart(object, other)
}

/// Within a third of the table's half extents of its middle.
fn at_centre(object: &Volume, table: &Volume) -> f64 {
    let [dx, dy] = object.offset_from(table);
    let radius = (table.size_m[0].min(table.size_m[1]) / 2.0 / 3.0).max(0.03);
    step(radius - dx.hypot(dy), 1.5 * SOFT_M)
}

/// Within 50 degrees of the direction; no farther than 0.45 m.
fn beside(relation: Relation, object: &Volume, other: &Volume, axes: &ViewAxes) -> f64 {
    let (left, away) = axes.components(object.offset_from(other));
    let (along, across) = match relation {
        Relation::LeftOf => (left, away),
        Relation::RightOf => (-left, away),
        Relation::Behind => (away, left),
        _ => (-away, left),
    };
    let cone = along * SIN_50 - across.abs() * COS_50;
    step(cone, SOFT_M) * step(0.45 - along, 0.03) * apart(object, other)
}

const SIN_50: f64 = 0.766_044_443_118_978;
const COS_50: f64 = 0.642_787_609_686_539;
