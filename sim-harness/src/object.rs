//! The library of parametric objects: shapes with sizes, read from data and compiled to MJCF.
//!
//! Every object's body frame is the centre of its bounding box, x and y along its sides, z up when
//! it stands as it is meant to stand.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::error::SimError;

/// The embedded library.
const LIBRARY: &str = include_str!("../assets/objects.toml");

/// How a thing is grasped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectClass {
    /// A box that fits between the fingers along its narrow side.
    Box,
    /// A short upright cylinder.
    Can,
    /// A tall object that is easily knocked over.
    Bottle,
    /// An open vessel, grasped by its rim.
    Bowl,
    /// Not picked up: plates, baskets, furniture.
    Fixture,
}

/// A parametric shape. All sizes are outer sizes in metres.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "form", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A solid box.
    Box {
        /// Length along x, y, z, m.
        size_m: [f64; 3],
    },
    /// A solid upright cylinder.
    Cylinder {
        /// Radius, m.
        radius_m: f64,
        /// Height, m.
        height_m: f64,
    },
    /// A box with a round neck on top.
    Bottle {
        /// Length of the body along x, y, z, m.
        body_m: [f64; 3],
        /// Radius of the neck, m.
        neck_radius_m: f64,
        /// Height of the neck above the body, m.
        neck_height_m: f64,
    },
    /// A vessel whose wall widens from the foot to the rim.
    Bowl {
        /// Outer radius at the rim, m.
        rim_radius_m: f64,
        /// Outer radius of the foot, m.
        foot_radius_m: f64,
        /// Height, m.
        height_m: f64,
        /// Thickness of the wall and the floor, m.
        wall_m: f64,
    },
    /// A flat disc with a raised edge.
    Plate {
        /// Outer radius, m.
        radius_m: f64,
        /// Height of the edge, m; the floor is a third of it thick.
        height_m: f64,
    },
    /// An open box.
    Basket {
        /// Outer length along x, y, z, m.
        size_m: [f64; 3],
        /// Thickness of the walls and the floor, m.
        wall_m: f64,
    },
}

/// One kind of object, as the library describes it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectKind {
    /// What people call it, in lower case.
    pub label: String,
    /// How it is grasped.
    pub class: ObjectClass,
    /// Form and size.
    pub shape: Shape,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Whether it is bolted down: furniture.
    #[serde(default)]
    pub fixed: bool,
    /// Label of the piece of furniture that it is a part of.
    #[serde(default)]
    pub part_of: Option<String>,
    /// Red, green, blue, 0 to 1.
    pub colour: [f32; 3],
}

/// Kinds of objects by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Library(BTreeMap<String, ObjectKind>);

impl Library {
    /// The embedded library.
    ///
    /// # Errors
    /// Only if the embedded file is broken, which a test rules out.
    pub fn embedded() -> Result<Self, SimError> {
        Self::parse("objects.toml", LIBRARY)
    }

    /// Reads a library. `file` is the name that errors give.
    ///
    /// # Errors
    /// [`SimError::Data`] for text of the wrong form, [`SimError::Invalid`] for a wrong value.
    pub fn parse(file: &str, text: &str) -> Result<Self, SimError> {
        let kinds: BTreeMap<String, ObjectKind> =
            toml::from_str(text).map_err(|e| SimError::Data {
                file: file.to_owned(),
                message: e.to_string(),
            })?;
        for (name, kind) in &kinds {
            kind.validate(name)?;
        }
        Ok(Self(kinds))
    }

    /// A kind by its name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn get(&self, name: &str) -> Result<&ObjectKind, SimError> {
        self.0
            .get(name)
            .ok_or_else(|| SimError::unknown("object", name, self.names()))
    }

    /// The names of all kinds, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}

impl ObjectKind {
    /// Half the bounding box along the object's own axes, m.
    #[must_use]
    pub fn half_extent_m(&self) -> [f64; 3] {
        match self.shape {
            Shape::Box { size_m } | Shape::Basket { size_m, .. } => size_m.map(|s| 0.5 * s),
            Shape::Cylinder { radius_m, height_m } | Shape::Plate { radius_m, height_m } => {
                [radius_m, radius_m, 0.5 * height_m]
            }
            Shape::Bottle {
                body_m: [x, y, z],
                neck_height_m,
                ..
            } => [0.5 * x, 0.5 * y, 0.5 * (z + neck_height_m)],
            Shape::Bowl {
                rim_radius_m,
                height_m,
                ..
            } => [rim_radius_m, rim_radius_m, 0.5 * height_m],
        }
    }

    /// The region in which another object can be put, if there is one: centre and half extent in
    /// the object's own frame, m. For a container it is the space inside, for a plate the disc's
    /// surface with no depth.
    #[must_use]
    pub fn region_m(&self) -> Option<([f64; 3], [f64; 3])> {
        match self.shape {
            Shape::Basket {
                size_m: [x, y, z],
                wall_m,
            } => Some((
                [0.0, 0.0, 0.5 * wall_m],
                [0.5 * x - wall_m, 0.5 * y - wall_m, 0.5 * (z - wall_m)],
            )),
            Shape::Plate { radius_m, height_m } => Some((
                [0.0, 0.0, height_m / 3.0 - 0.5 * height_m],
                [radius_m, radius_m, 0.0],
            )),
            Shape::Bowl {
                rim_radius_m,
                foot_radius_m,
                height_m,
                wall_m,
            } => {
                let half = 0.5 * (rim_radius_m + foot_radius_m) - wall_m;
                Some((
                    [0.0, 0.0, 0.5 * wall_m],
                    [half, half, 0.5 * (height_m - wall_m)],
                ))
            }
            Shape::Box { size_m: [x, y, z] } => {
                Some(([0.0, 0.0, 0.5 * z], [0.5 * x, 0.5 * y, 0.0]))
            }
            Shape::Cylinder { .. } | Shape::Bottle { .. } => None,
        }
    }

