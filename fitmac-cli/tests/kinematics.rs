//! `fitmac fk`, `ik` and `otg` as a user calls them.

use std::io::Write;
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};

fn fitmac(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_fitmac"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("fitmac starts");
    // It may end before it has read everything: on a bad argument.
    let _ = child
        .stdin
        .take()
        .expect("piped")
        .write_all(input.as_bytes());
    child.wait_with_output().expect("fitmac ends")
}

fn replies(arguments: &[&str], input: &str) -> Vec<Value> {
    let output = fitmac(arguments, input);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("an array")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

const URDF: &str = r#"<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="f" type="fixed"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/></joint></robot>"#;

#[test]
fn fk_answers_each_line_of_the_users_arm() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("arm.urdf");
    std::fs::write(&path, URDF).expect("written");
    let path = path.to_str().expect("UTF-8");
    let arguments = ["fk", "--urdf", path, "--base", "a", "--tip", "c"];
    let answers = replies(
        &arguments,
        "{\"q\": [0]}\n\n{\"q\": [1.5707963267948966]}\n",
    );
    assert_eq!(answers.len(), 2);
    assert_eq!(answers[0]["position"], json!([1.0, 0.0, 0.0]));
    assert_eq!(answers[0]["jacobian"].as_array().map(Vec::len), Some(6));
    assert_eq!(answers[0]["jacobian"][1], json!([1.0]));
    let quarter = numbers(&answers[1]["rotation"]);
    let expected = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    assert!(
        quarter
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-15),
        "{quarter:?}"
    );
}

#[test]
fn ik_finds_what_fk_says() {
    let q = "{\"q\": [0.3, -0.4, 0.2, -1.9, 0.1, 1.7, 0.5]}";
    let tip = &replies(&["fk"], q)[0];
    let target = json!({"position": tip["position"], "rotation": tip["rotation"]}).to_string();
    let answer = &replies(&["ik"], &target)[0];
    assert_eq!(answer["status"], "reached");
    let again = &replies(&["fk"], &json!({"q": answer["q"]}).to_string())[0];
    let (a, b) = (numbers(&again["position"]), numbers(&tip["position"]));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-6));
    let far = "{\"position\": [9, 0, 0], \"quaternion\": [1, 0, 0, 0]}";
    assert_eq!(replies(&["ik"], far), [json!({"status": "out_of_reach"})]);
}

#[test]
fn otg_gives_duration_and_samples() {
    let motion = json!({
        "current": {"position": [0.0, 1.0]},
        "target": {"position": [1.0, 0.5]},
        "limits": {"velocity": [1.0, 1.0], "acceleration": [2.0, 2.0], "jerk": [10.0, 10.0]},
    });
    let answer = &replies(&["otg", "--step", "0.01"], &motion.to_string())[0];
    let duration = answer["duration"].as_f64().expect("a number");
    assert!((duration - (1.0 + 0.5 + 0.2)).abs() < 1e-12, "{duration}");
    assert_eq!(answer["synchronised"], true);
    let samples = answer["samples"].as_array().expect("samples");
    assert!((171..=172).contains(&samples.len()), "{}", samples.len());
    let last = samples.last().expect("one");
    assert_eq!(last["position"], json!([1.0, 0.5]));
    assert_eq!(last["velocity"], json!([0.0, 0.0]));
}

#[test]
fn bad_input_names_the_line_and_the_field() {
    let says = |arguments: &[&str], input: &str, part: &str| {
        let output = fitmac(arguments, input);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(part), "{error}");
    };
    let good = "{\"q\": [0, 0, 0, 0, 0, 0, 0]}\n";
    says(
        &["fk"],
        &format!("{good}{{\"q\": [1]}}"),
        "line 2: q: 1 numbers, but the arm has 7",
    );
    says(&["fk"], "{\"p\": [1]}", "line 1: unknown field `p`");
    says(&["fk"], "{\"q\": [1e9, 0, 0, 0, 0, 0, 0]}", "joint 0");
    says(
        &["fk", "--urdf", "no.urdf", "--base", "a", "--tip", "b"],
        "",
        "cannot read no.urdf",
    );
    says(
        &["ik"],
        "{\"position\": [0, 0, 1]}",
        "either \"rotation\" or \"quaternion\"",
    );
    let motion = "{\"current\": {\"position\": [0]}, \"target\": {\"position\": [1]}, \
                  \"limits\": {\"velocity\": [0], \"acceleration\": [1], \"jerk\": [1]}}";
    says(&["otg"], motion, "axis 0: the velocity limit");
    says(&["otg", "--step", "0"], motion, "--step");
}
