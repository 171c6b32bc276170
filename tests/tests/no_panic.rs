//! No panic can be reached in `kinematics` nor in the tick of `fitmac-core`, and neither allocates:
//! see `tests/no_panic`.

use std::path::Path;
use std::process::Command;

use fitmac_tests::oracle::workspace_root;

/// Builds the library and links the program; gives the linker's complaints where it fails.
fn link(control: bool) -> Result<(), String> {
    let harness = workspace_root().join("tests/no_panic");
    let name = if control { "control" } else { "entries" };
    let target = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("no_panic")
        .join(name);
    let mut build = Command::new(env!("CARGO"));
    build
        .args(["build", "--quiet", "--release", "--locked"])
        .arg("--target-dir")
        .arg(&target);
    if control {
        build.args(["--features", "control"]);
    }
    // The harness is a workspace of its own, with its own profile.
    let built = build
        .current_dir(&harness)
        .env_remove("RUSTFLAGS")
        .output()
        .expect("cargo runs");
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    let mut link = Command::new("cc");
    if control {
        link.arg("-DCONTROL");
    }
    let linked = link
        .args(["-O1", "-ffunction-sections", "-Wl,--gc-sections", "-o"])
        .arg(target.join("program"))
        .arg(harness.join("main.c"))
        .arg(target.join("release/libno_panic.a"))
        .output()
        .expect("a C compiler is installed as `cc`, as Rust needs one to link");
    if linked.status.success() {
        Ok(())
    } else {
        Err(String::from_utf8_lossy(&linked.stderr).into_owned())
    }
}

#[test]
fn no_panic_can_be_reached() {
    if let Err(complaint) = link(false) {
        panic!("a panic can be reached, or something else is undefined:\n{complaint}");
    }
}

/// The same check on an entry that can panic has to fail, or it would prove nothing.
#[test]
fn the_check_notices_a_panic() {
    let complaint = link(true).expect_err("an index out of range goes unnoticed");
    assert!(complaint.contains("a_panic_can_be_reached"), "{complaint}");
}
