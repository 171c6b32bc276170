//! `strace` on one thread.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal, kill_process};

/// A tracer at work.
pub(crate) struct Tracer {
    process: Child,
    folder: tempfile::TempDir,
}

impl Tracer {
    /// Attaches to a thread of ours, and returns when it has; `None` without
    /// `strace`, or where the system forbids tracing.
    pub(crate) fn attach(thread: i32) -> Option<Self> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let process = Command::new("strace")
            .args(["-q", "-c", "-U", "name,calls", "-o"])
            .arg(folder.path().join("calls"))
            .args(["-p", &thread.to_string()])
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut tracer = Self { process, folder };
        while !is_traced(thread) {
            if tracer.process.try_wait().is_ok_and(|ended| ended.is_some()) {
                return None;
            }
            thread::sleep(Duration::from_millis(5));
        }
        Some(tracer)
    }

    /// Detaches, and gives the calls by name.
    pub(crate) fn finish(mut self) -> BTreeMap<String, u64> {
        let pid = i32::try_from(self.process.id()).ok();
        let pid = pid.and_then(Pid::from_raw).expect("a process id");
        kill_process(pid, Signal::INT).expect("it runs");
        self.process.wait().expect("a child of ours");
        let table = fs::read_to_string(self.folder.path().join("calls"));
        parse(&table.expect("strace wrote its table"))
    }
}

fn is_traced(thread: i32) -> bool {
    let status = Path::new("/proc/self/task")
        .join(thread.to_string())
        .join("status");
    let text = fs::read_to_string(status).unwrap_or_default();
    let mut tracers = text.lines().filter_map(|l| l.strip_prefix("TracerPid:"));
    tracers.any(|pid| pid.trim() != "0")
}

/// The rows of a table like
/// ```text
/// syscall           calls
/// ---------------- ------
/// clock_nanosleep   20001
/// ---------------- ------
/// total             20001
/// ```
fn parse(table: &str) -> BTreeMap<String, u64> {
    let rows = table.lines().filter_map(|line| {
        let (name, calls) = line.trim().split_once(char::is_whitespace)?;
        Some((name.to_owned(), calls.trim().parse().ok()?))
    });
    rows.filter(|(name, _)| name != "total").collect()
}
