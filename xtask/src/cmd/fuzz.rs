//! `cargo xtask fuzz`: raw bytes as input for the core.
//!
//! The target is a program of its own (`tests/fuzz`), built by the pinned
//! compiler with libFuzzer and the coverage counters that it needs; nothing
//! has to be installed but a C++ compiler. `cargo fuzz run tick` on a nightly
//! compiler runs the same target.

use std::{fs, path::PathBuf, process::Command};

use anyhow::{Context, bail};

use crate::{
    process,
    workspace::{Workspace, not_writable},
};

/// What cargo-fuzz passes to the compiler, but for the sanitizer of memory:
/// the core has no unsafe code.
const FLAGS: &str = "-Cpasses=sancov-module \
    -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
    -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares \
    -Cllvm-args=-simplifycfg-branch-fold-threshold=0 \
    -Ccodegen-units=1 --cfg fuzzing";
const TRIPLE: &str = "x86_64-unknown-linux-gnu";
const MAX_LEN: &str = "-max_len=2048";

/// Arguments of `fuzz`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// How long to look for inputs that break an invariant.
    #[arg(long, default_value_t = 1.0, value_name = "N")]
    minutes: f64,
    /// Afterwards, add to the repository's corpus the inputs that reach code which none there
    /// does.
    #[arg(long)]
    keep: bool,
    /// Run this input only: a finding, or a file of the corpus.
    #[arg(value_name = "FILE")]
    input: Option<PathBuf>,
}

/// Builds the target and runs it.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    if !(args.minutes.is_finite() && args.minutes > 0.0) {
        bail!("--minutes is {}: it must be above 0", args.minutes);
    }
    let target = workspace.root().join("target/fuzz");
    process::step("Building the fuzz target");
    let mut build = process::cargo(workspace);
    build
        .current_dir(workspace.root().join("tests/fuzz"))
        .env("RUSTFLAGS", FLAGS)
        .args(["build", "--release", "--locked", "--target", TRIPLE])
        .arg("--target-dir")
        .arg(&target);
    process::run(&mut build)?;
    let program = target.join(TRIPLE).join("release/tick");
    if let Some(input) = &args.input {
        return process::become_command(Command::new(program).arg(input));
    }
    let kept = workspace.root().join("tests/fuzz/corpus/tick");
    let out = workspace.root().join("out/fuzz");
    let (found, findings) = (out.join("corpus"), out.join("findings"));
    for folder in [&kept, &found, &findings] {
        fs::create_dir_all(folder).map_err(|error| not_writable(folder, &error))?;
    }
    let seconds = (args.minutes * 60.0).ceil();
    process::step(&format!("Fuzzing for {seconds} s"));
    let mut fuzz = Command::new(&program);
    fuzz.args([&found, &kept])
        .arg(format!("-max_total_time={seconds}"))
        .arg(format!("-artifact_prefix={}/", findings.display()))
        // By the clock: on a busy machine a process may stand still for minutes.
        .args([MAX_LEN, "-timeout=600", "-print_final_stats=1"]);
    process::run(&mut fuzz).with_context(|| {
        format!(
            "a finding: `cargo xtask fuzz FILE` shows it again; the files are in {}",
            findings.display()
        )
    })?;
    if args.keep {
        process::step("Adding what is new to the corpus");
        let mut merge = Command::new(&program);
        // By edges alone: with counters the corpus would have thousands of files.
        merge
            .args(["-set_cover_merge=1", "-use_counters=0", MAX_LEN])
            .args([&kept, &found]);
        process::run(&mut merge)?;
    }
    println!("cargo xtask fuzz: {seconds} s without a finding");
    Ok(())
}
