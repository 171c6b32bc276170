//! The control thread allocates nothing and asks the system for nothing but
//! its sleep; `cargo xtask quiet` counts over a million ticks.

use std::process::Command;

use serde_json::Value;

fn count(arguments: &[&str]) -> (bool, Value) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_quiet"));
    let output = program
        .arg("--json")
        .args(arguments)
        .output()
        .expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout);
    let json = serde_json::from_str(&text)
        .unwrap_or_else(|e| panic!("{e}: {text}\n{}", String::from_utf8_lossy(&output.stderr)));
    (output.status.success(), json)
}

/// Names of the system calls; none where nothing traces.
fn names(counted: &Value) -> Option<Vec<&str>> {
    let calls = counted["system_calls"].as_object();
    if calls.is_none() {
        println!("system calls were not counted: strace is missing or may not trace");
    }
    calls.map(|calls| calls.keys().map(String::as_str).collect())
}

#[test]
fn the_control_thread_is_quiet() {
    let (quiet, counted) = count(&["--ticks", "9000"]);
    assert!(quiet, "{counted}");
    assert_eq!(counted["allocations"], 0);
    if let Some(names) = names(&counted) {
        assert_eq!(names, ["clock_nanosleep"], "{counted}");
    }
    for flows in ["chunks", "groundings", "rebinds", "corrected_queries"] {
        assert!(counted[flows].as_u64() > Some(0), "no {flows}: {counted}");
    }
}

#[test]
fn an_allocation_is_noticed() {
    let (quiet, counted) = count(&["--ticks", "200", "--plant", "allocation"]);
    assert!(!quiet, "{counted}");
    assert_eq!(counted["allocations"], 2, "one allocation and its release");
}

#[test]
fn a_system_call_is_noticed() {
    let (quiet, counted) = count(&["--ticks", "200", "--plant", "call"]);
    if let Some(names) = names(&counted) {
        assert!(!quiet, "{counted}");
        assert_eq!(names, ["clock_nanosleep", "getppid"], "{counted}");
    }
}
