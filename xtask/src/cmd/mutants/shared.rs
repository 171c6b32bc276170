//! The quick way: the core as a shared library, and the tests linked to it once.
//!
//! As a part of the tests' program the core takes them along: whatever changes in it, they are
//! compiled and linked anew, which takes five times as long as the core alone. Here only the
//! library is built for a mutant, and the same program runs with it. Constants that the tests
//! computed from the core's are the original's. Whatever is not noticed here is tried again with
//! everything built anew.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};

use super::{
    names::{Mutant, SOURCE},
    trial::{Outcome, copy},
};
use crate::{
    process::step,
    workspace::{Workspace, not_writable},
};

/// Which tests run.
#[derive(Clone, Copy)]
pub(super) enum Runs {
    /// What notices most in the least time.
    Quick,
    /// The others, but for the swarm and the raw bytes: they look for broken invariants only, and
    /// need many ticks for it.
    Rest,
}

impl Runs {
    /// Arguments of the test program, one run each.
    const fn arguments(self) -> &'static [&'static [&'static str]] {
        match self {
            Self::Quick => &[
                &["quick::"],
                &["recoveries::", "table_19::", "edges::", "profiles::"],
            ],
            Self::Rest => &[&["invariants::"], &["soak::"]],
        }
    }
}

/// Longest that a run may take, some twenty times what it takes.
const LATE: Duration = Duration::from_secs(240);
/// Most memory of a run, KiB: a loop without an end must not take the machine along.
const MEMORY_KIB: u32 = 4_000_000;

/// What a test program tells by its exit code: a test failed.
const FAILED: i32 = 101;

/// A copy of the checkout, built.
struct Copy {
    tree: PathBuf,
    tests: PathBuf,
    libraries: String,
}

/// What a mutant comes to.
#[derive(Clone, Copy)]
enum Fate {
    Caught,
    Late,
    Unviable,
    /// No test failed, or the program did not run at all.
    Unnoticed,
}

/// The copies, ready.
pub(super) struct Shared {
    copies: Vec<Copy>,
}

impl Shared {
    /// Copies the checkout, builds, and sees that the tests pass as it is.
    pub(super) fn new(workspace: &Workspace, jobs: u32) -> anyhow::Result<Self> {
        let home = workspace.root().join("out/mutants");
        let mut copies = Vec::new();
        for job in 0..jobs {
            let tree = home.join(format!("shared-{job}"));
            copy(workspace.root(), &tree, shared)?;
            step(&format!(
                "The core as a library, without a mutant (copy {} of {jobs})",
                job + 1
            ));
            let copy = Copy::build(workspace, tree)?;
            for runs in [Runs::Quick, Runs::Rest] {
                if !matches!(copy.test(runs)?, Fate::Unnoticed) {
                    bail!("the tests fail without a mutant");
                }
            }
            copies.push(copy);
        }
        Ok(Self { copies })
    }

    /// Tries these; survivors are those that no test noticed.
    pub(super) fn run(&self, runs: Runs, mutants: &[&Mutant]) -> anyhow::Result<Outcome> {
        let (next, outcome) = (AtomicUsize::new(0), Mutex::new(Outcome::default()));
        let work = |copy: &Copy| -> anyhow::Result<()> {
            while let Some(mutant) = mutants.get(next.fetch_add(1, Ordering::Relaxed)) {
                let fate = copy.attempt(runs, mutant)?;
                let mut outcome = outcome.lock().unwrap_or_else(|e| e.into_inner());
                match fate {
                    Fate::Caught => outcome.caught += 1,
                    Fate::Late => outcome.timeouts += 1,
                    Fate::Unviable => outcome.unviable += 1,
                    Fate::Unnoticed => {
                        eprintln!("not noticed yet: {}", mutant.name());
                        outcome.survivors.push((*mutant).clone());
                    }
                }
            }
            Ok(())
        };
        thread::scope(|scope| {
            let threads: Vec<_> = self
                .copies
                .iter()
                .map(|c| scope.spawn(|| work(c)))
                .collect();
            for thread in threads {
                match thread.join() {
                    Ok(result) => result?,
                    Err(_) => bail!("a thread that tries mutants panicked"),
                }
            }
            Ok(())
        })?;
        let mut outcome = outcome.into_inner().unwrap_or_else(|e| e.into_inner());
        outcome.survivors.sort();
        Ok(outcome)
    }
}

