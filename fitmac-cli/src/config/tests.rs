use std::{fs, path::Path};

use super::*;
use crate::exit::{Exit, status_of};

fn load(text: &str, settings: &[&str]) -> anyhow::Result<Params> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cell.toml");
    fs::write(&path, text).unwrap();
    load_file(&path, settings)
}

fn load_file(path: &Path, settings: &[&str]) -> anyhow::Result<Params> {
    let args = Args {
        config: Some(path.to_owned()),
        settings: settings.iter().map(|&setting| setting.to_owned()).collect(),
        ..Args::default()
    };
    Ok(*args.load()?.get())
}

/// The error for a file or settings, which must be one of wrong usage.
fn refusal(text: &str, settings: &[&str]) -> String {
    let error = load(text, settings).unwrap_err();
    assert_eq!(status_of(&error), Exit::Usage, "{error:#}");
    format!("{error:#}")
}

fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{text:?} does not say {part:?}");
    }
}

#[test]
fn without_a_file_the_guarded_profile_holds() {
    assert_eq!(*Args::default().load().unwrap().get(), Params::guarded());
}

#[test]
fn a_file_changes_what_it_names_and_nothing_else() {
    let found = load("[gate]\nfailure_streak = 4\n", &[]).unwrap();
    let mut expected = Params::guarded();
    expected.gate.failure_streak = 4;
    assert_eq!(found, expected);
}

#[test]
fn the_file_names_its_profile_and_changes_that() {
    let found = load("profile = \"paper\"\n[gate]\nfailure_streak = 4\n", &[]).unwrap();
    let mut expected = Params::paper();
    expected.gate.failure_streak = 4;
    assert_ne!(Params::paper(), Params::guarded());
    assert_eq!(found, expected);
}

#[test]
fn every_parameter_survives_the_way_through_a_file() {
    for params in [Params::guarded(), Params::paper()] {
        let text = toml::to_string(&params).unwrap();
        assert_eq!(load(&text, &[]).unwrap(), params);
    }
}

#[test]
fn a_setting_wins_over_the_file() {
    let settings = [
        "gate.failure_streak=2",
        "switches.hard_pick = false",
        "progress.target_m=1e-2",
    ];
    let found = load("[gate]\nfailure_streak = 4\n", &settings[..2]).unwrap();
    assert_eq!(found.gate.failure_streak, 2);
    assert!(!found.switches.hard_pick);
}

#[test]
fn an_unknown_key_is_refused_with_its_place() {
    let text = refusal("[gate]\nfailure_streek = 4\n", &[]);
    assert_says(
        &text,
        &["cell.toml", "line 2", "failure_streek", "failure_streak"],
    );
    assert_says(&refusal("[gait]\nx = 4\n", &[]), &["line 1", "gait"]);
    let text = refusal("", &["gate.failure_streek=4"]);
    assert_says(
        &text,
        &[
            "--set gate.failure_streek=4",
            "no key `failure_streek`",
            "failure_streak",
        ],
    );
    assert_says(&refusal("", &["gait.x=4"]), &["no table `gait`", "gate"]);
}

#[test]
fn a_wrong_type_is_refused_with_its_place() {
    assert_says(
        &refusal("[gate]\nfailure_streak = \"four\"\n", &[]),
        &["line 2", "u32"],
    );
    assert_says(
        &refusal("", &["gate.failure_streak=four"]),
        &["--set", "u32"],
    );
    assert_says(
        &refusal("profile = \"bold\"\n", &[]),
        &["bold", "guarded", "paper"],
    );
    assert_says(&refusal("", &["failure_streak"]), &["write KEY=VALUE"]);
}

#[test]
fn every_value_out_of_range_is_named_at_once() {
    let text = refusal("[gate]\nfailure_streak = 0\nconfidence = nan\n", &[]);
    assert_says(
        &text,
        &[
            "gate.failure_streak is 0",
            "gate.confidence is NaN",
            "allowed is",
        ],
    );
}

#[test]
fn a_file_that_cannot_be_a_configuration_is_refused() {
    let large = "# filler\n".repeat(8192);
    assert_says(&refusal(&large, &[]), &["larger than 64 KiB"]);
    assert_says(&refusal("[gate", &[]), &["cell.toml", "line 1"]);
    let missing = load_file(Path::new("/nowhere/cell.toml"), &[]).unwrap_err();
    assert_says(
        &format!("{missing:#}"),
        &["/nowhere/cell.toml cannot be opened"],
    );
}

#[test]
fn backbone_only_switches_every_correction_off() {
    let args = Args {
        backbone_only: true,
        ..Args::default()
    };
    assert!(args.load().unwrap().get().switches.none());
}
