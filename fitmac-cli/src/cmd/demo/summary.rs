//! What the demo says in the end.

use std::io::IsTerminal;

use fitmac_core::{
    reason,
    wire::{EventKind, Route},
};
use serde::Serialize;

use super::run::{Plan, Run, Variant};
use crate::{
    crew::{Cadence, Outcome},
    timeline::{self, Row},
};

/// Width of the timeline where there is no terminal to ask.
const WIDTH: u16 = 140;

/// Both runs and the verdict.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    seed: u64,
    task: String,
    instruction: String,
    /// The policy alone failed and FIT-MAC succeeded.
    pub(super) as_it_should_be: bool,
    policy_alone: RunSummary,
    fit_mac: RunSummary,
}

/// One run.
#[derive(Debug, Serialize)]
struct RunSummary {
    outcome: Outcome,
    interventions: Interventions,
    cadence: Cadence,
    files: Files,
    timeline: Vec<Row>,
}

/// What FIT-MAC did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct Interventions {
    /// Times that an execution correction took the arm.
    execution_corrections: u64,
    /// Times that the target was looked at again; the first look is none.
    target_corrections: u64,
    /// Queries answered by a correction instead of the policy.
    corrected_queries: u64,
    /// All queries.
    queries: u64,
}

/// Where things are.
#[derive(Debug, Serialize)]
struct Files {
    trace: String,
    pictures: Vec<String>,
    logs: Vec<String>,
}

impl Summary {
    /// Compares the two runs.
    pub(super) fn of(plan: &Plan, alone: &Run, with: &Run) -> Self {
        Self {
            seed: plan.seed,
            task: plan.task.clone(),
            instruction: with.card.instruction.clone(),
            as_it_should_be: !alone.outcome.success && with.outcome.success,
            policy_alone: RunSummary::of(alone),
            fit_mac: RunSummary::of(with),
        }
    }

    /// Prints the timeline of the second run, both outcomes, the cadence, and
    /// where the files are.
    pub(super) fn print(&self) {
        println!("\nDecisions with FIT-MAC:\n");
        println!("{}\n", timeline::table(&self.fit_mac.timeline, width()));
        println!(
            "Task {}, seed {}: {}\n",
            self.task, self.seed, self.instruction
        );
        self.policy_alone.print(Variant::PolicyAlone);
        self.fit_mac.print(Variant::FitMac);
        let verdict = match (
            self.policy_alone.outcome.success,
            self.fit_mac.outcome.success,
        ) {
            (false, true) => "The policy alone failed; with FIT-MAC it succeeded.",
            (false, false) => "Both runs failed.",
            (true, true) => "Both runs succeeded: there was nothing to save.",
            (true, false) => "The policy alone succeeded and failed with FIT-MAC.",
        };
        println!("{verdict}");
    }
}

impl RunSummary {
    fn of(run: &Run) -> Self {
        let in_folder = |name: &str| run.folder.join(name).display().to_string();
        let logs = ["sim", "vla", "agents", "rt"].map(|role| in_folder(&format!("{role}.log")));
        Self {
            outcome: run.outcome.clone(),
            interventions: Interventions::of(run),
            cadence: run.cadence.clone(),
            files: Files {
                trace: run.trace.display().to_string(),
                pictures: run
                    .outcome
                    .pictures
                    .iter()
                    .map(|name| in_folder(name))
                    .collect(),
                logs: logs.into(),
            },
            timeline: timeline::rows(&run.decisions, &run.card.names()),
        }
    }

    fn print(&self, variant: Variant) {
        let Self {
            outcome,
            interventions,
            cadence,
            files,
            ..
        } = self;
        let result = if outcome.success {
            "success"
        } else {
            "failure"
        };
        let lifted = outcome.lifted.as_deref().unwrap_or("nothing");
        println!("{}: {result}", variant.title());
        println!(
            "  episode        {} policy steps in {:.1} s, first lifted {lifted}",
            outcome.steps, outcome.seconds
        );
        println!(
            "  interventions  {} execution, {} target; {} of {} queries corrected, {} steps replaced",
            interventions.execution_corrections,
            interventions.target_corrections,
            interventions.corrected_queries,
            interventions.queries,
            outcome.replaced_steps,
        );
        println!(
            "  control loop   {} Hz, {} ticks, late by p50 {:.1}, p99 {:.1}, p99.9 {:.1}, max \
             {:.1} us; {} overruns; {}",
            cadence.rate_hz,
            cadence.ticks,
            cadence.p50_us,
            cadence.p99_us,
            cadence.p999_us,
            cadence.max_us,
            cadence.overruns,
            if cadence.real_time {
                "real-time scheduling"
            } else {
                "no real-time scheduling"
            },
        );
        if outcome.late_steps > 0 {
            println!(
                "  simulator      {} physics steps began late",
                outcome.late_steps
            );
        }
        println!("  trace          {}", files.trace);
        for picture in &files.pictures {
            println!("  picture        {picture}");
        }
        println!();
    }
}

impl Interventions {
    fn of(run: &Run) -> Self {
        let queries = run
            .decisions
            .iter()
            .filter(|record| record.kind == EventKind::Query.code());
        let mut found = Self {
            execution_corrections: 0,
            target_corrections: 0,
            corrected_queries: 0,
            queries: 0,
        };
        for record in queries {
            found.queries += 1;
            match Route::try_from(record.route) {
                Ok(Route::Execution) => {
                    found.execution_corrections += 1;
                    found.corrected_queries += 1;
                }
                Ok(Route::Pending) => found.corrected_queries += 1,
                Ok(Route::Target) if record.reasons & reason::INITIAL_GROUNDING == 0 => {
                    found.target_corrections += 1;
                }
                Ok(Route::Target | Route::Base) | Err(_) => {}
            }
        }
        found
    }
}

/// Columns of the terminal.
fn width() -> u16 {
    let stdout = std::io::stdout();
    let asked = stdout
        .is_terminal()
        .then(|| rustix::termios::tcgetwinsize(&stdout));
    match asked {
        Some(Ok(size)) if size.ws_col >= 80 => size.ws_col,
        _ => WIDTH,
    }
}
