//! A scene: an arena, objects in it, and its form as MJCF.

use std::fmt::Write as _;
use std::sync::Arc;

use serde::Deserialize;

use crate::error::SimError;
use crate::object::{ObjectKind, Shape};
use crate::pose::Pose;

/// Most objects of a scene: the capacity of a state sample.
pub const MAX_OBJECTS: usize = 32;
/// Centre of the working surface, base frame, m.
pub const TABLE_CENTRE_M: [f64; 2] = [0.5, 0.0];
/// Half extent of the working surface, m.
pub const TABLE_HALF_M: [f64; 2] = [0.4, 0.55];
/// How far above its support an object is put down, m, so that nothing starts in contact.
const CLEARANCE_M: f64 = 0.001;

/// The surroundings of the task.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arena {
    /// Its name, for people.
    pub name: String,
    /// Height of the working surface above the robot's base, m.
    pub surface_m: f64,
    /// Colour of the working surface: red, green, blue, 0 to 1.
    pub surface_colour: [f32; 3],
    /// Colour of the floor: red, green, blue, 0 to 1.
    pub floor_colour: [f32; 3],
}

impl Default for Arena {
    fn default() -> Self {
        Self {
            name: "plain table".to_owned(),
            surface_m: 0.0,
            surface_colour: [0.62, 0.47, 0.33],
            floor_colour: [0.42, 0.43, 0.45],
        }
    }
}

/// An object of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedObject {
    /// Identity within the scene, from 1.
    pub id: u16,
    /// Name within the scene, as `black_bowl_2`: unique.
    pub name: String,
    /// What it is.
    pub kind: Arc<ObjectKind>,
    /// Where it starts: the centre of its bounding box.
    pub pose: Pose,
}

/// An arena and the objects in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The surroundings.
    pub arena: Arena,
    objects: Vec<PlacedObject>,
}

impl Scene {
    /// A scene without objects.
    #[must_use]
    pub fn new(arena: Arena) -> Self {
        Self {
            arena,
            objects: Vec::new(),
        }
    }

    /// Puts an object down on the working surface, upright, and returns its id.
    ///
    /// # Errors
    /// [`SimError::Invalid`] if the name is taken, a coordinate is not finite or the scene is full.
    pub fn put(
        &mut self,
        name: &str,
        kind: Arc<ObjectKind>,
        xy_m: [f64; 2],
        yaw_rad: f64,
    ) -> Result<u16, SimError> {
        let z = self.arena.surface_m + kind.half_extent_m()[2] + CLEARANCE_M;
        self.add(name, kind, Pose::upright([xy_m[0], xy_m[1], z], yaw_rad))
    }

    /// Puts an object at a height above the working surface, upright, and returns its id: for
    /// furniture that is bolted down there.
    ///
    /// # Errors
    /// As for [`Scene::put`].
    pub fn put_at_height(
        &mut self,
        name: &str,
        kind: Arc<ObjectKind>,
        xy_m: [f64; 2],
        height_m: f64,
        yaw_rad: f64,
    ) -> Result<u16, SimError> {
        let z = self.arena.surface_m + height_m + kind.half_extent_m()[2] + CLEARANCE_M;
        self.add(name, kind, Pose::upright([xy_m[0], xy_m[1], z], yaw_rad))
    }

    /// Puts an object down on or in another one, upright, and returns its id; `offset_m` is from
    /// the centre of the other one.
    ///
    /// # Errors
    /// As for [`Scene::put`], and [`SimError::Unknown`] if there is no such support.
    pub fn put_on(
        &mut self,
        name: &str,
        kind: Arc<ObjectKind>,
        support: &str,
        offset_m: [f64; 2],
        yaw_rad: f64,
    ) -> Result<u16, SimError> {
        let below = self.by_name(support)?;
        let [x, y, z] = below.pose.position_m;
        let z = z + below.kind.support_m() + kind.half_extent_m()[2] + CLEARANCE_M;
        self.add(
            name,
            kind,
            Pose::upright([x + offset_m[0], y + offset_m[1], z], yaw_rad),
        )
    }

    fn add(&mut self, name: &str, kind: Arc<ObjectKind>, pose: Pose) -> Result<u16, SimError> {
        if self.objects.len() >= MAX_OBJECTS {
            let problem = format!("more than {MAX_OBJECTS} objects");
            return Err(SimError::invalid("scene", problem));
        }
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.is_empty() || !name.chars().all(plain) {
            let problem = "a name consists of ASCII letters, digits and underscores";
            return Err(SimError::invalid(format!("object `{name}`"), problem));
        }
        if self.objects.iter().any(|o| o.name == name) {
            return Err(SimError::invalid(
                format!("object `{name}`"),
                "the name is taken",
            ));
        }
        if !pose
            .position_m
            .iter()
            .chain(&pose.orientation)
            .all(|v| v.is_finite())
        {
            return Err(SimError::invalid(
                format!("object `{name}`"),
                "its pose is not finite",
            ));
        }
        let id = u16::try_from(self.objects.len() + 1).unwrap_or(u16::MAX);
        self.objects.push(PlacedObject {
            id,
            name: name.to_owned(),
            kind,
            pose,
        });
        Ok(id)
    }

    /// The objects, by ascending id.
    #[must_use]
    pub fn objects(&self) -> &[PlacedObject] {
        &self.objects
    }

