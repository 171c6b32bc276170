//! `fitmac report` as a user calls it.

use std::path::Path;
use std::process::{Command, Output};

const LINE: &str = r#"{"schema":1,"core":"0.1.0","suite":"object","task_index":0,"task":"milk","perturbation":"pos","level":"standard","backbone":"openvla-like","backbone_hash":"0123456789ab","config":"base","profile":"guarded","perception":"modelled","knowledge":"agents","seed":7,"episode":0,"success":true,"intervened":false,"activations":[],"onset_step":null,"first_failure_step":null,"first_intervention_step":null,"steps":120,"sim_seconds":6.0,"failure":null,"gate_reasons":[],"rebinds":0,"graspable":true,"end_distance_m":0.01,"drawn":""}"#;

fn report(folder: &Path, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fitmac"))
        .arg("report")
        .arg(folder)
        .arg("--out")
        .arg(out)
        .output()
        .unwrap()
}

#[test]
fn a_folder_of_results_becomes_three_files() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report");
    std::fs::write(folder.path().join("a.jsonl"), format!("{LINE}\n")).unwrap();
    let done = report(folder.path(), &out);
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    for name in ["report.html", "report.md", "report.json"] {
        let text = std::fs::read_to_string(out.join(name)).unwrap();
        assert!(text.contains("surrogate"), "{name}");
        assert!(String::from_utf8_lossy(&done.stdout).contains(name));
    }
}

#[test]
fn mistakes_have_their_exit_status() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report");
    let empty = report(folder.path(), &out);
    assert_eq!(empty.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&empty.stderr).contains("fitmac eval"));
    assert!(!out.exists());
    let text = format!("{LINE}\nnonsense\n");
    std::fs::write(folder.path().join("a.jsonl"), text).unwrap();
    let partly = report(folder.path(), &out);
    assert_eq!(partly.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&partly.stderr).contains("a.jsonl:2"));
    assert!(out.join("report.html").exists(), "the rest is kept");
}