    /// Height above the object's own centre at which another one stands on it or in it, m: the
    /// floor of a basket or a plate, otherwise the top. What nests in a bowl settles from there.
    #[must_use]
    pub fn support_m(&self) -> f64 {
        let [_, _, half] = self.half_extent_m();
        match self.shape {
            Shape::Basket { wall_m, .. } => wall_m - half,
            Shape::Plate { height_m, .. } => height_m / 3.0 - half,
            _ => half,
        }
    }

    /// The same object, larger or smaller in all directions; the mass follows the volume.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let s3 = |v: [f64; 3]| v.map(|x| factor * x);
        let shape = match self.shape {
            Shape::Box { size_m } => Shape::Box { size_m: s3(size_m) },
            Shape::Cylinder { radius_m, height_m } => Shape::Cylinder {
                radius_m: factor * radius_m,
                height_m: factor * height_m,
            },
            Shape::Bottle {
                body_m,
                neck_radius_m,
                neck_height_m,
            } => Shape::Bottle {
                body_m: s3(body_m),
                neck_radius_m: factor * neck_radius_m,
                neck_height_m: factor * neck_height_m,
            },
            Shape::Bowl {
                rim_radius_m,
                foot_radius_m,
                height_m,
                wall_m,
            } => Shape::Bowl {
                rim_radius_m: factor * rim_radius_m,
                foot_radius_m: factor * foot_radius_m,
                height_m: factor * height_m,
                wall_m: factor * wall_m,
            },
            Shape::Plate { radius_m, height_m } => Shape::Plate {
                radius_m: factor * radius_m,
                height_m: factor * height_m,
            },
            Shape::Basket { size_m, wall_m } => Shape::Basket {
                size_m: s3(size_m),
                wall_m: factor * wall_m,
            },
        };
        Self {
            shape,
            mass_kg: self.mass_kg * factor * factor * factor,
            ..self.clone()
        }
    }

    fn validate(&self, name: &str) -> Result<(), SimError> {
        let positive = |what: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                let problem = format!("{what} is {value}; it must be positive");
                Err(SimError::invalid(format!("object `{name}`"), problem))
            }
        };
        positive("mass_kg", self.mass_kg)?;
        if let Some(c) = self.colour.iter().find(|c| !(0.0..=1.0).contains(*c)) {
            let problem = format!("colour has {c}; each part must lie in 0 to 1");
            return Err(SimError::invalid(format!("object `{name}`"), problem));
        }
        for half in self.half_extent_m() {
            positive("a size", half)?;
        }
        match self.shape {
            Shape::Bowl {
                wall_m,
                foot_radius_m,
                height_m,
                ..
            } => {
                positive("wall_m", wall_m)?;
                positive("foot_radius_m minus wall_m", foot_radius_m - wall_m)?;
                positive("height_m minus wall_m", height_m - wall_m)
            }
            Shape::Basket {
                size_m: [x, y, z],
                wall_m,
            } => {
                positive("wall_m", wall_m)?;
                positive("the space inside", x.min(y) - 2.0 * wall_m)?;
                positive("the depth inside", z - wall_m)
            }
            Shape::Bottle {
                neck_radius_m,
                neck_height_m,
                ..
            } => {
                positive("neck_radius_m", neck_radius_m)?;
                positive("neck_height_m", neck_height_m)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_library_is_sound() {
        let library = Library::embedded().unwrap();
        assert!(library.names().count() >= 15);
        let bowl = library.get("black_bowl").unwrap();
        assert_eq!(bowl.half_extent_m(), [0.0535, 0.0535, 0.025]);
        assert_eq!(bowl.class, ObjectClass::Bowl);
    }

    #[test]
    fn errors_name_the_object_and_the_value() {
        let unknown = Library::embedded()
            .unwrap()
            .get("teapot")
            .unwrap_err()
            .to_string();
        assert!(
            unknown.contains("`teapot`") && unknown.contains("black_bowl"),
            "{unknown}"
        );
        let flat = r#"[slab]
            label = "slab"
            class = "box"
            shape = { form = "box", size_m = [0.1, 0.1, 0.0] }
            mass_kg = 0.1
            colour = [1.0, 0.0, 0.0]"#;
        let message = Library::parse("x.toml", flat).unwrap_err().to_string();
        assert!(
            message.contains("`slab`") && message.contains("must be positive"),
            "{message}"
        );
        let typo = flat.replace("mass_kg", "mass");
        let message = Library::parse("x.toml", &typo).unwrap_err().to_string();
        assert!(
            message.contains("x.toml") && message.contains("mass"),
            "{message}"
        );
    }

    #[test]
    fn scaling_keeps_proportion_and_density() {
        let library = Library::embedded().unwrap();
        for name in library.names() {
            let (kind, large) = (
                library.get(name).unwrap(),
                library.get(name).unwrap().scaled(1.5),
            );
            for (a, b) in kind.half_extent_m().iter().zip(large.half_extent_m()) {
                assert!((1.5 * a - b).abs() < 1e-12, "{name}");
            }
            assert!(
                (large.mass_kg / kind.mass_kg - 3.375).abs() < 1e-12,
                "{name}"
            );
        }
    }
}
