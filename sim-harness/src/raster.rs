//! A camera without a display or OpenGL: one ray a pixel, cast by MuJoCo.

use nalgebra::{Matrix3, Vector3};

use crate::sim::{Owner, RobotState, Sim};

/// Where the light comes from, base frame.
const LIGHT: [f64; 3] = [0.35, 0.45, 0.82];
/// Share of the light that reaches a surface that faces away.
const AMBIENT: f64 = 0.45;
/// Colour of what no ray hits.
const BACKGROUND: [u8; 3] = [226, 231, 236];
/// How far a ray goes, m.
const FAR_M: f64 = 20.0;

/// A pinhole camera in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it is, m.
    pub position_m: [f64; 3],
    /// What it looks at, m.
    pub look_at_m: [f64; 3],
    /// Vertical angle of view, rad.
    pub fov_y_rad: f64,
}

impl Camera {
    /// In front of the robot, looking back at it and at the table, like LIBERO's `agentview`.
    #[must_use]
    pub fn agent_view(surface_m: f64) -> Self {
        Self {
            position_m: [1.30, 0.0, 1.10 + surface_m],
            look_at_m: [0.42, 0.0, 0.12 + surface_m],
            fov_y_rad: 0.72,
        }
    }

    /// At the robot's wrist, looking along the fingers, like LIBERO's `eye_in_hand`.
    #[must_use]
    pub fn wrist(robot: &RobotState) -> Self {
        let hand = robot.tcp.isometry();
        let at = |x: f64, z: f64| (hand * nalgebra::Point3::new(x, 0.0, z)).into();
        Self {
            position_m: at(0.06, -0.12),
            look_at_m: at(0.02, 0.0),
            fov_y_rad: 1.3,
        }
    }

    /// Directions of the rays through the centres of `width` by `height` pixels, unit, row by row
    /// from the top left.
    #[must_use]
    pub fn rays(&self, width: usize, height: usize) -> Vec<[f64; 3]> {
        let axes = self.axes();
        let scale = 2.0 * libm::tan(0.5 * self.fov_y_rad) / height as f64;
        let (cx, cy) = (0.5 * width as f64, 0.5 * height as f64);
        let mut rays = Vec::with_capacity(width * height);
        for row in 0..height {
            for column in 0..width {
                let x = scale * (column as f64 + 0.5 - cx);
                let y = scale * (row as f64 + 0.5 - cy);
                rays.push((axes * Vector3::new(x, y, 1.0)).normalize().into());
            }
        }
        rays
    }

    /// Where a point appears: column and row in pixels of a picture of that size, and its depth
    /// along the axis of view in m. `None` behind the camera.
    #[must_use]
    pub fn project(&self, point_m: [f64; 3], width: usize, height: usize) -> Option<[f64; 3]> {
        let local =
            self.axes().transpose() * (Vector3::from(point_m) - Vector3::from(self.position_m));
        if local.z <= 1e-6 {
            return None;
        }
        let scale = height as f64 / (2.0 * libm::tan(0.5 * self.fov_y_rad));
        let x = 0.5 * width as f64 + scale * local.x / local.z;
        let y = 0.5 * height as f64 + scale * local.y / local.z;
        Some([x, y, local.z])
    }

    /// Columns: right, down, forward.
    fn axes(&self) -> Matrix3<f64> {
        let forward = (Vector3::from(self.look_at_m) - Vector3::from(self.position_m)).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        Matrix3::from_columns(&[right, forward.cross(&right), forward])
    }
}

/// A picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue, row by row from the top left.
    pub rgb: Vec<u8>,
}

/// What each pixel shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What the ray hit first, row by row from the top left.
    pub owner: Vec<Option<Owner>>,
    /// Distance along the ray, m; infinite where nothing was hit.
    pub range_m: Vec<f64>,
}

/// Takes a picture, with `samples` by `samples` rays a pixel.
#[must_use]
pub fn picture(
    sim: &mut Sim,
    camera: &Camera,
    width: usize,
    height: usize,
    samples: usize,
) -> Raster {
    let samples = samples.max(1);
    let rays = camera.rays(width * samples, height * samples);
    let mut normals = vec![[0.0; 3]; rays.len()];
    let (data, _) = sim.rays();
    let (geoms, _) = data.multi_ray(
        &camera.position_m,
        &rays,
        None,
        true,
        None,
        FAR_M,
        Some(&mut normals),
    );
    let colours = data.model().geom_rgba();
    let light = Vector3::from(LIGHT).normalize();
    let shade = |ray: usize| -> [f64; 3] {
        let Some(geom) = geoms[ray] else {
            return BACKGROUND.map(f64::from);
        };
        let mut normal = Vector3::from(normals[ray]);
        if normal.dot(&Vector3::from(rays[ray])) > 0.0 {
            normal = -normal;
        }
        let lit = AMBIENT + (1.0 - AMBIENT) * normal.dot(&light).max(0.0);
        std::array::from_fn(|i| 255.0 * lit * f64::from(colours[geom][i]))
    };
    let mut rgb = Vec::with_capacity(3 * width * height);
    let share = 1.0 / (samples * samples) as f64;
    for row in 0..height {
        for column in 0..width {
            let mut sum = [0.0; 3];
            for sub in 0..samples * samples {
                let y = row * samples + sub / samples;
                let x = column * samples + sub % samples;
                let colour = shade(y * width * samples + x);
                (0..3).for_each(|i| sum[i] += share * colour[i]);
            }
            // Saturating: a float outside the range of a byte becomes its nearest end.
            rgb.extend(sum.map(|c| c.round() as u8));
        }
    }
    Raster { width, height, rgb }
}

/// What a camera sees where, with one ray a pixel.
#[must_use]
pub fn mask(sim: &mut Sim, camera: &Camera, width: usize, height: usize) -> Mask {
    let rays = camera.rays(width, height);
    let (data, owners) = sim.rays();
    let (geoms, ranges) = data.multi_ray(&camera.position_m, &rays, None, true, None, FAR_M, None);
    let owner = geoms
        .iter()
        .map(|g| g.and_then(|g| owners.get(g).copied()))
        .collect();
    let range_m = ranges
        .iter()
        .map(|&r| if r < 0.0 { f64::INFINITY } else { r })
        .collect();
    Mask {
        width,
        height,
        owner,
        range_m,
    }
}

/// What a ray from `eye_m` towards each target meets first. The point of view may be anywhere; no
/// picture is taken.
pub(crate) fn first_hits(
    sim: &mut Sim,
    eye_m: [f64; 3],
    targets_m: &[[f64; 3]],
) -> Vec<Option<Owner>> {
    let rays: Vec<[f64; 3]> = targets_m
        .iter()
        .map(|t| std::array::from_fn(|i| t[i] - eye_m[i]))
        .collect();
    let (data, owners) = sim.rays();
    let (geoms, _) = data.multi_ray(&eye_m, &rays, None, true, None, FAR_M, None);
    geoms
        .iter()
        .map(|g| g.and_then(|g| owners.get(g).copied()))
        .collect()
}
