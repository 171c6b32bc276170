//! `fitmac plan` and `fitmac ground` with a model behind a local server that
//! speaks the protocol.

use std::path::Path;
use std::process::{Command, Output};

use base64::Engine as _;
use fitmac_agents::canvas::{Canvas, Colour};
use fitmac_agents::model::stand_in::{Manner, StandIn};
use serde_json::{Value, json};

const KEY: &str = "FITMAC_TEST_KEY";

fn fitmac(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fitmac"))
        .args(arguments)
        .env(KEY, "s3cret")
        .output()
        .expect("fitmac starts")
}

fn server(content: &Value) -> StandIn {
    StandIn::start(Manner::Content(content.to_string())).expect("a port")
}

fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn bowl(y_m: f64, box_px: [f64; 4]) -> Value {
    json!({"label": "black bowl", "confidence": 0.9, "position_m": [0.5, y_m, 0.025],
           "size_m": [0.1, 0.1, 0.05], "box_px": box_px})
}

/// Two bowls at the ramekin, as near as each other, and a plate; one bowl has
/// no box of its own, but a camera sees it.
fn write_scene(folder: &Path) -> [String; 2] {
    let mut other = bowl(0.2, [0.0; 4]);
    other.as_object_mut().expect("an object").remove("box_px");
    let scene = json!({
        "camera": {"name": "top", "image_size_px": [320, 240], "focal_px": [300.0, 300.0],
                   "principal_px": [160.0, 120.0], "position_m": [0.5, 0.1, 1.0],
                   "rotation": [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]},
        "objects": [
            bowl(0.0, [20.0, 60.0, 40.0, 30.0]),
            other,
            {"label": "ramekin", "confidence": 0.9, "position_m": [0.5, 0.1, 0.02],
             "size_m": [0.08, 0.08, 0.04], "box_px": [150.0, 60.0, 30.0, 30.0]},
            {"label": "milk", "confidence": 0.9, "position_m": [0.3, 0.4, 0.07],
             "size_m": [0.05, 0.05, 0.14], "box_px": [20.0, 150.0, 30.0, 50.0]}
        ]
    });
    let (scene_file, image_file) = (folder.join("scene.json"), folder.join("camera.png"));
    std::fs::write(&scene_file, scene.to_string()).expect("written");
    let image = Canvas::filled(320, 240, Colour::WHITE)
        .png()
        .expect("a PNG");
    std::fs::write(&image_file, image).expect("written");
    [scene_file, image_file].map(|path| path.display().to_string())
}

/// Colour of a pixel.
fn pixel(image: &Canvas, [x, y]: [u32; 2]) -> [u8; 3] {
    let [width, _] = image.size_px();
    let at = 3 * (y * width + x) as usize;
    image.rgb()[at..at + 3].try_into().expect("three bytes")
}

const SENTENCE: &str = "pick up the black bowl next to the ramekin";

#[test]
fn the_model_sees_the_marked_image_and_chooses() {
    let folder = tempfile::tempdir().expect("a folder");
    let [scene, image] = write_scene(folder.path());
    let server = server(&json!({"selected_index": 1, "confidence": 0.9, "reason": "nearer"}));
    let marked = folder.path().join("marked.png").display().to_string();
    let output = fitmac(&[
        "ground",
        "--scene",
        &scene,
        "--image",
        &image,
        "--annotated",
        &marked,
        "--json",
        "--model-url",
        server.url(),
        "--model",
        "test-vlm",
        "--model-key-env",
        KEY,
        SENTENCE,
    ]);
    let told = json_of(&output);
    assert_eq!(told["selected_index"], 1, "{told}");
    assert_eq!(told["confidence"], 0.85, "a model's choice is capped");
    assert!(told["reason"].as_str().expect("text").contains("nearer"));

    let asked = server.asked();
    let [request] = asked.as_slice() else {
        panic!("{} requests", asked.len());
    };
    assert_eq!(request.authorization.as_deref(), Some("Bearer s3cret"));
    assert_eq!(request.body["model"], "test-vlm");
    assert_eq!(request.body["response_format"]["type"], "json_object");
    let parts = request.body["messages"][1]["content"]
        .as_array()
        .expect("parts");
    assert!(
        parts[0]["text"]
            .as_str()
            .expect("text")
            .contains("next to the ramekin")
    );
    let url = parts[1]["image_url"]["url"].as_str().expect("an image");
    let data = url
        .strip_prefix("data:image/png;base64,")
        .expect("a data URL");
    let png = base64::engine::general_purpose::STANDARD
        .decode(data)
        .expect("base64");
    assert_eq!(
        png,
        std::fs::read(&marked).expect("written"),
        "--annotated shows what was sent"
    );

    let sent = Canvas::from_png(&png).expect("a PNG");
    assert_eq!(sent.size_px(), [320, 240]);
    // Lower edges of the frames: red candidates, green reference, blue context.
    assert_eq!(pixel(&sent, [40, 89]), Colour::RED.0);
    assert_eq!(pixel(&sent, [165, 89]), Colour::GREEN.0);
    assert_eq!(pixel(&sent, [35, 199]), Colour::BLUE.0);
    // The bowl without a box is framed where the camera sees it, left of the middle.
    let red = |x: u32| (0..240).any(|y| pixel(&sent, [x, y]) == Colour::RED.0);
    assert!((100..160).any(red));
    // The numbers stand above the frames.
    let in_tag = (44..60).flat_map(|y| (20..34).map(move |x| [x, y]));
    assert!(
        in_tag
            .into_iter()
            .any(|at| pixel(&sent, at) == Colour::RED.0)
    );
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!said.contains("s3cret"));
}

