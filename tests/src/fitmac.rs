//! The `fitmac` program as tests start it: built, in an environment of its
//! own, and looked after.

use std::{
    fs,
    io::Read,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use fitmac_rt::instance::Instance;
use tempfile::TempDir;

/// After this long a test gives up waiting.
const GIVE_UP: Duration = Duration::from_secs(120);

/// Builds `fitmac` in the profile of the running test, once, and says where it is.
/// `FITMAC_PROGRAM` names an installed one to test instead.
///
/// # Panics
/// If it does not build: its compiler messages are above then.
#[must_use]
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        if let Some(installed) = std::env::var_os("FITMAC_PROGRAM") {
            return installed.into();
        }
        // target/PROFILE/deps/TEST-HASH, or target/PROFILE/PROGRAM
        let this = std::env::current_exe().expect("the path of this program");
        let mut folders = this.ancestors().skip(1);
        let folder = folders
            .find(|folder| !folder.ends_with("deps"))
            .expect("the profile's folder");
        let profile = match folder.file_name().and_then(|name| name.to_str()) {
            Some("debug") | None => "dev",
            Some(other) => other,
        };
        let mut cargo = Command::new(env!("CARGO"));
        cargo.current_dir(env!("CARGO_MANIFEST_DIR"));
        cargo.args([
            "build",
            "--quiet",
            "--locked",
            "--package=fitmac-cli",
            "--bin=fitmac",
        ]);
        cargo.args(["--profile", profile]);
        let status = cargo.status().expect("cargo runs");
        assert!(status.success(), "fitmac does not build");
        folder.join("fitmac")
    })
}

/// A place where `fitmac` runs: instances and outputs are its own.
#[derive(Debug)]
pub struct Place {
    folder: TempDir,
    _alone: Option<MutexGuard<'static, ()>>,
}

static ALONE: Mutex<()> = Mutex::new(());

impl Default for Place {
    fn default() -> Self {
        Self::new()
    }
}

impl Place {
    /// An empty place. No other test of the same program has one of these at
    /// the same time, as a small machine cannot run several demos in real time.
    ///
    /// # Panics
    /// If there is no temporary folder.
    #[must_use]
    pub fn new() -> Self {
        // A test that failed has spoilt nothing for the next one.
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        Self {
            _alone: Some(alone),
            ..Self::beside_others()
        }
    }

    /// An empty place beside those of other tests, for what needs little of
    /// the machine.
    ///
    /// # Panics
    /// If there is no temporary folder.
    #[must_use]
    pub fn beside_others() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
            _alone: None,
        }
    }

    /// Its folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Starts `fitmac` with these arguments.
    ///
    /// # Panics
    /// If it does not start.
    #[must_use]
    pub fn start(&self, arguments: &[&str]) -> Run {
        self.start_under(&[], arguments)
    }

    /// Starts `fitmac` under a program that changes something for it, like
    /// `["setpriv", "--no-new-privs"]`.
    ///
    /// # Panics
    /// If it does not start.
    #[must_use]
    pub fn start_under(&self, wrapper: &[&str], arguments: &[&str]) -> Run {
        let mut command = match wrapper.split_first() {
            None => Command::new(program()),
            Some((outer, its)) => {
                let mut command = Command::new(outer);
                command.args(its).arg(program());
                command
            }
        };
        command.args(arguments).current_dir(self.folder());
        command.env("XDG_RUNTIME_DIR", self.folder());
        command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("fitmac starts");
        Run {
            stdout: read_all(child.stdout.take().expect("piped")),
            stderr: read_all(child.stderr.take().expect("piped")),
            child,
        }
    }

    /// Everything that instances of this place hold now, on disk and in shared
    /// memory.
    #[must_use]
    pub fn instance_files(&self) -> Vec<PathBuf> {
        let instances = fs::read_dir(self.folder().join("fitmac"));
        let roots = instances
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path());
        roots.flat_map(|root| files_of(&root)).collect()
    }

    /// Everything that the instance of this name holds now.
    #[must_use]
    pub fn files_of_instance(&self, name: &str) -> Vec<PathBuf> {
        files_of(&self.folder().join("fitmac").join(name))
    }
}

fn files_of(root: &Path) -> Vec<PathBuf> {
    let mut files = Instance::at(root).map_or_else(|_| Vec::new(), |instance| instance.files());
    if root.exists() {
        files.push(root.to_owned());
    }
    files
}

fn read_all(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    thread::spawn(move || {
        let mut text = Vec::new();
        // What was read before an error is what a test wants to see.
        let _ = pipe.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    })
}

/// A running `fitmac`; it is killed if the test forgets it.
#[derive(Debug)]
pub struct Run {
    child: Child,
    stdout: JoinHandle<String>,
    stderr: JoinHandle<String>,
}

/// What a run left.
#[derive(Debug)]
pub struct Finished {
    /// How it ended.
    pub status: ExitStatus,
    /// What it wrote to standard output.
    pub stdout: String,
    /// What it wrote to standard error.
    pub stderr: String,
}

impl Run {
    /// Its process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The process that runs this role for it, if there is one.
    #[must_use]
    pub fn role(&self, role: &str) -> Option<u32> {
        children(self.pid()).into_iter().find(|&pid| {
            let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
            line.split(|&byte| byte == 0)
                .any(|word| word == role.as_bytes())
        })
    }

    /// All processes that it has started and that still run.
    #[must_use]
    pub fn children(&self) -> Vec<u32> {
        children(self.pid())
    }

    /// Whether it still runs.
    ///
    /// # Panics
    /// If the system has lost it.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child of ours").is_none()
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// If it does not end.
    #[must_use]
    pub fn finish(mut self) -> Finished {
        let give_up = Instant::now() + GIVE_UP;
        while self.is_running() {
            if Instant::now() > give_up {
                let _ = self.child.kill();
                let stderr = self.stderr.join().unwrap_or_default();
                panic!("fitmac does not end; it said: {stderr}");
            }
            thread::sleep(Duration::from_millis(5));
        }
        Finished {
            status: self.child.wait().expect("a child of ours"),
            stdout: self.stdout.join().expect("a reader does not panic"),
            stderr: self.stderr.join().expect("a reader does not panic"),
        }
    }
}

fn children(pid: u32) -> Vec<u32> {
    let text = fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap_or_default();
    text.split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect()
}

/// Whether a process runs. One that has ended and waits to be reaped does not.
#[must_use]
pub fn is_running(pid: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let state = stat
        .rsplit(')')
        .next()
        .and_then(|rest| rest.trim().chars().next());
    state.is_some_and(|state| state != 'Z')
}

/// Waits until something is there.
///
/// # Panics
/// If it does not come.
pub fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let give_up = Instant::now() + GIVE_UP;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < give_up, "{what} does not come");
        thread::sleep(Duration::from_millis(5));
    }
}
