//! Instruction counts: the benchmark starts itself again under Valgrind's callgrind, once with a
//! batch and once with three; the difference is two batches without the set-up.

use std::ffi::OsStr;
use std::process::{Command, Stdio};

use anyhow::{Context, bail};

/// The hidden option that makes a benchmark run one contestant's batch a number of times.
pub const OPTION: &str = "--batches";

/// Whether Valgrind is installed.
#[must_use]
pub fn installed() -> bool {
    let mut valgrind = Command::new("valgrind");
    valgrind.arg("--version");
    valgrind.stdout(Stdio::null()).stderr(Stdio::null());
    valgrind.status().is_ok_and(|status| status.success())
}

/// Instructions a call of `contestant`, whose batch has `calls` calls. This program is started as
/// `program OPTION contestant batches`.
///
/// # Errors
/// Where Valgrind or the program fails, with what it said.
pub fn count(contestant: &str, calls: usize) -> anyhow::Result<f64> {
    let few = collected(contestant, 1)?;
    let many = collected(contestant, 3)?;
    Ok(many.saturating_sub(few) as f64 / (2 * calls) as f64)
}

fn collected(contestant: &str, batches: usize) -> anyhow::Result<u64> {
    let program = std::env::current_exe().context("the benchmark's own program is not known")?;
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    valgrind.arg(program);
    valgrind.args([OPTION, contestant, &batches.to_string()]);
    let output = valgrind.env::<_, &OsStr>("LC_ALL", "C".as_ref()).output();
    let output = output.context("valgrind could not be started")?;
    let said = String::from_utf8_lossy(&output.stderr);
    let collected = said
        .lines()
        .find_map(|line| line.split_once("Collected :"))
        .and_then(|(_, count)| count.trim().parse().ok());
    match collected {
        Some(count) if output.status.success() => Ok(count),
        _ => bail!("valgrind did not count the instructions of {contestant}:\n{said}"),
    }
}
