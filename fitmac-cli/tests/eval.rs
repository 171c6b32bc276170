//! `fitmac eval` as a user calls it: killed, out of disk, given nonsense.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

const SUITE: &str = include_str!("../../sim-harness/assets/suites/object.toml");

/// Eight episodes, on tuning seeds.
const SOME: [&str; 12] = [
    "--suite",
    "object",
    "--task",
    "butter",
    "--perturbation",
    "pos",
    "--config",
    "base,full",
    "--seeds",
    "1000",
    "--episodes",
    "4",
];

fn fitmac(out: &Path, jobs: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fitmac"));
    command.arg("eval").args(SOME).args(["--jobs", jobs]);
    command.arg("--out").arg(out);
    command
}

fn lines(out: &Path) -> String {
    std::fs::read_to_string(out.join("episodes-0-of-1.jsonl")).unwrap_or_default()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The lines of a run that nothing disturbs.
fn unbroken() -> String {
    let folder = tempfile::tempdir().unwrap();
    let done = fitmac(folder.path(), "2").output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    lines(folder.path())
}

#[test]
fn a_killed_evaluation_loses_no_episode_and_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = fitmac(folder.path(), "1")
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while lines(folder.path()).lines().count() < 2 {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = lines(folder.path());
    let whole = &kept[..kept.rfind('\n').unwrap() + 1];
    let count = whole.lines().count();
    assert!((2..8).contains(&count), "{count} of 8 episodes");
    let rest = fitmac(folder.path(), "2").output().unwrap();
    assert_eq!(rest.status.code(), Some(0), "{}", stderr(&rest));
    let said = String::from_utf8_lossy(&rest.stdout).into_owned();
    let expected = format!("{} of 8 episodes run now, {count} found", 8 - count);
    assert!(said.contains(&expected), "{said}");
    let after = lines(folder.path());
    assert!(whole.lines().all(|line| after.contains(line)));
    assert_eq!(after, unbroken());
}

/// A limit on the size of files stands for a disk that is full.
#[test]
fn a_full_disk_is_named_and_finished_episodes_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let plain = fitmac(folder.path(), "2");
    let full = Command::new("sh")
        .args(["-c", r#"trap "" XFSZ; ulimit -f 4; exec "$0" "$@""#])
        .arg(plain.get_program())
        .args(plain.get_args())
        .output()
        .unwrap();
    let message = stderr(&full);
    assert_eq!(full.status.code(), Some(3), "{message}");
    for named in ["episodes-0-of-1.jsonl", "File too large", "make room"] {
        assert!(message.contains(named), "{named}: {message}");
    }
    let kept = lines(folder.path());
    assert!(
        kept.ends_with('\n') && (1..8).contains(&kept.lines().count()),
        "{kept}"
    );
    let rest = fitmac(folder.path(), "2").output().unwrap();
    assert_eq!(rest.status.code(), Some(0), "{}", stderr(&rest));
    let after = lines(folder.path());
    assert!(kept.lines().all(|line| after.contains(line)));
    assert_eq!(after, unbroken());
}

fn with_suite(folder: &Path, text: &str) -> Output {
    let file = folder.join("mine.toml");
    std::fs::write(&file, text).unwrap();
    Command::new(env!("CARGO_BIN_EXE_fitmac"))
        .arg("eval")
        .arg("--suite")
        .arg(file)
        .args(["--config", "base", "--task", "butter"])
        .args(["--seeds", "1000", "--episodes", "1"])
        .arg("--out")
        .arg(folder.join("out"))
        .output()
        .unwrap()
}

#[test]
fn a_malformed_suite_is_named_with_file_field_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, &str, &[&str]); 4] = [
        (
            r#"kind = "milk", region = "target""#,
            r#"kind = "milkshake", region = "target""#,
            &[
                "task `",
                "field `kind`",
                "`milkshake`",
                "known are",
                "butter",
            ],
        ),
        (
            r#"region = "basket""#,
            r#"region = "cellar""#,
            &["field `region`", "`cellar`", "known are", "basket"],
        ),
        (
            "max_steps = 280",
            r#"max_steps = "many""#,
            &["line 13", "max_steps", "expected u32"],
        ),
        (
            r#"relation = "in""#,
            r#"relation = "beside""#,
            &["line ", "beside", "expected `in` or `on`"],
        ),
    ];
    for (from, to, named) in cases {
        assert!(SUITE.contains(from));
        let output = with_suite(folder.path(), &SUITE.replacen(from, to, 1));
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        for part in named.iter().chain(&["mine.toml"]) {
            assert!(message.contains(part), "{part}: {message}");
        }
        assert!(!folder.path().join("out").exists(), "nothing was begun");
    }
    let missing = Command::new(env!("CARGO_BIN_EXE_fitmac"))
        .args(["eval", "--suite", "nowhere.toml", "--out"])
        .arg(folder.path().join("out"))
        .output()
        .unwrap();
    assert_eq!(missing.status.code(), Some(2));
    assert!(stderr(&missing).contains("nowhere.toml"));
}

#[test]
fn a_suite_of_ones_own_is_played_and_a_changed_one_is_not_mixed_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let played = with_suite(folder.path(), SUITE);
    assert_eq!(played.status.code(), Some(0), "{}", stderr(&played));
    assert_eq!(lines(&folder.path().join("out")).lines().count(), 1);
    let changed = with_suite(
        folder.path(),
        &SUITE.replace("max_steps = 280", "max_steps = 200"),
    );
    assert_eq!(changed.status.code(), Some(2));
    assert!(stderr(&changed).contains("--accept-build"));
}
