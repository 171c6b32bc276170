//! `cargo xtask coverage`: a test reaches every line of the core, but for those that are listed.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, bail};

use crate::{
    debian,
    lists::{self, Exception},
    process::{self, step},
    tool,
    workspace::{Workspace, not_writable},
};

const NAME: &str = "cargo-llvm-cov";
const VERSION: &str = "0.9.1";
/// The lines that no test need reach, with reasons.
const UNCOVERED: &str = "tests/core/uncovered.toml";
const SOURCE: &str = "fitmac-core/src/";
/// LLVM's tools of the compiler's own version (`rustc -vV`), from Debian 12.
const LLVM: &str = "22";
const PACKAGES: [&str; 2] = ["llvm-22=1:22.1.8-1~deb12u1", "libllvm22=1:22.1.8-1~deb12u1"];

/// Arguments of `coverage`.
#[derive(clap::Args)]
pub(crate) struct Args {}

/// Runs the core's tests with counters; fails on a line that none reaches and that is not listed.
pub(crate) fn run(workspace: &Workspace, _args: &Args) -> anyhow::Result<()> {
    let root = workspace.root();
    let listed = lists::read(root, Path::new(UNCOVERED), "uncovered", Some("function"))?;
    let tools = Tools::find(workspace)?;
    let program = tool::install(workspace, NAME, VERSION)?.join(NAME);
    let out = root.join("out/coverage");
    fs::create_dir_all(&out).map_err(|error| not_writable(&out, &error))?;
    let report = out.join("core.lcov");
    step("The core's tests, with counters");
    let mut command = Command::new(program);
    command
        .args(["llvm-cov", "test", "--locked", "--lcov", "--output-path"])
        .arg(&report)
        .args(["--package=fitmac-core", "--package=fitmac-core-tests"])
        .args(["--lib", "--test=all"])
        .current_dir(root)
        .stdout(process::to_stderr());
    tools.equip(&mut command);
    process::run(&mut command)?;
    let text = fs::read_to_string(&report)
        .with_context(|| format!("{} cannot be read", report.display()))?;
    let files = read(&text, root);
    judge(root, &files, &listed)
}

/// Where LLVM's tools are.
enum Tools {
    /// The compiler's own (`rustup component add llvm-tools`), or named by the environment.
    Ready,
    /// Debian's, unpacked in this folder.
    Debian(PathBuf),
}

impl Tools {
    fn find(workspace: &Workspace) -> anyhow::Result<Self> {
        let named = |name| std::env::var_os(name).is_some();
        if (named("LLVM_COV") && named("LLVM_PROFDATA")) || has_component() {
            return Ok(Self::Ready);
        }
        let version = llvm_of_rustc()?;
        if version != LLVM || !debian::is_here() {
            bail!(
                "llvm-cov and llvm-profdata {version} are missing: run `rustup component add \
                 llvm-tools`, or set LLVM_COV and LLVM_PROFDATA to them"
            );
        }
        let folder = workspace.root().join(format!("third_party/llvm-{LLVM}"));
        debian::unpack(&folder, &PACKAGES, "LLVM's coverage tools, 48 MB")?;
        Ok(Self::Debian(folder))
    }

    fn equip(&self, command: &mut Command) {
        let Self::Debian(folder) = self else {
            return;
        };
        let programs = folder.join(format!("usr/lib/llvm-{LLVM}/bin"));
        command
            .env("LLVM_COV", programs.join("llvm-cov"))
            .env("LLVM_PROFDATA", programs.join("llvm-profdata"))
            .env("LD_LIBRARY_PATH", folder.join("usr/lib/x86_64-linux-gnu"))
            .env("CARGO_LLVM_COV_SETUP", "no");
    }
}

fn has_component() -> bool {
    let mut rustc = Command::new("rustc");
    rustc.arg("--print=target-libdir");
    rustc.output().is_ok_and(|output| {
        let libraries = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        Path::new(&libraries)
            .with_file_name("bin/llvm-cov")
            .exists()
    })
}

fn llvm_of_rustc() -> anyhow::Result<String> {
    let output = Command::new("rustc").arg("-vV").output();
    let output = output.context("the compiler could not be started")?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let version = text
        .lines()
        .find_map(|line| line.strip_prefix("LLVM version: "));
    let major = version.and_then(|version| version.split('.').next());
    major
        .map(str::to_owned)
        .context("`rustc -vV` names no version of LLVM")
}

