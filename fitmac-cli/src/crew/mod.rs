//! A crew: child processes that live and end together.
//!
//! Each member speaks to us by [`Report`]s, one JSON line each on its standard
//! output; what it writes to standard error goes to a log file. A member that
//! ends before it is asked to is a [`Loss`].

mod report;
#[cfg(test)]
mod tests;

use std::{
    fmt, fs,
    fs::File,
    io::{BufRead, BufReader},
    os::unix::process::{CommandExt, ExitStatusExt},
    path::PathBuf,
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{self, Receiver, RecvTimeoutError, Sender},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use anyhow::Context;
use rustix::process::{Pid, Signal, kill_process};

pub(crate) use report::{Cadence, Outcome, Progress, Report};

/// How often members are looked after.
const LOOK: Duration = Duration::from_millis(20);

/// The members, in the order of their start.
pub(crate) struct Crew {
    members: Vec<Member>,
    reports: Receiver<(usize, Report)>,
    sender: Sender<(usize, Report)>,
}

struct Member {
    role: &'static str,
    child: Child,
    log: PathBuf,
    reader: Option<JoinHandle<()>>,
    ended: Option<ExitStatus>,
}

/// How a crew ends, and how long that may take before members are killed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Ending {
    /// One after the other, the last started first: each still finds those
    /// that it builds on.
    InOrder(Duration),
    /// All at once, after a loss.
    AtOnce(Duration),
}

/// A member that ended before it was asked to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Loss {
    /// What it was in the crew.
    pub(crate) role: &'static str,
    /// Its process id.
    pub(crate) pid: u32,
    /// How it ended.
    pub(crate) status: ExitStatus,
    /// The last line that it wrote to its log; may be empty.
    pub(crate) last_words: String,
    /// The log.
    pub(crate) log: PathBuf,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { role, pid, .. } = self;
        write!(f, "the {role} process (pid {pid}) ")?;
        match (self.status.signal(), self.status.code()) {
            (Some(signal), _) => write!(f, "was ended by signal {signal}")?,
            (None, Some(code)) => write!(f, "ended with status {code}")?,
            (None, None) => write!(f, "ended")?,
        }
        if !self.last_words.is_empty() {
            write!(f, "; its last words: {}", self.last_words)?;
        }
        write!(f, "; its log: {}", self.log.display())
    }
}

impl std::error::Error for Loss {}

impl Crew {
    /// Nobody yet.
    pub(crate) fn new() -> Self {
        let (sender, reports) = mpsc::channel();
        Self {
            members: Vec::new(),
            reports,
            sender,
        }
    }

    /// Starts a member. It gets a process group of its own, so that Ctrl-C on
    /// the terminal reaches us alone and we end the crew in order.
    pub(crate) fn start(
        &mut self,
        role: &'static str,
        command: &mut Command,
        log: PathBuf,
    ) -> anyhow::Result<()> {
        let stderr = File::create(&log).with_context(|| {
            format!("{} cannot be written: choose another --out", log.display())
        })?;
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(stderr)
            .process_group(0)
            .spawn()
            .with_context(|| format!("the {role} process could not be started"))?;
        let (sender, index) = (self.sender.clone(), self.members.len());
        let reader = child
            .stdout
            .take()
            .map(|stdout| thread::spawn(move || forward(BufReader::new(stdout), index, &sender)));
        self.members.push(Member {
            role,
            child,
            log,
            reader,
            ended: None,
        });
        Ok(())
    }

    /// The next report with its sender's role, or nothing after a while.
    pub(crate) fn next(&mut self) -> Result<Option<(&'static str, Report)>, Loss> {
        match self.reports.recv_timeout(LOOK) {
            Ok((index, report)) => Ok(Some((self.members[index].role, report))),
            // We hold a sender ourselves: it never disconnects.
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                self.look()?;
                Ok(None)
            }
        }
    }

    /// Whether all members are still there.
    fn look(&mut self) -> Result<(), Loss> {
        self.reap();
        let lost = self
            .members
            .iter()
            .find_map(|member| Some((member, member.ended?)));
        match lost {
            None => Ok(()),
            Some((member, status)) => Err(Loss {
                role: member.role,
                pid: member.child.id(),
                status,
                last_words: member.last_words(),
                log: member.log.clone(),
            }),
        }
    }

    fn reap(&mut self) {
        for member in self
            .members
            .iter_mut()
            .filter(|member| member.ended.is_none())
        {
            // An error means that there is no such child any more: it ended.
            member.ended = match member.child.try_wait() {
                Ok(ended) => ended,
                Err(_) => Some(ExitStatus::default()),
            };
        }
    }

    /// Asks everyone to end and returns the reports that still came. Whoever
    /// takes too long is killed.
    pub(crate) fn stop(mut self, ending: Ending) -> Vec<(&'static str, Report)> {
        let (in_order, grace) = match ending {
            Ending::InOrder(grace) => (true, grace),
            Ending::AtOnce(grace) => (false, grace),
        };
        let deadline = Instant::now() + grace;
        for index in (0..self.members.len()).rev() {
            self.signal(index, Signal::TERM);
            while in_order && self.is_running(index) && Instant::now() < deadline {
                thread::sleep(LOOK / 4);
            }
        }
        while (0..self.members.len()).any(|index| self.is_running(index)) {
            if Instant::now() >= deadline {
                self.kill();
            }
            thread::sleep(LOOK / 4);
        }
        // Readers end with their pipes: what was said has been passed on then.
        let mut late = Vec::new();
        for member in &mut self.members {
            if let Some(reader) = member.reader.take() {
                // A reader does not panic; if it did, its member said nothing.
                let _ = reader.join();
            }
        }
        while let Ok((index, report)) = self.reports.try_recv() {
            late.push((self.members[index].role, report));
        }
        late
    }

    fn is_running(&mut self, index: usize) -> bool {
        self.reap();
        self.members[index].ended.is_none()
    }

    fn signal(&self, index: usize, signal: Signal) {
        let member = &self.members[index];
        let pid = i32::try_from(member.child.id())
            .ok()
            .and_then(Pid::from_raw);
        if let (None, Some(pid)) = (member.ended, pid) {
            // It may have ended by itself meanwhile: then there is nothing to do.
            let _ = kill_process(pid, signal);
        }
    }

    fn kill(&mut self) {
        for member in self
            .members
            .iter_mut()
            .filter(|member| member.ended.is_none())
        {
            let _ = member.child.kill();
            member.ended = Some(member.child.wait().unwrap_or_default());
        }
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        self.reap();
        self.kill();
    }
}

impl Member {
    fn last_words(&self) -> String {
        let log = fs::read(&self.log).unwrap_or_default();
        let text = String::from_utf8_lossy(&log);
        let lines = || text.lines().rev().filter(|line| !line.trim().is_empty());
        let complaint = |line: &&str| line.starts_with("fitmac: ") || line.starts_with("error: ");
        let last = lines().find(complaint).or_else(|| lines().next());
        last.unwrap_or_default()
            .chars()
            .filter(|c| !c.is_control())
            .take(300)
            .collect()
    }
}

/// Passes a member's reports on until its standard output closes. Other lines
/// are none of ours.
fn forward(lines: impl BufRead, index: usize, sender: &Sender<(usize, Report)>) {
    for line in lines.lines().map_while(Result::ok) {
        if let Ok(report) = serde_json::from_str(&line)
            && sender.send((index, report)).is_err()
        {
            return;
        }
    }
}
