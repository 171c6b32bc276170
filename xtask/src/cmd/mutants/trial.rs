//! Tries mutants in copies of the checkout, by cargo-mutants and in the quick way.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, bail};

use super::{
    names::Mutant,
    shared::{Runs, Shared},
};
use crate::{
    process::{self, step},
    tool,
    workspace::{Workspace, not_writable},
};

const NAME: &str = "cargo-mutants";
const VERSION: &str = "27.1.0";

/// Where the core's tests are that stand beside its code.
const PACKAGE: &str = "fitmac-core";

/// Longest that the tests may take on a busy machine, s.
const TIMEOUT_S: &str = "300";

/// What came out.
#[derive(Default)]
pub(super) struct Outcome {
    pub(super) caught: usize,
    pub(super) timeouts: usize,
    pub(super) unviable: usize,
    pub(super) survivors: Vec<Mutant>,
}

impl Outcome {
    /// Adds what came out of another try of its survivors, which alone may still survive.
    fn go_on(&mut self, more: Self) {
        self.caught += more.caught;
        self.timeouts += more.timeouts;
        self.unviable += more.unviable;
        self.survivors = more.survivors;
    }
}

/// The copies, ready.
pub(super) struct Trial {
    program: PathBuf,
    trees: Vec<PathBuf>,
    shared: Shared,
}

impl Trial {
    /// Installs the tool, copies the checkout, and sees that the tests pass as it is.
    pub(super) fn new(workspace: &Workspace, jobs: u32) -> anyhow::Result<Self> {
        let program = tool::install(workspace, NAME, VERSION)?.join(NAME);
        let home = workspace.root().join("out/mutants");
        let mut trees = Vec::new();
        for job in 0..jobs {
            let tree = home.join(format!("tree-{job}"));
            copy(workspace.root(), &tree, |_, text| text)?;
            step(&format!(
                "The tests without a mutant (copy {} of {jobs})",
                job + 1
            ));
            let mut test = process::cargo(workspace);
            test.current_dir(&tree)
                .args(["test", "--quiet", "--profile=mutants", "--lib"])
                .args(["--package", PACKAGE])
                .stdout(Stdio::null());
            process::run(&mut test).context("the tests fail without a mutant")?;
            trees.push(tree);
        }
        let shared = Shared::new(workspace, jobs)?;
        Ok(Self {
            program,
            trees,
            shared,
        })
    }

