//! The border to C under AddressSanitizer: host and library instrumented.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// Runs a command to its end and returns what it prints.
fn output(command: &mut Command) -> String {
    let shown = format!("{command:?}");
    let output = command.output().unwrap_or_else(|e| panic!("{shown}: {e}"));
    let (out, err) = (output.stdout, output.stderr);
    let (out, err) = (String::from_utf8_lossy(&out), String::from_utf8_lossy(&err));
    assert!(
        output.status.success(),
        "{shown}: {}\n{out}\n{err}",
        output.status
    );
    out.into_owned()
}

fn scratch() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

/// The static library with AddressSanitizer. The switch is unstable in rustc,
/// so this one build is told to allow unstable ones.
fn instrumented_library() -> PathBuf {
    let target = "x86_64-unknown-linux-gnu";
    let folder = scratch().join("asan");
    output(
        Command::new(env!("CARGO"))
            .args([
                "build",
                "--locked",
                "--package=fitmac-capi",
                "--lib",
                "--target",
                target,
            ])
            .arg("--target-dir")
            .arg(&folder)
            .env("RUSTC_BOOTSTRAP", "1")
            .env("RUSTFLAGS", "-Zsanitizer=address")
            .current_dir(env!("CARGO_MANIFEST_DIR")),
    );
    folder.join(target).join("debug/libfitmac_capi.a")
}

fn compile(source: &str, program: &Path, library: &Path) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    output(
        Command::new("gcc")
            .args([
                "-std=c11",
                "-Wall",
                "-Wextra",
                "-Wpedantic",
                "-Werror",
                "-O1",
                "-g",
            ])
            .args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all"])
            .arg("-I")
            .arg(root.join("include"))
            .arg(root.join("tests/c").join(source))
            .arg("-o")
            .arg(program)
            .arg(library)
            .args(["-lgcc_s", "-lpthread", "-lm", "-ldl"]),
    );
}

#[test]
#[cfg(target_arch = "x86_64")]
fn fault_rows_of_the_border_hold_under_address_sanitizer() {
    let library = instrumented_library();
    let program = scratch().join("border");
    compile("border.c", &program, &library);
    let said = output(Command::new(&program).env("ASAN_OPTIONS", "detect_leaks=1"));
    let rows: Vec<&str> = said
        .lines()
        .map(|l| l.split(':').next().unwrap_or(l))
        .collect();
    let expected = [
        "E8 arguments",
        "E8 any bytes",
        "E8 snapshots",
        "E9 threads",
        "E10 floating point",
        "E11 fork",
        "names",
    ];
    assert_eq!(rows, expected, "{said}");

    // The meter fires: a library that is handed too little memory reads and
    // writes beyond it, in Rust, and is caught there.
    let program = scratch().join("overrun");
    compile("overrun.c", &program, &library);
    let caught = Command::new(&program).output().expect("it starts");
    let said = String::from_utf8_lossy(&caught.stderr);
    assert!(!caught.status.success(), "an overrun goes unnoticed");
    assert!(
        said.contains("heap-buffer-overflow") && said.contains("fitmac"),
        "{said}"
    );
}
