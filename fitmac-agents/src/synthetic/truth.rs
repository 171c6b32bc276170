//! What the words mean, in crisp geometry with margins.

use crate::planner::Relation;

/// Which object an instruction means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// Exactly one object fits, with a margin.
    One(usize),
    /// Several fit; this one, drawn by lot, is meant.
    OneOfSeveral(usize),
    /// None fits.
    None,
}

/// Whether a relation plainly holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    Yes,
    No,
    /// Within the margin: nobody could say.
    Borderline,
}

fn within(value: f64, yes_below: f64, no_above: f64) -> Holds {
    if value < yes_below {
        Holds::Yes
    } else if value > no_above {
        Holds::No
    } else {
        Holds::Borderline
    }
}

fn both(one: Holds, other: Holds) -> Holds {
    match (one, other) {
        (Holds::No, _) | (_, Holds::No) => Holds::No,
        (Holds::Yes, Holds::Yes) => Holds::Yes,
        _ => Holds::Borderline,
    }
}

/// A position in the plane with the radius of the footprint, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub(super) at: [f64; 2],
    /// Half of the footprint's sides.
    pub(super) half: [f64; 2],
}

impl Disc {
    fn to(&self, other: &Self) -> [f64; 2] {
        [other.at[0] - self.at[0], other.at[1] - self.at[1]]
    }

    /// Free space between two footprints, m.
    pub(super) fn free(&self, other: &Self) -> f64 {
        let [x, y] = self.to(other);
        let x = (x.abs() - self.half[0] - other.half[0]).max(0.0);
        let y = (y.abs() - self.half[1] - other.half[1]).max(0.0);
        x.hypot(y)
    }
}

/// Relations among things that all stand on the table. `left` and `away` are
/// the viewer's directions.
pub(super) fn holds(
    relation: Relation,
    object: &Disc,
    references: &[Disc],
    left: [f64; 2],
    away: [f64; 2],
) -> Holds {
    match (relation, references) {
        (Relation::NextTo, [other, ..]) => within(object.free(other), 0.06, 0.15),
        (Relation::Between, [one, two, ..]) => between(object, one, two),
        (Relation::AtCentre, [table, ..]) => {
            let [x, y] = table.to(object);
            within(x.hypot(y), 0.08, 0.19)
        }
        (Relation::LeftOf, [other, ..]) => beside(object, other, left),
        (Relation::RightOf, [other, ..]) => beside(object, other, [-left[0], -left[1]]),
        (Relation::Behind, [other, ..]) => beside(object, other, away),
        (Relation::InFrontOf, [other, ..]) => beside(object, other, [-away[0], -away[1]]),
        _ => Holds::No,
    }
}

fn between(object: &Disc, one: &Disc, two: &Disc) -> Holds {
    let [line_x, line_y] = one.to(two);
    let length = line_x.hypot(line_y);
    let [x, y] = one.to(object);
    let along = (x * line_x + y * line_y) / length;
    let across = (x * line_y - y * line_x).abs() / length;
    let middle = (along - length / 2.0).abs();
    both(
        within(middle, 0.3 * length, 0.5 * length),
        within(
            across,
            0.04_f64.max(0.2 * length),
            0.10_f64.max(0.5 * length),
        ),
    )
}

/// Within 30 degrees of the direction yes, beyond 70 degrees no.
fn beside(object: &Disc, other: &Disc, direction: [f64; 2]) -> Holds {
    let [x, y] = other.to(object);
    let along = x * direction[0] + y * direction[1];
    let angle = (x * direction[1] - y * direction[0])
        .abs()
        .atan2(along)
        .to_degrees();
    both(within(angle, 30.0, 70.0), within(x.hypot(y), 0.35, 0.6))
}