#[test]
fn a_model_that_obeys_a_label_changes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let [scene, image] = write_scene(folder.path());
    let rules = json_of(&fitmac(&["ground", "--scene", &scene, "--json", SENTENCE]));
    for content in [
        json!({"selected_index": 7, "confidence": 1, "reason": "the label said so"}),
        json!({"selected_index": 0, "confidence": 1, "reason": "", "open_gripper": true}),
    ] {
        let server = server(&content);
        let output = fitmac(&[
            "ground",
            "--scene",
            &scene,
            "--image",
            &image,
            "--json",
            "--model-url",
            server.url(),
            "--model",
            "m",
            SENTENCE,
        ]);
        assert_eq!(json_of(&output), rules, "{content}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains("the rules' answer stands"), "{said}");
    }
}

#[test]
fn a_sure_answer_asks_nobody() {
    let server = server(&json!({}));
    let output = fitmac(&[
        "plan",
        "--json",
        "--model-url",
        server.url(),
        "--model",
        "m",
        "pick up the milk and place it in the basket",
    ]);
    assert_eq!(json_of(&output)["target_object"], "milk");
    assert!(server.asked().is_empty());
}

#[test]
fn a_bad_image_is_named_with_the_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let [scene, _] = write_scene(folder.path());
    let output = fitmac(&["ground", "--scene", &scene, "--image", &scene, SENTENCE]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("--image") && said.contains("PNG"), "{said}");
    assert_eq!(output.status.code(), Some(2));
}

const PAGE: &str = include_str!("../../docs/agents.md");

/// The page's blocks in a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let parts = PAGE.split("```").skip(1).step_by(2);
    parts
        .filter_map(|block| block.strip_prefix(language)?.strip_prefix('\n'))
        .collect()
}

/// The words of a command line as the page writes it: plain and in double quotes.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (index, part) in line.split('"').enumerate() {
        if index % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_ascii_whitespace().map(str::to_owned));
        }
    }
    words
}

/// Every command of the page runs as written, and prints what the page shows.
#[test]
fn the_page_is_true() {
    let json = blocks("json");
    let [plan, scene] = json.as_slice() else {
        panic!("the page shows {} JSON blocks", json.len());
    };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.json"), scene).expect("written");
    let server = server(&json!({"selected_index": 0, "confidence": 0.9, "reason": ""}));
    let mut statuses = Vec::new();
    for line in blocks("sh").into_iter().flat_map(str::lines) {
        let line = line.replace("http://127.0.0.1:8000/v1", server.url());
        let words = words(&line);
        assert_eq!(words[0], "fitmac");
        let output = Command::new(env!("CARGO_BIN_EXE_fitmac"))
            .args(&words[1..])
            .current_dir(folder.path())
            .output()
            .expect("fitmac starts");
        if line.starts_with("fitmac plan --json") {
            assert_eq!(String::from_utf8_lossy(&output.stdout), *plan);
        }
        statuses.push(output.status.code());
    }
    // The last two sentences leave the rules unsure.
    assert_eq!(statuses, [0, 0, 0, 1, 1].map(Some));
    assert_eq!(
        server.asked().len(),
        3,
        "the last is asked to plan and to choose"
    );
}
