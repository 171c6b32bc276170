//! One run of the demo: four processes, one episode.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use fitmac_core::message::TraceRecord;
use fitmac_rt::{instance::Instance, signals::Signals};
use serde::Serialize;

use super::status::StatusLine;
use crate::{
    card::Card,
    crew::{Cadence, Crew, Ending, Outcome, Report},
};

/// How long the processes may take to connect.
const START_MAX: Duration = Duration::from_secs(20);
/// How long an episode may take on the wall clock.
const EPISODE_MAX: Duration = Duration::from_secs(90);
/// How long the processes may take to end when all is well: pictures are
/// drawn then.
const END_MAX: Duration = Duration::from_secs(20);
/// How long they may take when something went wrong.
const ABORT_MAX: Duration = Duration::from_millis(1200);
/// How long the control loop spins before each tick, us: a sleep alone wakes
/// some 50 us late.
const SPIN_US: &str = "150";
/// What the names of our instances begin with.
const INSTANCE_PREFIX: &str = "demo-";

/// Which of the two runs it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Variant {
    /// All corrections are switched off: the policy's actions pass through.
    PolicyAlone,
    /// All corrections are on.
    FitMac,
}

impl Variant {
    /// The name in file names.
    pub(super) fn folder(self) -> &'static str {
        match self {
            Self::PolicyAlone => "policy-alone",
            Self::FitMac => "fit-mac",
        }
    }

    /// The name for people.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::PolicyAlone => "policy alone",
            Self::FitMac => "with FIT-MAC",
        }
    }
}

/// What both runs share.
pub(super) struct Plan {
    pub(super) seed: u64,
    pub(super) task: String,
    /// The runs' folders go here.
    pub(super) out: PathBuf,
}

/// What a run left.
pub(super) struct Run {
    pub(super) outcome: Outcome,
    pub(super) cadence: Cadence,
    pub(super) card: Card,
    /// What the core decided, query by query.
    pub(super) decisions: Vec<TraceRecord>,
    pub(super) trace: PathBuf,
    pub(super) folder: PathBuf,
}

/// Why there is no run.
pub(super) enum NoRun {
    /// The user asked us to end.
    Interrupted,
    /// A process died, or an episode did not end: the user was told.
    Aborted,
    /// The machine got in the way.
    Failed(anyhow::Error),
}

impl<E: Into<anyhow::Error>> From<E> for NoRun {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// Files of a run.
struct Files {
    folder: PathBuf,
    card: PathBuf,
    trace: PathBuf,
}

impl Plan {
    /// Performs a run: starts the processes, watches them, ends them, and
    /// leaves nothing behind but the run's folder.
    pub(super) fn perform(&self, variant: Variant, signals: &Signals) -> Result<Run, NoRun> {
        let files = self.files(variant)?;
        let name = format!(
            "{INSTANCE_PREFIX}{}-{}",
            std::process::id(),
            variant.folder()
        );
        let instance = Instance::named(&name)?;
        let mut crew = Crew::new();
        let mut line = StatusLine::new(variant.title());
        let watched = match self.start(&mut crew, variant, &name, &files) {
            Ok(()) => watch(&mut crew, &mut line, signals),
            Err(error) => Err(NoRun::Failed(error)),
        };
        line.finish();
        // At once: ending the others takes a moment.
        let watched = watched.map_err(|no_run| match no_run {
            NoRun::Failed(error) => {
                eprintln!("fitmac: {error:#}; stopping the others");
                NoRun::Aborted
            }
            other => other,
        });
        let last = crew.stop(match watched {
            Ok(()) => Ending::InOrder(END_MAX),
            Err(_) => Ending::AtOnce(ABORT_MAX),
        });
        instance.clean_up().context("cleaning up shared memory")?;
        watched?;
        files.collect(last).map_err(NoRun::Failed)
    }

    /// The folder of a run, without what an earlier one left in it.
    fn files(&self, variant: Variant) -> anyhow::Result<Files> {
        let folder = self.out.join(variant.folder());
        let files = Files {
            card: folder.join("scene.json"),
            trace: folder.join("trace.mcap"),
            folder,
        };
        let _ = fs::remove_file(&files.card);
        let _ = fs::remove_file(&files.trace);
        fs::create_dir_all(&files.folder).with_context(|| {
            format!(
                "{} cannot be written: choose another --out",
                files.folder.display()
            )
        })?;
        Ok(files)
    }

