//! What a detector saw: objects and fixtures with poses in the robot's base
//! frame.
//!
//! A scene is the common ground of all detectors and the input of the
//! grounder. As JSON it is what `fitmac ground --scene` reads.

use serde::{Deserialize, Serialize};

/// Most objects and most fixtures of a scene.
pub const SCENE_CAPACITY: usize = 64;

/// Longest label, bytes.
pub const LABEL_CAP: usize = 64;

/// Farthest position that is believed, m from the base.
const REACH_CAP_M: f64 = 10.0;

/// A camera's view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Its name, as in "agentview".
    pub name: String,
    /// Width and height of the image, px.
    pub image_size_px: [u32; 2],
    /// Focal lengths x and y, px.
    pub focal_px: [f64; 2],
    /// Principal point x and y, px.
    pub principal_px: [f64; 2],
    /// Optical centre in the base frame, m.
    pub position_m: [f64; 3],
    /// Rotation from the camera's optical frame (x right, y down, z forward) to
    /// the base frame, row-major.
    pub rotation: [[f64; 3]; 3],
}

impl Camera {
    /// The image point of a base-frame point, px; `None` behind the camera.
    #[must_use]
    pub fn project(&self, point_m: [f64; 3]) -> Option<[f64; 2]> {
        let offset: [f64; 3] = std::array::from_fn(|axis| point_m[axis] - self.position_m[axis]);
        let along = |column: usize| -> f64 {
            (0..3)
                .map(|row| self.rotation[row][column] * offset[row])
                .sum()
        };
        let depth = along(2);
        (depth > 1e-6).then(|| {
            [
                self.principal_px[0] + self.focal_px[0] * along(0) / depth,
                self.principal_px[1] + self.focal_px[1] * along(1) / depth,
            ]
        })
    }

    /// The base-frame point at image point `pixel_px` and `depth_m` along the
    /// optical axis.
    #[must_use]
    pub fn unproject(&self, pixel_px: [f64; 2], depth_m: f64) -> [f64; 3] {
        let ray: [f64; 3] = [
            (pixel_px[0] - self.principal_px[0]) / self.focal_px[0] * depth_m,
            (pixel_px[1] - self.principal_px[1]) / self.focal_px[1] * depth_m,
            depth_m,
        ];
        std::array::from_fn(|row| {
            self.position_m[row] + (0..3).map(|k| self.rotation[row][k] * ray[k]).sum::<f64>()
        })
    }
}

/// A named part of a fixture, such as a drawer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Its name, as in "top drawer".
    pub name: String,
    /// Centre of its bounding box in the base frame, m.
    pub position_m: [f64; 3],
    /// Extents of its bounding box along the base axes, m.
    pub size_m: [f64; 3],
}

/// One detected object or fixture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Detection {
    /// The object's number in the pose source (1 to 65535), or 0 if the
    /// detector doesn't know it.
    #[serde(default)]
    pub id: u16,
    /// What it is, as in "akita_black_bowl_1"; underscores, case and a trailing
    /// number don't matter.
    pub label: String,
    /// The detector's confidence, 0 to 1.
    pub confidence: f64,
    /// Centre of the bounding box in the base frame, m.
    pub position_m: [f64; 3],
    /// Extents of the bounding box along the base axes, m.
    pub size_m: [f64; 3],
    /// Orientation of the object's own frame in the base frame, as the pose source has it: unit
    /// quaternion w, x, y, z. Without it the frame lies along the base axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<[f64; 4]>,
    /// Box in the image: x and y of the upper left corner, width, height, px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_px: Option<[f64; 4]>,
    /// Its colour in a word, if the detector tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<String>,
    /// Named parts, for fixtures.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
}

/// The support that objects stand on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Centre of the top in the base frame, m.
    pub centre_m: [f64; 3],
    /// Half extents of the top in x and y, m.
    pub half_extent_m: [f64; 2],
}

/// All that was seen at one instant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// When it was seen, ns of a monotonic clock.
    #[serde(default)]
    pub stamp_ns: u64,
    /// The camera, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// The table, if it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<Table>,
    /// Things that can be picked up.
    pub objects: Vec<Detection>,
    /// Things that stay, such as a cabinet or a stove.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixtures: Vec<Detection>,
}

