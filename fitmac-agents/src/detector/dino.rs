//! Grounding DINO by ONNX Runtime.
//!
//! The user gives the shared library of ONNX Runtime (the PyPI wheel
//! `onnxruntime` has it as `onnxruntime/capi/libonnxruntime.so.*`), an exported
//! model and its `vocab.txt`; nothing is downloaded. The signature is that of
//! Hugging Face's export: `pixel_values` [1, 3, H, W], `pixel_mask` [1, H, W],
//! `input_ids`, `token_type_ids` and `attention_mask` [1, T]; `logits`
//! [1, Q, 256] and `pred_boxes` [1, Q, 4] (centre, width, height, as shares of
//! the image).

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use ort::environment::Environment;
use ort::session::Session;
use ort::value::Tensor;

use super::wordpiece::{Tokens, WordPiece};
use super::{DetectError, Detector, ImageBox, View, scene};
use crate::canvas::Canvas;
use crate::scene::Scene;

/// Files and thresholds.
#[derive(Clone, Debug, PartialEq)]
pub struct DinoConfig {
    /// ONNX Runtime's shared library, 1.23 or later. A process loads one: the
    /// first model's.
    pub runtime: PathBuf,
    /// The exported model.
    pub model: PathBuf,
    /// Its `vocab.txt`.
    pub vocabulary: PathBuf,
    /// The image's shorter side is scaled to this, px (800 in training).
    pub shorter_px: u32,
    /// Unless the longer side would exceed this, px (1333 in training).
    pub longer_px: u32,
    /// Least confidence of a box, 0 to 1.
    pub box_threshold: f64,
    /// Boxes of one name that overlap by more than this share are one, 0 to 1.
    pub overlap: f64,
    /// Threads of the runtime.
    pub threads: usize,
}

impl DinoConfig {
    /// The model's own image sizes, and thresholds that suit a table-top.
    #[must_use]
    pub fn new(runtime: &Path, model: &Path, vocabulary: &Path) -> Self {
        Self {
            runtime: runtime.to_owned(),
            model: model.to_owned(),
            vocabulary: vocabulary.to_owned(),
            shorter_px: 800,
            longer_px: 1333,
            box_threshold: 0.3,
            overlap: 0.7,
            threads: 1,
        }
    }
}

/// Text positions in the model's logits.
const TEXT_CAPACITY: usize = 256;

/// Mean and standard deviation of ImageNet's channels, of values 0 to 1.
const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f32; 3] = [0.229, 0.224, 0.225];

/// A loaded model.
#[derive(Debug)]
pub struct GroundingDino {
    config: DinoConfig,
    pieces: WordPiece,
    session: Session,
}

fn failed(error: impl std::fmt::Display) -> DetectError {
    DetectError::Failed(error.to_string())
}

/// The process's one environment.
fn environment(runtime: &Path) -> Result<&'static Environment, DetectError> {
    static LOADED: Mutex<()> = Mutex::new(());
    static ENVIRONMENT: OnceLock<Environment> = OnceLock::new();
    let _one_at_a_time = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(environment) = ENVIRONMENT.get() {
        return Ok(environment);
    }
    let named = |error: String| DetectError::Failed(format!("{}: {error}", runtime.display()));
    let environment = ort::init_from(runtime)
        .map_err(|error| named(error.to_string()))?
        .with_name("fitmac")
        .build()
        .map_err(|error| named(error.to_string()))?;
    Ok(ENVIRONMENT.get_or_init(|| environment))
}

impl GroundingDino {
    /// Loads library, vocabulary and model.
    ///
    /// # Errors
    /// [`DetectError::Failed`] names the file that can't be used.
    pub fn new(config: DinoConfig) -> Result<Self, DetectError> {
        let named = |path: &Path, error: &dyn std::fmt::Display| {
            DetectError::Failed(format!("{}: {error}", path.display()))
        };
        let text = std::fs::read_to_string(&config.vocabulary)
            .map_err(|error| named(&config.vocabulary, &error))?;
        let pieces = WordPiece::new(&text).map_err(|error| named(&config.vocabulary, &error))?;
        let environment = environment(&config.runtime)?;
        let session = Session::builder(environment)
            .map_err(failed)?
            .with_intra_threads(config.threads)
            .map_err(failed)?
            .commit_from_file(&config.model)
            .map_err(|error| named(&config.model, &error))?;
        Ok(Self {
            config,
            pieces,
            session,
        })
    }

    /// The boxes of `names` in an image.
    ///
    /// # Errors
    /// [`DetectError::Failed`] if the model fails or has another signature.
    pub fn boxes(
        &mut self,
        image: &Canvas,
        names: &[String],
    ) -> Result<Vec<ImageBox>, DetectError> {
        let tokens = self.pieces.names(names, TEXT_CAPACITY);
        let (width, height) = self.input_size(image);
        let pixels = preprocess(image, width, height);
        let (w, h, count) = (width as usize, height as usize, tokens.ids.len());
        let inputs = ort::inputs![
            "pixel_values" => Tensor::from_array(([1, 3, h, w], pixels)).map_err(failed)?,
            "pixel_mask" => Tensor::from_array(([1, h, w], vec![1_i64; h * w])).map_err(failed)?,
            "input_ids" => Tensor::from_array(([1, count], tokens.ids.clone())).map_err(failed)?,
            "token_type_ids" => Tensor::from_array(([1, count], vec![0_i64; count])).map_err(failed)?,
            "attention_mask" => Tensor::from_array(([1, count], vec![1_i64; count])).map_err(failed)?,
        ];
        let outputs = self.session.run(inputs).map_err(failed)?;
        let output = |name: &str| {
            let value = outputs
                .get(name)
                .ok_or_else(|| failed(format!("model has no {name}")))?;
            let (shape, data) = value.try_extract_tensor::<f32>().map_err(failed)?;
            Ok::<_, DetectError>((shape.to_vec(), data))
        };
        let (logit_shape, logits) = output("logits")?;
        let (box_shape, boxes) = output("pred_boxes")?;
        match (logit_shape.as_slice(), box_shape.as_slice()) {
            ([1, queries, positions], [1, boxes, 4]) if queries == boxes && *positions > 0 => {}
            _ => {
                return Err(failed(format!(
                    "logits {logit_shape:?}, pred_boxes {box_shape:?}"
                )));
            }
        }
        let positions = logit_shape.last().map_or(1, |size| *size as usize);
        let found = postprocess(
            logits.chunks_exact(positions).zip(boxes.chunks_exact(4)),
            &tokens,
            names,
            image.size_px(),
            self.config.box_threshold,
        );
        Ok(suppressed(found, self.config.overlap))
    }

