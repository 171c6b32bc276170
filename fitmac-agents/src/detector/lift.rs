//! From a box in the image to a box in the base frame.

use crate::scene::{Camera, Detection};

use super::{ImageBox, View};

/// Places a box by its depth, or, without depth, by where its lower edge meets
/// the table.
///
/// The object is taken to be as deep as it is wide: its centre lies half a
/// width behind the surface that is seen.
#[must_use]
pub fn lift(view: &View<'_>, camera: &Camera, found: &ImageBox) -> Option<Detection> {
    let [x, y, width_px, height_px] = found.box_px;
    let centre_px = [x + width_px / 2.0, y + height_px / 2.0];
    let measured = median_depth(view, camera, &found.box_px);
    let depth_m = measured.or_else(|| table_depth(view, camera, [centre_px[0], y + height_px]))?;
    let width_m = width_px * depth_m / camera.focal_px[0];
    let surface = camera.unproject(centre_px, depth_m);
    let mut centre = if measured.is_some() {
        // Half a width along the viewing ray, in the plane.
        let ray = [
            surface[0] - camera.position_m[0],
            surface[1] - camera.position_m[1],
        ];
        let length = ray[0].hypot(ray[1]).max(1e-6);
        let back = width_m / 2.0 / length;
        [
            surface[0] + back * ray[0],
            surface[1] + back * ray[1],
            surface[2],
        ]
    } else {
        surface
    };
    let upper = camera.unproject([centre_px[0], y], depth_m)[2];
    let lower = camera.unproject([centre_px[0], y + height_px], depth_m)[2];
    let mut height_m = (upper - lower).abs().max(0.005);
    if let Some(table) = view.table {
        // Nothing reaches below the table.
        let top = table.centre_m[2];
        let bottom = (centre[2] - height_m / 2.0).max(top);
        let high = (centre[2] + height_m / 2.0).max(bottom + 0.005);
        (centre[2], height_m) = ((bottom + high) / 2.0, high - bottom);
    }
    let detection = Detection {
        id: 0,
        label: found.label.clone(),
        confidence: found.confidence.clamp(0.0, 1.0),
        position_m: centre,
        size_m: [width_m, width_m, height_m],
        orientation: None,
        box_px: Some(found.box_px),
        colour: None,
        parts: Vec::new(),
    };
    detection.is_sound().then_some(detection)
}

/// Median of the known depths in the middle half of the box.
fn median_depth(view: &View<'_>, camera: &Camera, box_px: &[f64; 4]) -> Option<f64> {
    let depth_m = view.depth_m?;
    let [width, height] = camera.image_size_px.map(|size| size as usize);
    if depth_m.len() != width * height {
        return None;
    }
    let [x, y, w, h] = *box_px;
    let span = |from: f64, size: f64, limit: usize| {
        let low = (from + 0.25 * size).clamp(0.0, limit as f64) as usize;
        let high = (from + 0.75 * size).ceil().clamp(0.0, limit as f64) as usize;
        low..high
    };
    let mut depths: Vec<f32> = Vec::new();
    for row in span(y, h, height) {
        let columns = span(x, w, width);
        let line = depth_m.get(row * width + columns.start..row * width + columns.end)?;
        depths.extend(
            line.iter()
                .filter(|depth| depth.is_finite() && **depth > 0.0),
        );
    }
    depths.sort_by(f32::total_cmp);
    depths.get(depths.len() / 2).map(|depth| f64::from(*depth))
}

/// Depth at which the ray through a pixel meets the table's plane.
fn table_depth(view: &View<'_>, camera: &Camera, pixel_px: [f64; 2]) -> Option<f64> {
    let top = view.table?.centre_m[2];
    let one = camera.unproject(pixel_px, 1.0);
    let fall = one[2] - camera.position_m[2];
    let depth = (top - camera.position_m[2]) / fall;
    (fall.abs() > 1e-6 && depth > 0.0).then_some(depth)
}