impl Copy {
    fn build(workspace: &Workspace, tree: PathBuf) -> anyhow::Result<Self> {
        let mut command = cargo(&tree);
        command
            .args(["test", "--no-run", "--quiet", "--profile=mutants"])
            .args([
                "--package=fitmac-core-tests",
                "--test=all",
                "--message-format=json",
            ])
            .stderr(Stdio::inherit());
        let built = command.output().context("cargo could not be started")?;
        if !built.status.success() {
            bail!("the core does not build as a shared library (see above)");
        }
        let tests = String::from_utf8_lossy(&built.stdout)
            .lines()
            .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
            .find_map(|message| Some(PathBuf::from(message.get("executable")?.as_str()?)))
            .context("cargo named no test program")?;
        let mut rustc = Command::new("rustc");
        rustc.args(["--print", "target-libdir"]);
        let output = rustc
            .current_dir(workspace.root())
            .output()
            .context("rustc could not be started")?;
        let standard = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        let own = tree.join("target/mutants/deps");
        Ok(Self {
            libraries: format!("{}:{standard}", own.display()),
            tree,
            tests,
        })
    }

    /// Tries one mutant, and makes its change undone.
    fn attempt(&self, runs: Runs, mutant: &Mutant) -> anyhow::Result<Fate> {
        let path = self.tree.join(mutant.file());
        let text = fs::read_to_string(&path)
            .with_context(|| format!("{} cannot be read", path.display()))?;
        let changed = mutant
            .apply(&text)
            .with_context(|| format!("{}: no such place", mutant.name()))?;
        fs::write(&path, changed).map_err(|error| not_writable(&path, &error))?;
        let fate = self.judge(runs);
        fs::write(&path, text).map_err(|error| not_writable(&path, &error))?;
        fate
    }

    fn judge(&self, runs: Runs) -> anyhow::Result<Fate> {
        let mut build = cargo(&self.tree);
        build
            .args([
                "build",
                "--quiet",
                "--profile=mutants",
                "--package=fitmac-core",
            ])
            .stderr(Stdio::null());
        let built = build.status().context("cargo could not be started")?;
        if !built.success() {
            return Ok(Fate::Unviable);
        }
        self.test(runs)
    }

    fn test(&self, runs: Runs) -> anyhow::Result<Fate> {
        for run in runs.arguments() {
            let Some(status) = self.run(run)? else {
                return Ok(Fate::Late);
            };
            match status.code() {
                Some(0) => {}
                Some(FAILED) => return Ok(Fate::Caught),
                // Not the tests' word: the other way decides.
                _ => return Ok(Fate::Unnoticed),
            }
        }
        Ok(Fate::Unnoticed)
    }

    /// Runs the tests that these arguments name; `None` if they were too late.
    fn run(&self, arguments: &[&str]) -> anyhow::Result<Option<ExitStatus>> {
        let mut limited = Command::new("sh");
        let child = limited
            .args(["-c", "ulimit -c 0 -v \"$0\"; exec \"$@\""])
            .arg(MEMORY_KIB.to_string())
            .arg(&self.tests)
            .args(["--test-threads=1", "--quiet"])
            .args(arguments)
            .current_dir(self.tree.join("tests/core"))
            .env("LD_LIBRARY_PATH", &self.libraries)
            .env("RUST_BACKTRACE", "0")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .context("the test program could not be started")?;
        wait(child)
    }
}

fn wait(mut child: Child) -> anyhow::Result<Option<ExitStatus>> {
    let end = Instant::now() + LATE;
    loop {
        if let Some(status) = child.try_wait().context("waiting for the tests")? {
            return Ok(Some(status));
        }
        if Instant::now() > end {
            child.kill().context("ending the tests")?;
            child.wait().context("ending the tests")?;
            return Ok(None);
        }
        thread::sleep(Duration::from_millis(10));
    }
}

/// Cargo in the copy. A mutant may break a lint's rule, but not the language's.
fn cargo(tree: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .current_dir(tree)
        .env("RUSTFLAGS", "-Cprefer-dynamic --cap-lints=warn")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("CARGO_TARGET_DIR")
        .stdin(Stdio::null());
    command
}

/// The core's manifest and root, as a shared library needs them.
fn shared(file: &str, text: Vec<u8>) -> Vec<u8> {
    let (at, more) = if file == "fitmac-core/Cargo.toml" {
        ("[lints]", "[lib]\ncrate-type = [\"dylib\"]\n\n[lints]")
    } else if file.strip_prefix(SOURCE) == Some("lib.rs") {
        // Who panics is told by the standard library.
        (
            "#![forbid(unsafe_code)]",
            "#![forbid(unsafe_code)]\nextern crate std as _;",
        )
    } else {
        return text;
    };
    String::from_utf8_lossy(&text)
        .replacen(at, more, 1)
        .into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_manifest_and_the_root_change() {
        let manifest = shared("fitmac-core/Cargo.toml", b"[lints]\n".to_vec());
        assert_eq!(manifest, b"[lib]\ncrate-type = [\"dylib\"]\n\n[lints]\n");
        let root = shared(
            "fitmac-core/src/lib.rs",
            b"#![forbid(unsafe_code)]\n".to_vec(),
        );
        assert_eq!(root, b"#![forbid(unsafe_code)]\nextern crate std as _;\n");
        assert_eq!(
            shared("fitmac-core/src/gate.rs", b"[lints]".to_vec()),
            b"[lints]"
        );
    }
}
