//! Runs the Python oracles.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

pub use fitmac_core_tests::workspace_root;

/// The Python of the virtual environment that holds the oracles.
///
/// # Panics
/// With the remedy, where there is none.
#[must_use]
pub fn python() -> PathBuf {
    let venv = std::env::var_os("FITMAC_VENV")
        .map_or_else(|| workspace_root().join(".venv"), PathBuf::from);
    let python = venv.join("bin/python");
    assert!(
        python.exists(),
        "no Python with the oracles at {}: run `cargo xtask test`, which installs \
         tests/oracles/requirements.txt there, or point FITMAC_VENV at such an environment",
        python.display()
    );
    python
}

/// Runs `tests/oracles/<script>` with arguments and standard input, and returns its standard
/// output.
///
/// # Panics
/// Where the script cannot be run or fails.
#[must_use]
pub fn run(script: &str, arguments: &[&str], input: &[u8]) -> Vec<u8> {
    let path = workspace_root().join("tests/oracles").join(script);
    let mut child = Command::new(python())
        .arg(&path)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("cannot run {}: {e}", path.display()));
    let mut stdin = child.stdin.take().expect("standard input is piped");
    let input = input.to_vec();
    // Both pipes are finite: write from a thread while the output is read.
    let writer = std::thread::spawn(move || stdin.write_all(&input));
    let output = child
        .wait_with_output()
        .expect("the oracle runs to its end");
    writer
        .join()
        .expect("the writer does not panic")
        .expect("the oracle reads its input");
    assert!(
        output.status.success(),
        "{script} failed: {}",
        output.status
    );
    output.stdout
}

/// The 64-bit floats of a binary answer.
#[must_use]
pub fn floats(bytes: &[u8]) -> Vec<f64> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|chunk| f64::from_le_bytes(*chunk))
        .collect()
}