    /// An object by its name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn by_name(&self, name: &str) -> Result<&PlacedObject, SimError> {
        self.objects.iter().find(|o| o.name == name).ok_or_else(|| {
            SimError::unknown(
                "object of the scene",
                name,
                self.objects.iter().map(|o| &*o.name),
            )
        })
    }

    /// An object by its id.
    #[must_use]
    pub fn by_id(&self, id: u16) -> Option<&PlacedObject> {
        self.objects.get(usize::from(id).checked_sub(1)?)
    }

    /// Exchanges the places of two objects; each keeps standing on what is under its new place.
    ///
    /// # Errors
    /// [`SimError::Unknown`] if one of them does not exist.
    pub fn swap_places(&mut self, a: &str, b: &str) -> Result<(), SimError> {
        let (ia, ib) = (self.by_name(a)?.id, self.by_name(b)?.id);
        let (ia, ib) = (usize::from(ia) - 1, usize::from(ib) - 1);
        let bottom = |o: &PlacedObject| o.pose.position_m[2] - o.kind.half_extent_m()[2];
        let (a_place, b_place) = (
            self.objects[ia].pose.position_m,
            self.objects[ib].pose.position_m,
        );
        let (a_bottom, b_bottom) = (bottom(&self.objects[ia]), bottom(&self.objects[ib]));
        let mut move_to = |i: usize, place: [f64; 3], bottom: f64| {
            let object = &mut self.objects[i];
            let z = bottom + object.kind.half_extent_m()[2];
            object.pose.position_m = [place[0], place[1], z];
        };
        move_to(ia, b_place, b_bottom);
        move_to(ib, a_place, a_bottom);
        Ok(())
    }

    /// Puts an object that is already in the scene on top of another one, centred.
    ///
    /// # Errors
    /// [`SimError::Unknown`] if one of them does not exist.
    pub fn move_onto(&mut self, name: &str, support: &str) -> Result<(), SimError> {
        let below = self.by_name(support)?;
        let [x, y, z] = below.pose.position_m;
        let top = z + below.kind.support_m();
        let index = usize::from(self.by_name(name)?.id) - 1;
        let object = &mut self.objects[index];
        let z = top + object.kind.half_extent_m()[2] + CLEARANCE_M;
        object.pose.position_m = [x, y, z];
        Ok(())
    }

    /// Puts an object that is already in the scene somewhere else on the working surface.
    ///
    /// # Errors
    /// [`SimError::Unknown`] if it does not exist.
    pub fn place_at(&mut self, name: &str, xy_m: [f64; 2]) -> Result<(), SimError> {
        let index = usize::from(self.by_name(name)?.id) - 1;
        let surface_m = self.arena.surface_m;
        let object = &mut self.objects[index];
        let z = surface_m + object.kind.half_extent_m()[2] + CLEARANCE_M;
        object.pose.position_m = [xy_m[0], xy_m[1], z];
        Ok(())
    }

    /// The scene as MJCF; it includes the robot as `panda.xml`.
    pub(crate) fn to_mjcf(&self) -> String {
        let Arena {
            surface_m,
            surface_colour: [r, g, b],
            floor_colour: [fr, fg, fb],
            ..
        } = &self.arena;
        let ([tx, ty], [hx, hy]) = (TABLE_CENTRE_M, TABLE_HALF_M);
        let floor_m = surface_m - 0.4;
        let top_m = surface_m - 0.02;
        let mut bodies = String::new();
        for object in &self.objects {
            let Pose {
                position_m: [x, y, z],
                orientation: [qw, qx, qy, qz],
            } = object.pose;
            let name = &object.name;
            // MuJoCo does not collide sleeping things with each other. What stands on a plate is
            // judged by contact, so a plate stays awake and keeps awake what touches it.
            let freedom = match object.kind.shape {
                _ if object.kind.fixed => r#">"#,
                Shape::Plate { .. } => r#" sleep="never"><freejoint/>"#,
                _ => r#"><freejoint/>"#,
            };
            let opened = writeln!(
                bodies,
                r#"<body name="{name}" pos="{x} {y} {z}" quat="{qw} {qx} {qy} {qz}"{freedom}"#
            );
            debug_assert!(opened.is_ok(), "writing to a string cannot fail");
            object.kind.write_geoms(&mut bodies);
            bodies.push_str("</body>\n");
        }
        format!(
            r#"<mujoco model="scene">
<include file="panda.xml"/>
<option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="20">
<flag autoreset="disable" sleep="enable"/></option>
<default>
<default class="object"><geom contype="2" conaffinity="3" condim="4" friction="1 0.01 0.0002" solref="0.004 1"/></default>
<default class="world"><geom contype="2" conaffinity="3" condim="3" priority="1" friction="1 0.005 0.0001" solref="0.004 1"/></default>
<default class="visual"><geom contype="0" conaffinity="0" group="1"/></default>
</default>
<worldbody>
<geom class="visual" name="floor" type="plane" size="4 4 0.1" pos="0 0 {floor_m}" rgba="{fr} {fg} {fb} 1"/>
<geom class="world" name="surface" type="plane" size="{hx} {hy} 0.1" pos="{tx} {ty} {surface_m}" rgba="{r} {g} {b} 1"/>
<geom class="visual" name="table" type="box" size="{hx} {hy} 0.0195" pos="{tx} {ty} {top_m}" rgba="{r} {g} {b} 1"/>
{bodies}</worldbody>
</mujoco>
"#
        )
    }
}