/// A scene that can't be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// No scene in JSON.
    #[error("scene isn't valid: {0}")]
    Json(String),
    /// A field with an impossible value.
    #[error("scene: {field}: {problem}")]
    Field {
        /// The field with its index, as in `objects[3].size_m`.
        field: String,
        /// What is wrong, and what is allowed.
        problem: &'static str,
    },
}

impl Scene {
    /// Reads and checks a scene.
    ///
    /// # Errors
    /// [`SceneError`] names the first field that is missing, unknown or out of
    /// range.
    pub fn from_json(text: &str) -> Result<Self, SceneError> {
        let scene: Self =
            serde_json::from_str(text).map_err(|error| SceneError::Json(error.to_string()))?;
        scene.check()?;
        Ok(scene)
    }

    /// Checks counts, labels, finiteness and ranges.
    ///
    /// # Errors
    /// [`SceneError::Field`] names the first field that is out of range.
    pub fn check(&self) -> Result<(), SceneError> {
        for (list, detections) in [("objects", &self.objects), ("fixtures", &self.fixtures)] {
            if detections.len() > SCENE_CAPACITY {
                return Err(field(list.to_owned(), "at most 64 entries are read"));
            }
            for (index, detection) in detections.iter().enumerate() {
                check_detection(detection, &format!("{list}[{index}]"))?;
            }
        }
        let ids = self
            .objects
            .iter()
            .map(|object| object.id)
            .filter(|id| *id != 0);
        let mut seen = std::collections::HashSet::new();
        if let Some(id) = ids.into_iter().find(|id| !seen.insert(*id)) {
            return Err(field(
                format!("objects: id {id}"),
                "each object needs an id of its own",
            ));
        }
        if let Some(table) = &self.table {
            check_position(&table.centre_m, "table.centre_m")?;
            if !table
                .half_extent_m
                .iter()
                .all(|half| (0.0..REACH_CAP_M).contains(half))
            {
                return Err(field("table.half_extent_m".to_owned(), "must be 0 to 10 m"));
            }
        }
        self.camera.as_ref().map_or(Ok(()), check_camera)
    }

    /// Where an object is in the camera's image: its own box, or the box around
    /// its projected corners; x, y, width, height, px.
    #[must_use]
    pub fn box_of(&self, object: &Detection) -> Option<[f64; 4]> {
        if object.box_px.is_some() {
            return object.box_px;
        }
        let camera = self.camera.as_ref()?;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in 0..8_u8 {
            let side = |axis: usize| if corner >> axis & 1 == 1 { 0.5 } else { -0.5 };
            let at: [f64; 3] =
                std::array::from_fn(|a| object.position_m[a] + side(a) * object.size_m[a]);
            let pixel = camera.project(at)?;
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
        Some([low[0], low[1], high[0] - low[0], high[1] - low[1]])
    }

    /// Mean of the detector's confidence in the objects, 0 to 1; 0 without any.
    #[must_use]
    pub fn mean_confidence(&self) -> f64 {
        if self.objects.is_empty() {
            return 0.0;
        }
        let sum: f64 = self.objects.iter().map(|object| object.confidence).sum();
        sum / self.objects.len() as f64
    }

    /// Objects, then fixtures.
    pub fn all(&self) -> impl Iterator<Item = &Detection> {
        self.objects.iter().chain(&self.fixtures)
    }
}

impl Detection {
    /// Height of the upper face in the base frame, m.
    #[must_use]
    pub fn top_m(&self) -> f64 {
        self.position_m[2] + self.size_m[2] / 2.0
    }

    /// Height of the lower face in the base frame, m.
    #[must_use]
    pub fn bottom_m(&self) -> f64 {
        self.position_m[2] - self.size_m[2] / 2.0
    }

    /// True if the detection can be used: a detector drops the others.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        check_detection(self, "").is_ok()
    }
}

fn field(field: String, problem: &'static str) -> SceneError {
    SceneError::Field { field, problem }
}

