//! Detectors: from a view to a scene.
//!
//! A detector may look at an image, ask a server, or cast rays into a
//! simulated world; the grounder sees a [`Scene`] and doesn't care.

mod lift;
mod remote;

#[cfg(feature = "onnx")]
pub mod dino;
pub mod wordpiece;

#[cfg(test)]
mod tests;

use crate::canvas::Canvas;
use crate::scene::{Camera, Detection, Scene, Table};

pub use lift::lift;
pub use remote::{RemoteConfig, RemoteDetector};

/// What there is to look at.
#[derive(Clone, Copy, Debug, Default)]
pub struct View<'a> {
    /// When it was seen, ns of a monotonic clock.
    pub stamp_ns: u64,
    /// The image.
    pub image: Option<&'a Canvas>,
    /// Depth along the optical axis for each pixel of the image, row by row,
    /// m; 0 or not finite where it is unknown.
    pub depth_m: Option<&'a [f32]>,
    /// The camera.
    pub camera: Option<&'a Camera>,
    /// The table, where it is known.
    pub table: Option<Table>,
    /// Things that are known to stay.
    pub fixtures: &'a [Detection],
}

/// A box in the image with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageBox {
    /// Which of the names, or a part of one.
    pub label: String,
    /// 0 to 1.
    pub confidence: f64,
    /// Upper left corner, width and height, px.
    pub box_px: [f64; 4],
}

/// Why there is no scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DetectError {
    /// The detector needs something that the view lacks.
    #[error("view has no {0}, which this detector needs")]
    Missing(&'static str),
    /// Something in the view contradicts something else.
    #[error("view: {0}")]
    View(String),
    /// The model or the server failed.
    #[error("detector: {0}")]
    Failed(String),
}

/// Finds named things.
pub trait Detector {
    /// Looks for `names`. An empty list means whatever the detector knows.
    ///
    /// # Errors
    /// [`DetectError`]; the caller goes on with the last scene.
    fn detect(&mut self, view: &View<'_>, names: &[String]) -> Result<Scene, DetectError>;
}

/// The scene of a view's boxes; a box that can't be placed is left out.
fn scene(view: &View<'_>, boxes: Vec<ImageBox>) -> Result<Scene, DetectError> {
    let camera = view.camera.ok_or(DetectError::Missing("camera"))?;
    let objects = boxes.iter().filter_map(|found| lift(view, camera, found));
    Ok(Scene {
        stamp_ns: view.stamp_ns,
        camera: Some(camera.clone()),
        table: view.table,
        objects: objects.take(crate::scene::SCENE_CAPACITY).collect(),
        fixtures: view.fixtures.to_vec(),
    })
}
