//! Where the object goes: a direct anchor, or a relation left to the policy.

use kinematics::rotation::UnitQuaternion;
use serde::Serialize;

use crate::planner::{Relation, SpatialPhrase};

use super::pool::{Pool, Thing};
use super::rank::rank;
use super::relation::Volume;
use super::viewpoint::ViewAxes;

/// A destination in the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Destination {
    /// The subtask names none.
    #[default]
    None,
    /// On or in one object that was found: geometric placement may be used.
    Direct(Anchor),
    /// Any other relation, or an anchor that wasn't found or isn't unique:
    /// placement stays with the base policy.
    Relational {
        /// Why.
        reason: String,
    },
}

/// An object or fixture to place on or in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Anchor {
    /// Its number in the pose source; 0 if unknown.
    pub id: u16,
    /// Its label, with the part's name if one is meant.
    pub label: String,
    /// On or in.
    pub relation: Relation,
    /// Its centre in the base frame, m.
    pub position_m: [f64; 3],
    /// Centre of the destination region in the anchor's frame, m: on a
    /// surface, z is the surface; in a container, z is the rim.
    pub region_offset_m: [f64; 3],
    /// Half extent of the region in x and y of the anchor, and the depth of a
    /// container (0 on a surface), m. Detections tell extents along the base
    /// axes: here they are those of the nearest quarter turn.
    pub region_half_extent_m: [f64; 3],
    /// True if the anchor is a fixture.
    pub fixture: bool,
}

/// An anchor whose weight is less than this many times the next one's isn't
/// unique.
const UNIQUE_RATIO: f64 = 2.0;

/// Finds the anchor of `phrase`; `target` is the object that will be moved.
pub(super) fn find(
    pool: &Pool<'_>,
    phrase: Option<&SpatialPhrase>,
    target: Option<usize>,
    axes: &ViewAxes,
) -> Destination {
    let Some(phrase) = phrase else {
        return Destination::None;
    };
    let relational = |reason: String| Destination::Relational { reason };
    let (Relation::On | Relation::In, [name]) = (phrase.relation, phrase.references.as_slice())
    else {
        return relational(format!(
            "\"{}\" isn't a direct anchor",
            phrase.relation.words()
        ));
    };
    let mut matches = pool.named(name);
    matches.retain(|matched| Some(matched.thing) != target.map(Thing::Object));
    let mut ranked = rank(pool, name, matches, phrase.qualifier.as_deref(), axes);
    ranked.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    match ranked.as_slice() {
        [] => relational(format!("no \"{name}\" in the scene")),
        [best, second, ..] if best.weight < UNIQUE_RATIO * second.weight => {
            relational(format!("several \"{name}\" in the scene"))
        }
        [best, ..] if best.weight < 0.2 => relational(format!("no certain \"{name}\"")),
        [best, ..] => match anchor(
            pool,
            best.matched.thing,
            &best.matched.volume,
            phrase.relation,
        ) {
            Some(anchor) => Destination::Direct(anchor),
            None => relational("the table has no bounded region".to_owned()),
        },
    }
}

fn anchor(pool: &Pool<'_>, thing: Thing, volume: &Volume, relation: Relation) -> Option<Anchor> {
    let (detection, label, fixture) = match thing {
        Thing::Object(index) => {
            let object = pool.scene.objects.get(index)?;
            (object, object.label.clone(), false)
        }
        Thing::Fixture(index) => {
            let fixture = pool.scene.fixtures.get(index)?;
            (fixture, fixture.label.clone(), true)
        }
        Thing::Part(index, at) => {
            let fixture = pool.scene.fixtures.get(index)?;
            let part = fixture.parts.get(at)?;
            (fixture, format!("{} of {}", part.name, fixture.label), true)
        }
        Thing::Table => return None,
    };
    let [size_x, size_y, size_z] = volume.size_m;
    let frame = detection.orientation.and_then(UnitQuaternion::from_wxyz);
    let frame = frame.unwrap_or(UnitQuaternion::IDENTITY);
    let [along_x, along_y] = if crossed(frame) {
        [size_y, size_x]
    } else {
        [size_x, size_y]
    };
    let top = volume.centre_m[2] + size_z / 2.0;
    Some(Anchor {
        id: detection.id,
        label,
        relation,
        position_m: detection.position_m,
        region_offset_m: frame.inverse().rotate([
            volume.centre_m[0] - detection.position_m[0],
            volume.centre_m[1] - detection.position_m[1],
            top - detection.position_m[2],
        ]),
        region_half_extent_m: [
            along_x / 2.0,
            along_y / 2.0,
            if relation == Relation::In {
                size_z
            } else {
                0.0
            },
        ],
        fixture,
    })
}

/// True if its x axis lies nearer to the base's y axis than to the base's x axis.
fn crossed(frame: UnitQuaternion) -> bool {
    let [x, y, _] = frame.rotate([1.0, 0.0, 0.0]);
    y.abs() > x.abs()
}
