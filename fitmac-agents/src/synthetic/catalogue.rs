//! Things, fixtures and the camera, in the manner of LIBERO's two suites.

use crate::scene::{Camera, Detection, Part, Table};

use super::layout::{Support, Thing};
use super::truth::Disc;

/// The table of every layout.
pub(super) const TABLE: Table = Table {
    centre_m: [0.55, 0.0, 0.0],
    half_extent_m: [0.36, 0.50],
};

pub(super) const BOWL: (&str, [f64; 3]) = ("akita_black_bowl", [0.107, 0.107, 0.050]);
pub(super) const PLATE: (&str, [f64; 3]) = ("plate", [0.16, 0.16, 0.02]);
pub(super) const RAMEKIN: (&str, [f64; 3]) = ("glazed_rim_porcelain_ramekin", [0.08, 0.08, 0.04]);
pub(super) const COOKIES: (&str, [f64; 3]) = ("cookies", [0.14, 0.07, 0.04]);

pub(super) const PRODUCTS: &[(&str, &str, [f64; 3])] = &[
    ("alphabet soup", "alphabet_soup", [0.065, 0.065, 0.085]),
    ("cream cheese", "cream_cheese", [0.09, 0.06, 0.03]),
    ("salad dressing", "salad_dressing", [0.05, 0.05, 0.17]),
    ("bbq sauce", "bbq_sauce", [0.05, 0.05, 0.15]),
    ("ketchup", "ketchup", [0.05, 0.05, 0.15]),
    ("tomato sauce", "tomato_sauce", [0.065, 0.065, 0.085]),
    ("butter", "butter", [0.10, 0.05, 0.04]),
    ("milk", "milk", [0.06, 0.06, 0.17]),
    ("chocolate pudding", "chocolate_pudding", [0.09, 0.06, 0.03]),
    ("orange juice", "orange_juice", [0.06, 0.06, 0.17]),
];

/// How people call a label.
pub(super) fn spoken(label: &str) -> &'static str {
    match label {
        "plate" => "plate",
        "glazed_rim_porcelain_ramekin" => "ramekin",
        "cookies" => "cookie box",
        "flat_stove" => "stove",
        "wooden_cabinet" => "wooden cabinet",
        _ => "object",
    }
}

pub(super) fn disc(detection: &Detection) -> Disc {
    let [x, y, _] = detection.position_m;
    Disc {
        at: [x, y],
        half: [detection.size_m[0] / 2.0, detection.size_m[1] / 2.0],
    }
}

pub(super) fn thing(
    label: &str,
    size_m: [f64; 3],
    position_m: [f64; 3],
    support: Support,
) -> Thing {
    Thing {
        detection: fixture(label, position_m, size_m),
        support,
    }
}

pub(super) fn fixture(label: &str, position_m: [f64; 3], size_m: [f64; 3]) -> Detection {
    Detection {
        id: 0,
        label: label.to_owned(),
        confidence: 1.0,
        position_m,
        size_m,
        orientation: None,
        box_px: None,
        colour: None,
        parts: Vec::new(),
    }
}

pub(super) fn fixtures() -> Vec<Detection> {
    let mut cabinet = fixture("wooden_cabinet", [0.50, -0.62, 0.12], [0.25, 0.20, 0.24]);
    cabinet.parts.push(Part {
        name: "top drawer".to_owned(),
        position_m: [0.50, -0.48, 0.17],
        size_m: [0.22, 0.26, 0.07],
    });
    vec![
        cabinet,
        fixture("flat_stove", [0.42, 0.60, 0.02], [0.2, 0.2, 0.04]),
    ]
}

/// A camera opposite the robot, looking down at 30 degrees.
pub(super) fn camera() -> Camera {
    let (down, level) = (0.5, 0.75_f64.sqrt());
    Camera {
        name: "agentview".to_owned(),
        image_size_px: [256, 256],
        focal_px: [309.0, 309.0],
        principal_px: [128.0, 128.0],
        position_m: [1.35, 0.0, 0.55],
        rotation: [[0.0, down, -level], [1.0, 0.0, 0.0], [0.0, -level, -down]],
    }
}
