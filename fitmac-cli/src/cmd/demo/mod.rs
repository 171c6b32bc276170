//! `fitmac demo`: a policy fails, then FIT-MAC saves it.
//!
//! Two runs of the same scene, each with four processes on shared memory in
//! wall-clock time: first the policy alone (all corrections switched off),
//! then with FIT-MAC.

mod run;
mod status;
mod summary;

use std::{fs, path::PathBuf};

use fitmac_rt::signals::Signals;

use crate::{
    episode::{self, Perturbation},
    exit::{BadInput, Exit},
};
use run::{NoRun, Plan, Variant};
use summary::Summary;

/// Arguments of `demo`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac demo                        a scene, the policy alone, then FIT-MAC
  fitmac demo --seed 7 --json        another scene, the result as JSON
  fitmac demo --task milk            a given task of the suite

The scene: a table with a basket and six things. The instruction names one of
them; it has swapped places with another one. The policy is a surrogate that
replays what it memorised, so it takes the wrong thing.

Exit status: 0 if the policy alone failed and FIT-MAC succeeded, 1 if not, 3 if
a process died or the machine got in the way, 130 after Ctrl-C.")]
pub(crate) struct Args {
    /// Draws the task, the places of things and the policy's noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A task of the suite `object`, instead of the one that the seed draws.
    #[arg(long)]
    task: Option<String>,
    /// Where traces, pictures and logs go [default: out/demo/seed-SEED].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as JSON and nothing else on standard output.
    #[arg(long)]
    json: bool,
}

/// Does both runs and compares them.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let signals = Signals::listen()?;
    run::remove_stale_instances()?;
    let plan = plan(args)?;
    let mut runs = Vec::new();
    for variant in [Variant::PolicyAlone, Variant::FitMac] {
        match plan.perform(variant, &signals) {
            Ok(run) => runs.push(run),
            Err(NoRun::Interrupted) => {
                eprintln!("fitmac: interrupted; all processes have ended");
                return Ok(Exit::Interrupted);
            }
            Err(NoRun::Aborted) => return Ok(Exit::Trouble),
            Err(NoRun::Failed(error)) => return Err(error),
        }
    }
    let [alone, with] = &runs[..] else {
        anyhow::bail!("the demo has two runs");
    };
    let summary = Summary::of(&plan, alone, with);
    if args.json {
        println!("{}", serde_json::to_string_pretty(&summary)?);
    } else {
        summary.print();
    }
    Ok(if summary.as_it_should_be {
        Exit::Done
    } else {
        Exit::Negative
    })
}

/// What to do and where to put it.
fn plan(args: &Args) -> anyhow::Result<Plan> {
    let episode = episode::Args {
        suite: "object".to_owned(),
        task: args.task.clone(),
        perturbation: Perturbation::Pos,
        seed: args.seed,
    };
    let task = episode.draw()?.task;
    let out = match &args.out {
        Some(out) => out.clone(),
        None => format!("out/demo/seed-{}", args.seed).into(),
    };
    fs::create_dir_all(&out).map_err(|error| {
        let out = out.display();
        BadInput(format!(
            "{out} cannot be written ({error}): choose another --out"
        ))
    })?;
    let other = task.pos.with.as_deref().unwrap_or("nothing");
    eprintln!(
        "Task: {}. The {} has changed places with the {}.",
        task.instruction,
        task.target.replace('_', " "),
        other.replace('_', " ")
    );
    Ok(Plan {
        seed: args.seed,
        task: task.name,
        out,
    })
}
