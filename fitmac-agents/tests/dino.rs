//! Grounding DINO's pre- and post-processing through ONNX Runtime, against
//! NumPy (`tests/data/make_dino.py`).
//!
//! Needs the runtime's shared library, as in
//! `FITMAC_ONNXRUNTIME=.../libonnxruntime.so.1.31.1
//! cargo test -p fitmac-agents --features onnx --test dino -- --ignored`.
#![cfg(feature = "onnx")]

use std::path::{Path, PathBuf};

use fitmac_agents::canvas::Canvas;
use fitmac_agents::detector::DetectError;
use fitmac_agents::detector::dino::{DinoConfig, GroundingDino};

#[derive(serde::Deserialize)]
struct Expected {
    label: String,
    confidence: f64,
    box_px: [f64; 4],
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn config() -> DinoConfig {
    let runtime = std::env::var("FITMAC_ONNXRUNTIME").expect("path of libonnxruntime.so");
    let model = DinoConfig::new(Path::new(&runtime), &data("dino.onnx"), &data("vocab.txt"));
    // The test image's own size; nothing is suppressed.
    DinoConfig {
        shorter_px: 32,
        longer_px: 64,
        overlap: 1.0,
        ..model
    }
}

fn image() -> Canvas {
    let pixel = |x: u32, y: u32| [x * 5, y * 7, (x + y) * 3].map(|value| (value % 256) as u8);
    let rgb = (0..32)
        .flat_map(|y| (0..48).flat_map(move |x| pixel(x, y)))
        .collect();
    Canvas::from_rgb(48, 32, rgb).expect("48 x 32")
}

#[test]
#[ignore = "needs ONNX Runtime: set FITMAC_ONNXRUNTIME"]
fn boxes_agree_with_numpy() {
    let names = ["black bowl".to_owned(), "ramekin".to_owned()];
    let mut dino = GroundingDino::new(config()).expect("loaded");
    let found = dino.boxes(&image(), &names).expect("boxes");
    let text = std::fs::read_to_string(data("dino.json")).expect("expected");
    let expected: Vec<Expected> = serde_json::from_str(&text).expect("expected");
    assert_eq!(found.len(), expected.len());
    assert!(found.len() > 3);
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found.label, expected.label);
        assert!((found.confidence - expected.confidence).abs() < 1e-4);
        for (found, expected) in found.box_px.iter().zip(expected.box_px) {
            assert!((found - expected).abs() < 1e-2, "{found} {expected}");
        }
    }
    // Scaled up, the mean colour and so the boxes hardly change.
    let mut scaled = GroundingDino::new(DinoConfig {
        shorter_px: 80,
        longer_px: 200,
        ..config()
    })
    .expect("loaded");
    let again = scaled.boxes(&image(), &names).expect("boxes");
    assert_eq!(again.len(), found.len());
    for (one, two) in again.iter().zip(&found) {
        assert!((one.box_px[0] - two.box_px[0]).abs() < 1.0);
    }
    // A double is suppressed where boxes of one name overlap at all.
    let mut few = GroundingDino::new(DinoConfig {
        overlap: 0.05,
        ..config()
    })
    .expect("loaded");
    assert!(few.boxes(&image(), &names).expect("boxes").len() < found.len());
}

#[test]
#[ignore = "needs ONNX Runtime: set FITMAC_ONNXRUNTIME"]
fn a_missing_or_broken_file_is_named() {
    let missing = DinoConfig {
        model: data("no.onnx"),
        ..config()
    };
    let error = GroundingDino::new(missing).expect_err("missing");
    assert!(
        matches!(&error, DetectError::Failed(text) if text.contains("no.onnx")),
        "{error}"
    );
    let broken = DinoConfig {
        model: data("vocab.txt"),
        ..config()
    };
    assert!(GroundingDino::new(broken).is_err());
}
