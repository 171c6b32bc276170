//! The demo end to end, as a user starts it: real processes, real time.

use std::path::Path;

use fitmac_tests::fitmac::{Finished, Place};
use serde_json::Value;

/// The demo of one seed; seeds are told apart by the tests that run them.
fn demo(seed: &str) -> (Place, Finished) {
    let place = Place::new();
    let run = place.start(&["demo", "--seed", seed, "--out", "out", "--json"]);
    let finished = run.finish();
    (place, finished)
}

#[test]
fn the_policy_alone_fails_and_fit_mac_saves_it() {
    let (
        place,
        Finished {
            status,
            stdout,
            stderr,
        },
    ) = demo("1");
    assert_eq!(status.code(), Some(0), "{stdout}\n{stderr}");
    let summary: Value = serde_json::from_str(&stdout).expect("nothing but JSON");
    assert_eq!(summary["as_it_should_be"], true);
    let (alone, with) = (&summary["policy_alone"], &summary["fit_mac"]);
    assert_eq!(alone["outcome"]["success"], false);
    assert_eq!(
        alone["outcome"]["replaced_steps"], 0,
        "nothing may be replaced"
    );
    assert_eq!(alone["interventions"]["corrected_queries"], 0);
    assert_eq!(with["outcome"]["success"], true);
    assert!(with["interventions"]["execution_corrections"].as_u64() >= Some(1));
    assert_eq!(
        with["outcome"]["lifted"], summary["task"],
        "the named thing was lifted"
    );
    for run in [alone, with] {
        assert!(run["cadence"]["ticks"].as_u64() > Some(1000), "{run}");
        assert!(run["cadence"]["max_us"].as_f64() >= run["cadence"]["p50_us"].as_f64());
        assert!(
            run["timeline"]
                .as_array()
                .is_some_and(|rows| rows.len() > 1)
        );
        assert_files_are_there(place.folder(), &run["files"]);
    }
    assert_eq!(place.instance_files(), Vec::<std::path::PathBuf>::new());
}

fn assert_files_are_there(folder: &Path, files: &Value) {
    let pictures = files["pictures"].as_array().expect("a list");
    assert_eq!(pictures.len(), 2);
    for file in pictures.iter().chain([&files["trace"]]) {
        let path = folder.join(file.as_str().expect("a name"));
        let size = std::fs::metadata(&path).map_or(0, |meta| meta.len());
        assert!(size > 1000, "{} has {size} bytes", path.display());
    }
    for picture in pictures {
        let path = folder.join(picture.as_str().expect("a name"));
        let start = std::fs::read(path).expect("it is there");
        assert!(start.starts_with(b"\x89PNG\r\n\x1a\n"));
    }
}
