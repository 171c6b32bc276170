//! Instructions of single ticks: the harness `benches/ticks` under Valgrind's callgrind, which
//! begins a new part of its report with every tick.

use std::{
    collections::{BTreeMap, HashMap},
    fs::{self, File},
    io::{BufRead, BufReader},
    path::PathBuf,
    process::{Command, Stdio},
};

use anyhow::{Context, bail, ensure};

use crate::{callgrind, peers};

const TICK: &str = "fitmac_core::controller::Controller::tick";
const MOTION: &str = "kinematics::otg::Otg";
/// A repeated string instruction counts once an item: with these the C library copies in loops,
/// and the count is the same on every processor.
const COPY_IN_LOOPS: &str = "glibc.cpu.x86_rep_movsb_threshold=1000000000:\
                             glibc.cpu.x86_rep_stosb_threshold=1000000000";

/// Instructions of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Without the motion generator.
    pub decision: u64,
    /// The motion generator alone.
    pub motion: u64,
}

/// Which ticks to count.
#[derive(Clone, Copy, Debug)]
pub enum Ticks {
    /// Those that the baseline tells of.
    Known,
    /// So many of each of the swarm's first seeds.
    Search {
        /// Seeds.
        seeds: u64,
        /// Ticks of each.
        ticks: usize,
    },
}

/// The costs of all ticks by their kind. `None` without Valgrind.
///
/// # Errors
/// Where the harness does not build or Valgrind fails.
pub fn count(ticks: Ticks) -> anyhow::Result<Option<BTreeMap<String, Vec<Cost>>>> {
    if !callgrind::installed() {
        return Ok(None);
    }
    let program = program()?;
    let report = peers::folder().with_file_name(format!("ticks-{}.callgrind", std::process::id()));
    let counted = run(&program, ticks, &report);
    // Hundreds of megabytes after a search.
    let removed = fs::remove_file(&report);
    let kinds = counted?;
    removed.context("the report of callgrind cannot be removed")?;
    Ok(Some(kinds))
}

/// Builds the harness.
///
/// # Errors
/// Where it does not build.
pub fn program() -> anyhow::Result<PathBuf> {
    let target = peers::folder().with_file_name("ticks");
    let harness = concat!(env!("CARGO_MANIFEST_DIR"), "/ticks");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // The harness is a workspace of its own, with its own profile.
    cargo.args(["build", "--release", "--locked", "--quiet", "--target-dir"]);
    cargo.arg(&target).current_dir(harness);
    cargo.env_remove("RUSTFLAGS");
    let status = cargo.status().context("cargo could not be started")?;
    ensure!(status.success(), "benches/ticks does not build (see above)");
    Ok(target.join("release/ticks"))
}

fn run(
    program: &PathBuf,
    ticks: Ticks,
    report: &PathBuf,
) -> anyhow::Result<BTreeMap<String, Vec<Cost>>> {
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--tool=callgrind", "--combine-dumps=yes", "--dump-line=no"]);
    valgrind.arg(format!("--toggle-collect={TICK}"));
    valgrind.arg(format!("--dump-before={TICK}"));
    let mut out = std::ffi::OsString::from("--callgrind-out-file=");
    out.push(report);
    valgrind.arg(out).arg(program).arg("count");
    if let Ticks::Search { seeds, ticks } = ticks {
        valgrind.args([seeds.to_string(), ticks.to_string()]);
    }
    valgrind.env("GLIBC_TUNABLES", COPY_IN_LOOPS);
    let output = valgrind.stdin(Stdio::null()).output();
    let output = output.context("valgrind could not be started")?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("valgrind failed:\n{said}");
    }
    let costs = read(BufReader::new(File::open(report)?))?;
    let kinds = String::from_utf8_lossy(&output.stdout);
    let kinds: Vec<&str> = kinds.lines().collect();
    ensure!(
        costs.len() == kinds.len(),
        "callgrind saw {} ticks of {}: was the tick inlined?",
        costs.len(),
        kinds.len()
    );
    let mut by_kind: BTreeMap<String, Vec<Cost>> = BTreeMap::new();
    for (kind, cost) in kinds.into_iter().zip(costs) {
        by_kind.entry(kind.to_owned()).or_default().push(cost);
    }
    Ok(by_kind)
}

/// The cost of every part of a report but the first, which ends where the first tick begins.
fn read(report: impl BufRead) -> anyhow::Result<Vec<Cost>> {
    let mut names: HashMap<String, String> = HashMap::new();
    let (mut parts, mut total, mut motion) = (0_u64, 0, 0);
    let mut costs = Vec::new();
    let (mut into_motion, mut after_calls) = (false, false);
    for line in report.lines() {
        let line = line.context("the report of callgrind cannot be read")?;
        if line.starts_with("part:") {
            parts += 1;
            motion = 0;
        } else if let Some(function) = line.strip_prefix("fn=") {
            name(&mut names, function);
        } else if let Some(function) = line.strip_prefix("cfn=") {
            into_motion = name(&mut names, function).starts_with(MOTION);
        } else if line.starts_with("calls=") {
            after_calls = true;
        } else if std::mem::take(&mut after_calls) {
            // The line after `calls=` has the cost of what was called, all in all.
            if into_motion {
                motion += last_number(&line)?;
            }
        } else if line.starts_with("totals:") {
            total = last_number(&line)?;
            if parts > 1 {
                let decision = total.saturating_sub(motion);
                costs.push(Cost { decision, motion });
            }
        }
    }
    let _ = total;
    Ok(costs)
}

/// `(12) name` tells a number's name once, `(12)` uses it.
fn name<'a>(names: &'a mut HashMap<String, String>, text: &str) -> &'a str {
    let (number, name) = text.split_once(' ').unwrap_or((text, ""));
    if !name.is_empty() {
        names.insert(number.to_owned(), name.to_owned());
    }
    names.get(number).map_or("", String::as_str)
}

fn last_number(line: &str) -> anyhow::Result<u64> {
    let last = line.split_whitespace().last().unwrap_or_default();
    last.parse()
        .with_context(|| format!("callgrind's line {line:?} has no number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motion_generator_is_taken_out_of_each_tick() -> anyhow::Result<()> {
        let report = "part: 1\nfn=(1) main\n0 7\ntotals: 7\n\
                      part: 2\nfn=(2) tick\n0 30\ncfn=(3) kinematics::otg::Otg<_>::update\n\
                      calls=2 0\n0 11\ncfn=(4) other\ncalls=1 0\n0 5\ntotals: 46\n\
                      part: 3\nfn=(2)\n0 30\ncfn=(3)\ncalls=1 0\n0 10\ntotals: 40\n";
        let costs = read(report.as_bytes())?;
        let expected = [(35, 11), (30, 10)].map(|(decision, motion)| Cost { decision, motion });
        assert_eq!(costs, expected);
        Ok(())
    }
}
