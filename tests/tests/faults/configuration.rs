//! F. Configuration, and text that cannot be trusted.

use std::fs;

use fitmac_tests::{
    cell::{AgentsState, Cell, PolicyState, RobotState},
    fitmac::Place,
};

use crate::now_ns;

/// The controller does not start with this file, and says why.
fn refused(text: &str, says: &[&str]) {
    let cell = Cell::empty();
    fs::write(cell.folder().join("robot.toml"), text).expect("writes");
    let ended = cell.start_under(&[], &["--config", "robot.toml"]).finish();
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    for word in says {
        assert!(ended.stderr.contains(word), "{word}: {}", ended.stderr);
    }
    cell.assert_nothing_is_left();
}

#[test]
fn f1_an_unknown_key_is_refused_by_name() {
    refused(
        "[gate]\nfailure_streek = 2\n",
        &["robot.toml", "failure_streek"],
    );
}

#[test]
fn f1_a_wrong_type_is_refused_by_name() {
    refused(
        "[gate]\nfailure_streak = \"two\"\n",
        &["robot.toml", "failure_streak"],
    );
}

#[test]
fn f2_every_value_out_of_range_is_named_at_once() {
    refused(
        "[gate]\nfailure_streak = 0\nconfidence = nan\n[lock]\nkappa_min = nan\n",
        &["gate.failure_streak", "gate.confidence", "lock.kappa_min"],
    );
}

#[test]
fn f3_a_file_that_is_too_large_is_refused() {
    refused(&"# nothing\n".repeat(10_000), &["robot.toml"]);
}

#[test]
fn f3_a_file_that_is_nested_too_deeply_is_refused() {
    refused(&format!("a = {}", "[".repeat(20_000)), &["robot.toml"]);
}

#[test]
fn f7_a_label_with_control_characters_is_refused() {
    let place = Place::beside_others();
    let scene = r#"{"objects": [{"id": 1, "label": "bowl\u001b[2J",
        "confidence": 0.9, "position_m": [0.5, 0.0, 0.05], "size_m": [0.1, 0.1, 0.05]}]}"#;
    fs::write(place.folder().join("scene.json"), scene).expect("writes");
    let said = place
        .start(&["ground", "--scene", "scene.json", "the bowl"])
        .finish();
    assert_eq!(said.status.code(), Some(2), "{}", said.stderr);
    assert!(said.stderr.contains("label"), "{}", said.stderr);
    assert!(!said.stderr.contains('\u{1b}') && !said.stdout.contains('\u{1b}'));
}

#[test]
fn f10_a_file_that_changes_in_mid_run_changes_nothing() {
    let mut cell = Cell::empty();
    cell.add_robot(RobotState::default());
    cell.add_policy(PolicyState::moving());
    cell.add_agents(AgentsState::default());
    let file = cell.folder().join("robot.toml");
    fs::write(&file, "[gate]\nfailure_streak = 9\n").expect("writes");
    cell.start(&["--config", "robot.toml", "--trace", "run.mcap"]);
    fs::write(&file, "[gate]\nfailure_streak = 0\nnonsense").expect("writes");
    let since = now_ns();
    let first = cell.wait("a command", since, |_| true).command.sequence;
    cell.wait("a thousand more", since, |h| {
        h.command.sequence > first + 1000
    });
    let ended = cell.end_rt();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    // The trace says with which parameters it ran, and they give every answer again.
    let replay = cell.another(&["replay", "run.mcap"]).finish();
    assert_eq!(replay.status.code(), Some(0), "{}", replay.stdout);
    let other = ["replay", "run.mcap", "--what-if", "gate.failure_streak=9"];
    let same = cell.another(&other).finish();
    assert_eq!(same.status.code(), Some(0), "{}", same.stdout);
    cell.assert_nothing_is_left();
}