fn check_detection(detection: &Detection, at: &str) -> Result<(), SceneError> {
    check_label(&detection.label, &format!("{at}.label"))?;
    if let Some(colour) = &detection.colour {
        check_label(colour, &format!("{at}.colour"))?;
    }
    if !(0.0..=1.0).contains(&detection.confidence) {
        return Err(field(format!("{at}.confidence"), "must be between 0 and 1"));
    }
    check_position(&detection.position_m, &format!("{at}.position_m"))?;
    check_size(&detection.size_m, &format!("{at}.size_m"))?;
    if detection
        .orientation
        .is_some_and(|wxyz| !is_unit_quaternion(&wxyz))
    {
        return Err(field(
            format!("{at}.orientation"),
            "must be a unit quaternion w, x, y, z",
        ));
    }
    if detection
        .box_px
        .is_some_and(|pixels| !pixels.iter().all(|value| value.is_finite()))
    {
        return Err(field(format!("{at}.box_px"), "must be four finite numbers"));
    }
    if detection.parts.len() > SCENE_CAPACITY {
        return Err(field(format!("{at}.parts"), "at most 64 entries are read"));
    }
    for (index, part) in detection.parts.iter().enumerate() {
        let at = format!("{at}.parts[{index}]");
        check_label(&part.name, &format!("{at}.name"))?;
        check_position(&part.position_m, &format!("{at}.position_m"))?;
        check_size(&part.size_m, &format!("{at}.size_m"))?;
    }
    Ok(())
}

fn is_unit_quaternion(wxyz: &[f64; 4]) -> bool {
    let square: f64 = wxyz.iter().map(|x| x * x).sum();
    (square - 1.0).abs() <= 1e-3
}

fn check_label(label: &str, at: &str) -> Result<(), SceneError> {
    if label.trim().is_empty() || label.len() > LABEL_CAP || label.chars().any(char::is_control) {
        return Err(field(
            at.to_owned(),
            "must be 1 to 64 bytes without control characters",
        ));
    }
    Ok(())
}

fn check_position(position: &[f64; 3], at: &str) -> Result<(), SceneError> {
    if position.iter().all(|value| value.abs() <= REACH_CAP_M) {
        return Ok(());
    }
    Err(field(
        at.to_owned(),
        "must be finite and within 10 m of the base: is it in metres?",
    ))
}

fn check_size(size: &[f64; 3], at: &str) -> Result<(), SceneError> {
    if size.iter().all(|value| (0.0..=REACH_CAP_M).contains(value)) {
        return Ok(());
    }
    Err(field(at.to_owned(), "must be 0 to 10 m: is it in metres?"))
}

fn check_camera(camera: &Camera) -> Result<(), SceneError> {
    check_position(&camera.position_m, "camera.position_m")?;
    if camera.image_size_px.contains(&0) || camera.image_size_px.iter().any(|size| *size > 16384) {
        return Err(field(
            "camera.image_size_px".to_owned(),
            "must be 1 to 16384 px",
        ));
    }
    let positive = |value: &f64| value.is_finite() && *value > 0.0;
    if !camera.focal_px.iter().all(positive) {
        return Err(field("camera.focal_px".to_owned(), "must be positive"));
    }
    if !camera.principal_px.iter().all(|value| value.is_finite()) {
        return Err(field("camera.principal_px".to_owned(), "must be finite"));
    }
    // Rows of a rotation have length 1 and are at right angles.
    let rows = camera.rotation;
    for (first, second, expected) in [
        (0, 0, 1.0),
        (1, 1, 1.0),
        (2, 2, 1.0),
        (0, 1, 0.0),
        (0, 2, 0.0),
        (1, 2, 0.0),
    ] {
        let dot: f64 = rows[first]
            .iter()
            .zip(rows[second])
            .map(|(a, b)| a * b)
            .sum();
        // Written so that a NaN fails.
        if (dot - expected).abs().is_nan() || (dot - expected).abs() > 1e-3 {
            return Err(field(
                "camera.rotation".to_owned(),
                "must be a rotation matrix",
            ));
        }
    }
    Ok(())
}
