//! Tries mutants: one build of the core and a run or two of ready tests for each.
//!
//! As a part of the tests' program the core would take them along: whatever changes in it, they
//! would be compiled and linked anew, which takes five times as long as the core alone. So in a
//! copy of the checkout the core is a shared library, the tests are linked to it once, and the
//! same program runs with the library of each mutant. (What the tests' compiler took over from the
//! core, the value of a constant say, stays the original's; the core has no function that is
//! generic or inlined into its tests.)

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Output, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use anyhow::{Context, bail};

use super::{
    copy::copy,
    names::{Mutant, SOURCE},
};
use crate::{
    process::step,
    tool,
    workspace::{Workspace, not_writable},
};

const NAME: &str = "cargo-mutants";
const VERSION: &str = "27.1.0";

/// Arguments of the test program, one run each, what notices most in the least time first. The
/// swarm and the raw bytes are left out: they look for broken invariants only, and need many ticks
/// for it.
const FIRST: [&[&str]; 3] = [
    &["edges::", "profiles::"],
    &["quick::"],
    &["recoveries::", "table_19::"],
];
const LAST: [&[&str]; 2] = [&["soak::"], &["invariants::"]];
/// Longest that a run may take on a busy machine, s: some twenty times what it takes.
const LATE_S: &str = "240";
/// Most memory of a run, KiB: a loop without an end must not take the machine along.
const MEMORY_KIB: &str = "8000000";

/// What came out.
#[derive(Default)]
pub(super) struct Outcome {
    pub(super) caught: usize,
    pub(super) timeouts: usize,
    pub(super) unviable: usize,
    pub(super) survivors: Vec<Mutant>,
}

/// The copies of the checkout, ready.
pub(super) struct Trial {
    program: PathBuf,
    copies: Vec<Copy>,
}

impl Trial {
    /// Installs the tool, copies the checkout, builds, and sees that the tests pass as it is.
    pub(super) fn new(workspace: &Workspace, jobs: u32) -> anyhow::Result<Self> {
        let program = tool::install(workspace, NAME, VERSION)?.join(NAME);
        let home = workspace.root().join("out/mutants");
        let mut copies = Vec::new();
        for job in 0..jobs {
            let tree = home.join(format!("tree-{job}"));
            copy(workspace.root(), &tree, shared)?;
            let number = job + 1;
            step(&format!(
                "The tests without a mutant (copy {number} of {jobs})"
            ));
            let copy = Copy::build(tree)?;
            let runs = FIRST.iter().chain(&LAST).map(|run| copy.run(run));
            for status in runs.chain([copy.run_beside("")]) {
                if !status?.success() {
                    bail!("the tests fail without a mutant");
                }
            }
            copies.push(copy);
        }
        Ok(Self { program, copies })
    }

    /// All mutants of the core, or those that a diff touches.
    pub(super) fn list(&self, in_diff: Option<&Path>) -> anyhow::Result<Vec<Mutant>> {
        let mut command = Command::new(&self.program);
        command
            .args(["mutants", "--list", "--json", "--colors=never"])
            .arg("--package=fitmac-core")
            .stderr(Stdio::inherit());
        if let Some(diff) = in_diff {
            let diff = fs::canonicalize(diff)
                .with_context(|| format!("--in-diff {} cannot be read", diff.display()))?;
            command.arg("--in-diff").arg(diff);
        }
        let Some(copy) = self.copies.first() else {
            bail!("--jobs is 0: it must be at least 1");
        };
        let output = command
            .current_dir(&copy.tree)
            .output()
            .context("cargo-mutants could not be started")?;
        if !output.status.success() {
            bail!("cargo-mutants cannot list the mutants (see above)");
        }
        // Without any mutant the list is empty text.
        if output.stdout.iter().all(u8::is_ascii_whitespace) {
            return Ok(Vec::new());
        }
        let list: Vec<serde_json::Value> =
            serde_json::from_slice(&output.stdout).context("cargo-mutants' list is no JSON")?;
        let read = |entry| {
            Mutant::read(entry).with_context(|| format!("cargo-mutants lists a mutant as {entry}"))
        };
        list.iter().map(read).collect()
    }