    /// Width and height of the model's image, px.
    fn input_size(&self, image: &Canvas) -> (u32, u32) {
        let [width, height] = image.size_px().map(f64::from);
        let (shorter, longer) = (width.min(height).max(1.0), width.max(height).max(1.0));
        let scale = (f64::from(self.config.shorter_px) / shorter)
            .min(f64::from(self.config.longer_px) / longer);
        let scaled = |size: f64| ((size * scale).round() as u32).max(1);
        (scaled(width), scaled(height))
    }
}

impl Detector for GroundingDino {
    fn detect(&mut self, view: &View<'_>, names: &[String]) -> Result<Scene, DetectError> {
        let image = view.image.ok_or(DetectError::Missing("image"))?;
        let boxes = self.boxes(image, names)?;
        scene(view, boxes)
    }
}

/// Scales bilinearly (pixel centres aligned), normalises, and orders the
/// values by channel, row, column.
fn preprocess(image: &Canvas, width: u32, height: u32) -> Vec<f32> {
    let [from_width, from_height] = image.size_px();
    let rgb = image.rgb();
    let along = |to: u32, to_size: u32, from_size: u32| {
        let scale = from_size as f32 / to_size as f32;
        let at = ((to as f32 + 0.5) * scale - 0.5).clamp(0.0, from_size as f32 - 1.0);
        let low = at as usize;
        (low, (low + 1).min(from_size as usize - 1), at - at.floor())
    };
    let mut out = Vec::with_capacity(3 * width as usize * height as usize);
    for channel in 0..3 {
        for row in 0..height {
            let (top, bottom, down) = along(row, height, from_height);
            for column in 0..width {
                let (left, right, over) = along(column, width, from_width);
                let at = |row: usize, column: usize| {
                    let index = 3 * (row * from_width as usize + column) + channel;
                    f32::from(rgb.get(index).copied().unwrap_or(0))
                };
                let upper = at(top, left) * (1.0 - over) + at(top, right) * over;
                let lower = at(bottom, left) * (1.0 - over) + at(bottom, right) * over;
                let value = (upper * (1.0 - down) + lower * down) / 255.0;
                out.push((value - MEAN[channel]) / DEVIATION[channel]);
            }
        }
    }
    out
}

/// Boxes above the threshold, each with the name of its likeliest piece.
fn postprocess<'a>(
    queries: impl Iterator<Item = (&'a [f32], &'a [f32])>,
    tokens: &Tokens,
    names: &[String],
    size_px: [u32; 2],
    threshold: f64,
) -> Vec<ImageBox> {
    let [width, height] = size_px.map(f64::from);
    let mut found = Vec::new();
    for (logits, shares) in queries {
        let named = logits
            .iter()
            .zip(&tokens.names)
            .filter_map(|(logit, name)| {
                let probability = 1.0 / (1.0 + (-f64::from(*logit)).exp());
                name.map(|name| (probability, name))
                    .filter(|_| probability.is_finite())
            });
        let best = named.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((confidence, name)) = best.filter(|best| best.0 > threshold) else {
            continue;
        };
        let [x, y, w, h] =
            [0, 1, 2, 3].map(|at| shares.get(at).map_or(f64::NAN, |s| f64::from(*s)));
        let box_px = [
            (x - w / 2.0) * width,
            (y - h / 2.0) * height,
            w * width,
            h * height,
        ];
        if let Some(label) = names.get(name)
            && box_px.iter().all(|value| value.is_finite())
        {
            found.push(ImageBox {
                label: label.clone(),
                confidence,
                box_px,
            });
        }
    }
    found
}

/// The surest of boxes with one name that overlap.
fn suppressed(mut found: Vec<ImageBox>, limit: f64) -> Vec<ImageBox> {
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    let mut kept: Vec<ImageBox> = Vec::new();
    for candidate in found {
        let double = |other: &ImageBox| {
            other.label == candidate.label && overlap(&other.box_px, &candidate.box_px) > limit
        };
        if !kept.iter().any(double) {
            kept.push(candidate);
        }
    }
    kept
}

/// Intersection over union.
fn overlap(one: &[f64; 4], other: &[f64; 4]) -> f64 {
    let common = |axis: usize| {
        let low = one[axis].max(other[axis]);
        let high = (one[axis] + one[axis + 2]).min(other[axis] + other[axis + 2]);
        (high - low).max(0.0)
    };
    let both = common(0) * common(1);
    let union = one[2] * one[3] + other[2] * other[3] - both;
    if union > 0.0 { both / union } else { 0.0 }
}
