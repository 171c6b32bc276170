//! A detector behind HTTP.
//!
//! One `POST` with `{"image_png": base64, "names": [..]}`; the answer is
//! `{"boxes": [{"label", "confidence", "box_px": [x, y, width, height]}]}`.

use std::time::Duration;

use base64::Engine as _;
use serde::{Deserialize, Serialize};

use super::{DetectError, Detector, ImageBox, View, scene};
use crate::scene::{LABEL_CAP, SCENE_CAPACITY, Scene};

/// Where the detector is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemoteConfig {
    /// Its address.
    pub url: String,
    /// Time limit of a call, ms.
    pub timeout_ms: u64,
    /// Longest answer, bytes.
    pub answer_cap_bytes: u64,
}

impl RemoteConfig {
    /// A detector at `url`: 2 s, 256 KiB.
    #[must_use]
    pub fn new(url: &str) -> Self {
        Self {
            url: url.to_owned(),
            timeout_ms: 2000,
            answer_cap_bytes: 256 * 1024,
        }
    }
}

/// Asks a server for boxes.
#[derive(Debug)]
pub struct RemoteDetector {
    config: RemoteConfig,
    agent: ureq::Agent,
}

#[derive(Serialize)]
struct Request<'a> {
    image_png: String,
    names: &'a [String],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    boxes: Vec<AnswerBox>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnswerBox {
    label: String,
    confidence: f64,
    box_px: [f64; 4],
}

impl RemoteDetector {
    /// Prepares calls; nothing is sent.
    #[must_use]
    pub fn new(config: RemoteConfig) -> Self {
        let agent = ureq::Agent::config_builder()
            .timeout_global(Some(Duration::from_millis(config.timeout_ms)))
            .max_redirects(0)
            .build()
            .into();
        Self { config, agent }
    }

    fn boxes(&self, view: &View<'_>, names: &[String]) -> Result<Vec<ImageBox>, DetectError> {
        let failed = |error: String| DetectError::Failed(error);
        let image = view.image.ok_or(DetectError::Missing("image"))?;
        let png = image.png().map_err(|error| failed(error.to_string()))?;
        let image_png = base64::engine::general_purpose::STANDARD.encode(png);
        let body = serde_json::to_string(&Request { image_png, names })
            .map_err(|error| failed(error.to_string()))?;
        let mut response = self
            .agent
            .post(&self.config.url)
            .header("content-type", "application/json")
            .send(body)
            .map_err(|error| failed(error.to_string()))?;
        let text = response
            .body_mut()
            .with_config()
            .limit(self.config.answer_cap_bytes)
            .read_to_string()
            .map_err(|error| failed(error.to_string()))?;
        let answer: Answer =
            serde_json::from_str(&text).map_err(|error| failed(error.to_string()))?;
        if answer.boxes.len() > SCENE_CAPACITY {
            return Err(failed("more than 64 boxes".to_owned()));
        }
        answer.boxes.into_iter().map(checked).collect()
    }
}

fn checked(found: AnswerBox) -> Result<ImageBox, DetectError> {
    let AnswerBox {
        label,
        confidence,
        box_px,
    } = found;
    let label_ok =
        !label.is_empty() && label.len() <= LABEL_CAP && !label.contains(char::is_control);
    let [_, _, width, height] = box_px;
    let box_ok = box_px.iter().all(|value| value.abs() < 1e5) && width > 0.0 && height > 0.0;
    if label_ok && box_ok && (0.0..=1.0).contains(&confidence) {
        Ok(ImageBox {
            label,
            confidence,
            box_px,
        })
    } else {
        Err(DetectError::Failed(
            "a box with a label, number or size out of range".to_owned(),
        ))
    }
}

impl Detector for RemoteDetector {
    fn detect(&mut self, view: &View<'_>, names: &[String]) -> Result<Scene, DetectError> {
        scene(view, self.boxes(view, names)?)
    }
}