    /// Tries these, side by side in the copies.
    pub(super) fn run(&self, mutants: &[&Mutant]) -> anyhow::Result<Outcome> {
        let (next, outcome) = (AtomicUsize::new(0), Mutex::new(Outcome::default()));
        let work = |copy: &Copy| -> anyhow::Result<()> {
            while let Some(mutant) = mutants.get(next.fetch_add(1, Ordering::Relaxed)) {
                let fate = copy.attempt(mutant)?;
                let mut outcome = outcome.lock().unwrap_or_else(|e| e.into_inner());
                match fate {
                    Fate::Caught => outcome.caught += 1,
                    Fate::Late => outcome.timeouts += 1,
                    Fate::Unviable => outcome.unviable += 1,
                    Fate::Survives => outcome.survivors.push((*mutant).clone()),
                    Fate::NotRun => bail!("{}: the tests do not run", mutant.name()),
                }
            }
            Ok(())
        };
        thread::scope(|scope| {
            let copies = self.copies.iter();
            let threads: Vec<_> = copies.map(|copy| scope.spawn(|| work(copy))).collect();
            threads.into_iter().try_for_each(|thread| {
                let result = thread.join();
                result.unwrap_or_else(|_| bail!("a thread that tries mutants panicked"))
            })
        })?;
        let mut outcome = outcome.into_inner().unwrap_or_else(|e| e.into_inner());
        outcome.survivors.sort();
        Ok(outcome)
    }
}

/// What a mutant comes to.
#[derive(Clone, Copy)]
enum Fate {
    Caught,
    Late,
    Unviable,
    Survives,
    /// The tests' program lacks something in this library.
    NotRun,
}

/// A copy of the checkout, built.
struct Copy {
    tree: PathBuf,
    tests: PathBuf,
    libraries: String,
}

impl Copy {
    fn build(tree: PathBuf) -> anyhow::Result<Self> {
        let built = link(&tree)?;
        if !built.status.success() {
            eprintln!("{}", String::from_utf8_lossy(&built.stderr));
            bail!("the core does not build as a shared library (see above)");
        }
        let tests = String::from_utf8_lossy(&built.stdout)
            .lines()
            .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
            .find_map(|message| Some(PathBuf::from(message.get("executable")?.as_str()?)))
            .context("cargo named no test program")?;
        let mut rustc = Command::new("rustc");
        rustc.args(["--print", "target-libdir"]).current_dir(&tree);
        let output = rustc.output().context("rustc could not be started")?;
        let standard = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        let own = tree.join("target/mutants/deps");
        Ok(Self {
            libraries: format!("{}:{standard}", own.display()),
            tree,
            tests,
        })
    }

    /// Tries one mutant, and takes its change back.
    fn attempt(&self, mutant: &Mutant) -> anyhow::Result<Fate> {
        let path = self.tree.join(mutant.file());
        let text = fs::read_to_string(&path)
            .with_context(|| format!("{} cannot be read", path.display()))?;
        let changed = mutant
            .apply(&text)
            .with_context(|| format!("{}: there is no such place", mutant.name()))?;
        fs::write(&path, changed).map_err(|error| not_writable(&path, &error))?;
        let mut fate = self.judge(mutant);
        let alone = !matches!(fate, Ok(Fate::NotRun));
        if !alone && link(&self.tree)?.status.success() {
            fate = self.test(mutant);
        }
        fs::write(&path, text).map_err(|error| not_writable(&path, &error))?;
        if !alone {
            link(&self.tree)?;
        }
        fate
    }

    fn judge(&self, mutant: &Mutant) -> anyhow::Result<Fate> {
        let mut build = cargo(&self.tree);
        build
            .args(["build", "--quiet", "--profile=mutants"])
            .arg("--package=fitmac-core")
            .stderr(Stdio::null());
        let built = build.status().context("cargo could not be started")?;
        if !built.success() {
            return Ok(Fate::Unviable);
        }
        self.test(mutant)
    }

    fn test(&self, mutant: &Mutant) -> anyhow::Result<Fate> {
        let first = FIRST.iter().map(|run| self.run(run));
        let beside = self.module_with_tests(mutant);
        let beside = beside.iter().map(|module| self.run_beside(module));
        let last = LAST.iter().map(|run| self.run(run));
        for status in first.chain(beside).chain(last) {
            match status?.code() {
                Some(0) => {}
                Some(124) => return Ok(Fate::Late),
                Some(126 | 127) => return Ok(Fate::NotRun),
                _ => return Ok(Fate::Caught),
            }
        }
        eprintln!("survives: {}", mutant.name());
        Ok(Fate::Survives)
    }

