//! The shapes of the library as MuJoCo geoms.

use std::fmt::Write as _;

use crate::object::{ObjectKind, Shape};

/// Boxes that make up a round wall.
const WALL_SEGMENTS: usize = 16;

impl ObjectKind {
    /// Writes the geoms of the object's body, in the body's frame.
    pub(crate) fn write_geoms(&self, out: &mut String) {
        let mut geoms = GeomWriter {
            out,
            colour: self.colour,
        };
        match self.shape {
            Shape::Box { size_m } => geoms.cuboid(size_m, [0.0; 3], self.mass_kg),
            Shape::Cylinder { radius_m, height_m } => {
                geoms.cylinder(radius_m, height_m, 0.0, self.mass_kg);
            }
            Shape::Bottle {
                body_m,
                neck_radius_m,
                neck_height_m,
            } => {
                let low = -0.5 * neck_height_m;
                geoms.cuboid(body_m, [0.0, 0.0, low], 0.9 * self.mass_kg);
                geoms.cylinder(
                    neck_radius_m,
                    neck_height_m,
                    0.5 * body_m[2],
                    0.1 * self.mass_kg,
                );
            }
            Shape::Bowl {
                rim_radius_m,
                foot_radius_m,
                height_m,
                wall_m,
            } => {
                let floor = -0.5 * (height_m - wall_m);
                geoms.cylinder(foot_radius_m, wall_m, floor, 0.4 * self.mass_kg);
                let wall = RoundWall {
                    low_radius_m: foot_radius_m - 0.5 * wall_m,
                    high_radius_m: rim_radius_m - 0.5 * wall_m,
                    low_z_m: -0.5 * height_m + 0.5 * wall_m,
                    high_z_m: 0.5 * height_m,
                    thickness_m: wall_m,
                };
                geoms.round_wall(&wall, 0.6 * self.mass_kg);
            }
            Shape::Plate { radius_m, height_m } => {
                let floor = height_m / 3.0;
                let foot = 0.75 * radius_m;
                geoms.cylinder(foot, floor, 0.5 * (floor - height_m), 0.7 * self.mass_kg);
                let wall = RoundWall {
                    low_radius_m: foot - 0.5 * floor,
                    high_radius_m: radius_m - 0.5 * floor,
                    low_z_m: 0.5 * (floor - height_m),
                    high_z_m: 0.5 * (height_m - floor),
                    thickness_m: floor,
                };
                geoms.round_wall(&wall, 0.3 * self.mass_kg);
            }
            Shape::Basket { size_m, wall_m } => geoms.open_box(size_m, wall_m, self.mass_kg),
        }
    }
}

/// A wall of boxes around the vertical axis.
struct RoundWall {
    low_radius_m: f64,
    high_radius_m: f64,
    low_z_m: f64,
    high_z_m: f64,
    thickness_m: f64,
}

struct GeomWriter<'a> {
    out: &'a mut String,
    colour: [f32; 3],
}

impl GeomWriter<'_> {
    fn geom(&mut self, attributes: std::fmt::Arguments<'_>, mass_kg: f64) {
        let [r, g, b] = self.colour;
        let written = writeln!(
            self.out,
            r#"<geom class="object" {attributes} mass="{mass_kg}" rgba="{r} {g} {b} 1"/>"#
        );
        debug_assert!(written.is_ok(), "writing to a string cannot fail");
    }

    fn cuboid(&mut self, [x, y, z]: [f64; 3], [px, py, pz]: [f64; 3], mass_kg: f64) {
        let (hx, hy, hz) = (0.5 * x, 0.5 * y, 0.5 * z);
        let attributes = format_args!(r#"type="box" size="{hx} {hy} {hz}" pos="{px} {py} {pz}""#);
        self.geom(attributes, mass_kg);
    }

    fn cylinder(&mut self, radius_m: f64, height_m: f64, z_m: f64, mass_kg: f64) {
        let half = 0.5 * height_m;
        let attributes =
            format_args!(r#"type="cylinder" size="{radius_m} {half}" pos="0 0 {z_m}""#);
        self.geom(attributes, mass_kg);
    }

    fn round_wall(&mut self, wall: &RoundWall, mass_kg: f64) {
        let rise = wall.high_z_m - wall.low_z_m;
        let flare = wall.high_radius_m - wall.low_radius_m;
        let tilt = libm::atan2(flare, rise);
        let half_length = 0.5 * libm::hypot(rise, flare);
        let radius = 0.5 * (wall.low_radius_m + wall.high_radius_m);
        let z = 0.5 * (wall.low_z_m + wall.high_z_m);
        let step = core::f64::consts::TAU / WALL_SEGMENTS as f64;
        let half_width = wall.high_radius_m * libm::tan(0.5 * step);
        let half_thickness = 0.5 * wall.thickness_m;
        for i in 0..WALL_SEGMENTS {
            let angle = step * i as f64;
            let (sin, cos) = libm::sincos(angle);
            let (x, y) = (radius * cos, radius * sin);
            // Tilted outwards about y, then turned about z.
            let (sz, cz) = libm::sincos(0.5 * angle);
            let (sy, cy) = libm::sincos(0.5 * tilt);
            let (qw, qx, qy, qz) = (cz * cy, -sz * sy, cz * sy, sz * cy);
            let attributes = format_args!(
                r#"type="box" size="{half_thickness} {half_width} {half_length}" pos="{x} {y} {z}" quat="{qw} {qx} {qy} {qz}""#
            );
            self.geom(attributes, mass_kg / WALL_SEGMENTS as f64);
        }
    }

    fn open_box(&mut self, [x, y, z]: [f64; 3], wall_m: f64, mass_kg: f64) {
        let sides = 2.0 * (x + y) * z;
        let floor_share = x * y / (x * y + sides);
        let side_share = 0.25 * (1.0 - floor_share);
        self.cuboid(
            [x, y, wall_m],
            [0.0, 0.0, 0.5 * (wall_m - z)],
            floor_share * mass_kg,
        );
        for sign in [-1.0, 1.0] {
            let px = sign * 0.5 * (x - wall_m);
            let py = sign * 0.5 * (y - wall_m);
            self.cuboid([wall_m, y, z], [px, 0.0, 0.0], side_share * mass_kg);
            self.cuboid(
                [x - 2.0 * wall_m, wall_m, z],
                [0.0, py, 0.0],
                side_share * mass_kg,
            );
        }
    }
}
