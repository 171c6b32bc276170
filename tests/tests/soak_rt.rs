//! One controller while robots, policies and agents come and go: nothing grows,
//! nothing is lost that is not counted. `cargo xtask soak-rt` goes on for half
//! an hour.

use std::process::Command;

#[test]
fn nothing_grows_from_demo_to_demo() {
    let output = Command::new(env!("CARGO_BIN_EXE_soak_rt"))
        .args(["--seconds", "15", "--demo-seconds", "1"])
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}\n{stderr}");
    assert!(said.contains("every tick is recorded or counted"), "{said}");
}