    /// The module of a mutant, if it has tests of its own.
    fn module_with_tests(&self, mutant: &Mutant) -> Option<String> {
        let text = fs::read_to_string(self.tree.join(mutant.file())).ok()?;
        let module = mutant.short_file().strip_suffix(".rs")?;
        let module = module.strip_suffix("/mod").unwrap_or(module);
        let has_tests = text.contains("#[cfg(test)]");
        has_tests.then(|| format!("{}::tests::", module.replace('/', "::")))
    }

    /// Runs the tests of the program that these arguments name.
    fn run(&self, arguments: &[&str]) -> anyhow::Result<ExitStatus> {
        let mut program = Command::new(&self.tests);
        program
            .args(["--test-threads=1", "--quiet"])
            .args(arguments)
            .current_dir(self.tree.join("tests/core"));
        self.wait(program)
    }

    /// Builds and runs the tests beside the code whose names begin with `module`.
    fn run_beside(&self, module: &str) -> anyhow::Result<ExitStatus> {
        let mut test = cargo(&self.tree);
        test.args(["test", "--quiet", "--profile=mutants"]).args([
            "--package=fitmac-core",
            "--lib",
            "--",
            module,
        ]);
        self.wait(test)
    }

    fn wait(&self, command: Command) -> anyhow::Result<ExitStatus> {
        let mut limited = limited(&command);
        limited
            .env("LD_LIBRARY_PATH", &self.libraries)
            .env("RUST_BACKTRACE", "0")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        limited.status().context("the tests could not be started")
    }
}

/// The same command with limits on its memory and its time; 124 is the exit code of one that was
/// late.
fn limited(command: &Command) -> Command {
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "ulimit -c 0; ulimit -v \"$0\"; exec timeout \"$@\""])
        .args([MEMORY_KIB, LATE_S])
        .arg(command.get_program())
        .args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        limited.current_dir(folder);
    }
    for (key, value) in command.get_envs() {
        match value {
            Some(value) => limited.env(key, value),
            None => limited.env_remove(key),
        };
    }
    limited
}

/// Builds the core and the tests' program.
fn link(tree: &Path) -> anyhow::Result<Output> {
    let mut command = cargo(tree);
    command
        .args(["test", "--no-run", "--quiet", "--profile=mutants"])
        .args(["--package=fitmac-core-tests", "--test=all"])
        .arg("--message-format=json");
    command.output().context("cargo could not be started")
}

/// Cargo in a copy. A mutant may break a lint's rule, but not the language's.
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

/// The core's manifest and root, as a shared library needs them: of which the tests beside the code
/// need no more than the core itself.
fn shared(file: &str, text: Vec<u8>) -> Vec<u8> {
    let changes: &[(&str, &str)] = if file == "fitmac-core/Cargo.toml" {
        &[
            ("[lints]", "[lib]\ncrate-type = [\"dylib\"]\n\n[lints]"),
            (
                "[dev-dependencies]\nfitmac-core-tests.workspace = true\n",
                "",
            ),
        ]
    } else if file.strip_prefix(SOURCE) == Some("lib.rs") {
        // A shared library must know who takes a panic.
        &[(
            "#![forbid(unsafe_code)]",
            "#![forbid(unsafe_code)] extern crate std as _;",
        )]
    } else {
        return text;
    };
    let mut text = String::from_utf8_lossy(&text).into_owned();
    for (at, instead) in changes {
        text = text.replacen(at, instead, 1);
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_manifest_and_the_root_change() {
        let manifest = "[lints]\nworkspace = true\n\n[dev-dependencies]\n\
                        fitmac-core-tests.workspace = true\n";
        let manifest = shared("fitmac-core/Cargo.toml", manifest.into());
        let text = "[lib]\ncrate-type = [\"dylib\"]\n\n[lints]\nworkspace = true\n\n";
        assert_eq!(String::from_utf8(manifest).as_deref(), Ok(text));
        let root = shared(
            "fitmac-core/src/lib.rs",
            b"#![forbid(unsafe_code)]\n".into(),
        );
        assert_eq!(root, b"#![forbid(unsafe_code)] extern crate std as _;\n");
        let other = shared("fitmac-core/src/gate.rs", b"[lints]".into());
        assert_eq!(other, b"[lints]");
    }

    #[test]
    fn a_limited_command_ends_as_the_command_does() {
        let code = |script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]);
            limited(&command).status().expect("it runs").code()
        };
        assert_eq!(code("exit 101"), Some(101));
        assert_eq!(code("kill -9 $$"), None);
    }
}