/// How often each line of each source file was reached, tests left out.
fn read(lcov: &str, root: &Path) -> BTreeMap<String, BTreeMap<usize, u64>> {
    let mut files: BTreeMap<String, BTreeMap<usize, u64>> = BTreeMap::new();
    let mut file = None;
    for line in lcov.lines() {
        if let Some(path) = line.strip_prefix("SF:") {
            let path = Path::new(path)
                .strip_prefix(root)
                .unwrap_or(Path::new(path));
            let path = path.to_string_lossy().into_owned();
            let counts = path.starts_with(SOURCE) && !path.ends_with("/tests.rs");
            file = counts.then_some(path);
        } else if let (Some(file), Some(counter)) = (&file, line.strip_prefix("DA:")) {
            let mut numbers = counter.split(',').map(str::parse::<u64>);
            if let (Some(Ok(line)), Some(Ok(count))) = (numbers.next(), numbers.next())
                && let Ok(line) = usize::try_from(line)
            {
                *files
                    .entry(file.clone())
                    .or_default()
                    .entry(line)
                    .or_default() += count;
            }
        }
    }
    files
}

fn judge(
    root: &Path,
    files: &BTreeMap<String, BTreeMap<usize, u64>>,
    listed: &[Exception],
) -> anyhow::Result<()> {
    let (mut lines, mut reached, mut open) = (0_usize, 0_usize, Vec::new());
    let mut used = vec![false; listed.len()];
    for (file, counters) in files {
        let text = fs::read_to_string(root.join(file)).with_context(|| file.clone())?;
        let text: Vec<&str> = text.lines().collect();
        let tests = text
            .iter()
            .position(|line| line.starts_with("#[cfg(test)]"));
        for (&number, &count) in counters {
            if tests.is_some_and(|tests| number > tests) {
                continue;
            }
            lines += 1;
            if count > 0 {
                reached += 1;
                continue;
            }
            let line = text
                .get(number.saturating_sub(1))
                .copied()
                .unwrap_or_default();
            let function = function(&text, number);
            match listed.iter().position(|e| e.is_about(file, line, function)) {
                Some(n) => used[n] = true,
                None => open.push(format!(
                    "# {file}:{number}\n{}",
                    lists::draft("uncovered", file, line, Some(("function", function)))
                )),
            }
        }
    }
    if lines == 0 {
        bail!("the report holds no line of {SOURCE}");
    }
    println!(
        "cargo xtask coverage: {reached} of {lines} lines of the core are reached ({:.2} %); of {} \
         others {} are listed with a reason",
        reached as f64 / lines as f64 * 100.0,
        lines - reached,
        lines - reached - open.len()
    );
    open.iter().for_each(|draft| println!("{draft}"));
    if !open.is_empty() {
        bail!(
            "{} lines are reached by no test: write one, or the reason into {UNCOVERED}",
            open.len()
        );
    }
    if let Some(n) = used.iter().position(|used| !used) {
        bail!(
            "{UNCOVERED}: `{}` in {} is reached: remove the entry",
            listed[n].line,
            listed[n].file
        );
    }
    Ok(())
}

/// The name of the function that a line stands in.
fn function<'a>(text: &[&'a str], number: usize) -> &'a str {
    let above = text.iter().take(number).rev();
    let name = above.filter_map(|line| {
        let (before, after) = line.split_once("fn ")?;
        let starts = before
            .chars()
            .all(|c| c.is_alphanumeric() || " ()_".contains(c));
        let name = after.split(['(', '<']).next()?;
        (starts && !name.is_empty()).then_some(name)
    });
    name.into_iter().next().unwrap_or("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_sound() {
        let workspace = Workspace::at(None);
        let list = Path::new(UNCOVERED);
        if let Err(error) = lists::read(workspace.root(), list, "uncovered", Some("function")) {
            panic!("{error:#}");
        }
    }

    #[test]
    fn counts_of_lines_are_read_and_summed() {
        let lcov = "SF:/r/fitmac-core/src/a.rs\nDA:3,0\nDA:3,2\nDA:4,0\nend_of_record\n\
                    SF:/r/tests/core/src/b.rs\nDA:1,0\n";
        let files = read(lcov, Path::new("/r"));
        assert_eq!(files.len(), 1);
        let counts: Vec<_> = files["fitmac-core/src/a.rs"].iter().collect();
        assert_eq!(counts, [(&3, &2), (&4, &0)]);
    }

    #[test]
    fn a_line_belongs_to_the_function_above_it() {
        let text = [
            "impl A {",
            "    pub(crate) const fn b<T>(t: T) {",
            "        t",
            "    }",
        ];
        assert_eq!(function(&text, 3), "b");
        assert_eq!(function(&text, 1), "-");
    }
}