    fn start(
        &self,
        crew: &mut Crew,
        variant: Variant,
        instance: &str,
        files: &Files,
    ) -> anyhow::Result<()> {
        let seed = self.seed.to_string();
        let supervisor = std::process::id().to_string();
        let mut role = |role: &'static str, title: &'static str, arguments: &[&str]| {
            let program = std::env::current_exe().context("the path of this program")?;
            let mut command = Command::new(program);
            command.args(["--supervised", &supervisor, role, "--instance", instance]);
            command.args(arguments);
            crew.start(
                title,
                &mut command,
                files.folder.join(format!("{role}.log")),
            )
        };
        let path = |path: &Path| path.to_string_lossy().into_owned();
        let (card, trace, folder) = (path(&files.card), path(&files.trace), path(&files.folder));
        role(
            "sim",
            "simulator",
            &[
                "--card",
                &card,
                "--seed",
                &seed,
                "--task",
                &self.task,
                "--pictures",
                &folder,
            ],
        )?;
        role("vla", "policy", &["--card", &card, "--seed", &seed])?;
        role("agents", "agents", &["--card", &card])?;
        let mut arguments = vec!["--trace", &trace, "--black-box", &folder];
        // What the machine allows of real time is taken; the cadence tells.
        arguments.extend(["--allow-non-rt", "--spin-us", SPIN_US]);
        if variant == Variant::PolicyAlone {
            arguments.push("--backbone-only");
        }
        role("rt", "controller", &arguments)
    }
}

/// Follows the episode until it is decided.
fn watch(crew: &mut Crew, line: &mut StatusLine, signals: &Signals) -> Result<(), NoRun> {
    let started = Instant::now();
    let mut moved = false;
    loop {
        if signals.stop_requested() {
            return Err(NoRun::Interrupted);
        }
        match crew.next()? {
            Some((_, Report::Over)) => return Ok(()),
            Some((_, Report::Progress(progress))) => {
                moved |= progress.step > 0;
                line.show(&progress);
            }
            _ => {}
        }
        let max = if moved { EPISODE_MAX } else { START_MAX };
        if started.elapsed() > max {
            let what = if moved {
                "did not end"
            } else {
                "did not start"
            };
            return Err(NoRun::Failed(anyhow::anyhow!(
                "the episode {what} within {} s: see the logs beside the trace",
                max.as_secs()
            )));
        }
    }
}

impl Files {
    /// What the processes said last, and what they wrote.
    fn collect(self, last: Vec<(&'static str, Report)>) -> anyhow::Result<Run> {
        let mut outcome = None;
        let mut cadence = None;
        for (_, report) in last {
            match report {
                Report::Outcome(said) => outcome = Some(said),
                Report::Cadence(said) => cadence = Some(said),
                _ => {}
            }
        }
        let logs = self.folder.display();
        let (Some(outcome), Some(cadence)) = (outcome, cadence) else {
            bail!("a process ended without its report: see the logs in {logs}");
        };
        Ok(Run {
            outcome,
            cadence,
            card: Card::read(&self.card)?,
            decisions: crate::timeline::read_decisions(&self.trace)?,
            trace: self.trace,
            folder: self.folder,
        })
    }
}

/// Removes what demos that were killed have left in shared memory.
pub(super) fn remove_stale_instances() -> anyhow::Result<()> {
    let probe = Instance::named(INSTANCE_PREFIX.trim_end_matches('-'))?;
    let Some(base) = probe.root().parent() else {
        return Ok(());
    };
    for entry in fs::read_dir(base).into_iter().flatten().flatten() {
        let ours = entry
            .file_name()
            .to_string_lossy()
            .starts_with(INSTANCE_PREFIX);
        if ours {
            // One that still runs stays: it has members.
            Instance::at(&entry.path())?.clean_up()?;
        }
    }
    Ok(())
}