    /// All mutants of the core, or those that a diff touches.
    pub(super) fn list(&self, in_diff: Option<&Path>) -> anyhow::Result<Vec<Mutant>> {
        let mut command = Command::new(&self.program);
        command
            .args([
                "mutants",
                "--list",
                "--json",
                "--colors=never",
                "--package=fitmac-core",
            ])
            .stderr(Stdio::inherit());
        if let Some(diff) = in_diff {
            let diff = fs::canonicalize(diff)
                .with_context(|| format!("--in-diff {} cannot be read", diff.display()))?;
            command.arg("--in-diff").arg(diff);
        }
        let Some(tree) = self.trees.first() else {
            bail!("--jobs is 0: it must be at least 1");
        };
        let output = command
            .current_dir(tree)
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

    /// Tries these: against the tests that notice most, against those beside the code, against
    /// the rest.
    pub(super) fn run(&self, mutants: &[&Mutant]) -> anyhow::Result<Outcome> {
        let mut outcome = self.shared.run(Runs::Quick, mutants)?;
        let left = outcome.survivors.clone();
        outcome.go_on(self.beside(&left)?);
        let left = outcome.survivors.clone();
        let left: Vec<&Mutant> = left.iter().collect();
        outcome.go_on(self.shared.run(Runs::Rest, &left)?);
        Ok(outcome)
    }

    /// Tries these against the tests beside the code; each copy takes its share.
    fn beside(&self, mutants: &[Mutant]) -> anyhow::Result<Outcome> {
        let mut children = Vec::new();
        let share = mutants.len().div_ceil(self.trees.len()).max(1);
        for (tree, share) in self.trees.iter().zip(mutants.chunks(share)) {
            let child = self.start(tree, share)?;
            children.push((tree, child));
        }
        let mut outcome = Outcome::default();
        for (tree, mut child) in children {
            let status = child.wait().context("waiting for cargo-mutants")?;
            // 2: some survived; 3: some took too long.
            if !matches!(status.code(), Some(0 | 2 | 3)) {
                bail!("cargo-mutants ended with {status} (see above)");
            }
            let named = |list: &str| -> anyhow::Result<Vec<Mutant>> {
                let names = read(tree, list)?;
                // Version 27.1.0 lets `delete field` pass every `--re`.
                let ours = mutants.iter().filter(|m| names.contains(&m.name()));
                Ok(ours.cloned().collect())
            };
            outcome.caught += named("caught")?.len();
            outcome.timeouts += named("timeout")?.len();
            outcome.unviable += named("unviable")?.len();
            outcome.survivors.extend(named("missed")?);
        }
        let tried = outcome.caught + outcome.timeouts + outcome.unviable + outcome.survivors.len();
        if tried != mutants.len() {
            bail!("cargo-mutants tried {tried} mutants of {}", mutants.len());
        }
        Ok(outcome)
    }

    fn start(&self, tree: &Path, mutants: &[Mutant]) -> anyhow::Result<std::process::Child> {
        let _none_yet = fs::remove_dir_all(tree.join("mutants.out"));
        let mut command = Command::new(&self.program);
        command
            .args(["mutants", "--in-place", "--baseline=skip", "--colors=never"])
            .args(["--package=fitmac-core", "--profile=mutants"])
            .args(["--timeout", TIMEOUT_S, "--build-timeout", TIMEOUT_S])
            .args(["--test-package", PACKAGE]);
        let files: BTreeSet<_> = mutants.iter().map(Mutant::file).collect();
        for file in files {
            command.args(["--file", file]);
        }
        for mutant in mutants {
            command.args(["--re", &mutant.pattern()]);
        }
        command
            .args(["--", "--lib"])
            .current_dir(tree)
            .env_remove("CARGO_TARGET_DIR")
            .env_remove("RUSTFLAGS")
            .stdin(Stdio::null())
            .stdout(process::to_stderr());
        command
            .spawn()
            .context("cargo-mutants could not be started")
    }
}

/// The names on one of cargo-mutants' lists.
fn read(tree: &Path, list: &str) -> anyhow::Result<BTreeSet<String>> {
    let path = tree.join(format!("mutants.out/{list}.txt"));
    let text =
        fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
    Ok(text
        .lines()
        .map(|name| name.trim_end().to_owned())
        .collect())
}

/// Copies what git knows or would add, so that a mutant never touches the checkout itself. What is
/// the same stays untouched, and so need not be compiled again. `edit` may change a file's text.
pub(super) fn copy(
    from: &Path,
    to: &Path,
    edit: impl Fn(&str, Vec<u8>) -> Vec<u8>,
) -> anyhow::Result<()> {
    let mut git = Command::new("git");
    git.args([
        "ls-files",
        "-z",
        "--cached",
        "--others",
        "--exclude-standard",
    ]);
    let output = git
        .current_dir(from)
        .output()
        .context("the checkout is copied by `git ls-files`: install git")?;
    if !output.status.success() {
        bail!("`git ls-files` fails: mutants are tried in a clone of the repository");
    }
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let files: BTreeSet<&str> = text.split('\0').filter(|f| !f.is_empty()).collect();
    for file in &files {
        // A file that git knows may be gone.
        let Ok(text) = fs::read(from.join(file)) else {
            continue;
        };
        let wanted = edit(file, text);
        let target = to.join(file);
        if fs::read(&target).is_ok_and(|found| found == wanted) {
            continue;
        }
        fs::create_dir_all(target.parent().unwrap_or(to))
            .and_then(|()| fs::write(&target, wanted))
            .map_err(|error| not_writable(&target, &error))?;
    }
    let sources = to.join("fitmac-core/src");
    for file in super::sources(&sources, "fitmac-core/src/")? {
        if !files.contains(file.as_str()) {
            fs::remove_file(to.join(&file)).map_err(|error| not_writable(&sources, &error))?;
        }
    }
    Ok(())
}
