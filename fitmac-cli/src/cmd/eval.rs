//! `fitmac eval`: episodes in lockstep, on all cores, into a folder of results.

use std::{path::PathBuf, sync::atomic::AtomicBool, time::Instant};

use fitmac_rt::signals::Signals;
use indicatif::{ProgressBar, ProgressStyle};
use sim_harness::{
    SimError,
    evaluation::{
        self, Config, Destination, Grid, Knowledge, Preset, Profile, Progress, Shard, Summary,
        Vision,
    },
    perturb::{Level, Perturbation},
};

use crate::exit::{BadInput, Exit};

/// Arguments of `eval`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac eval --preset smoke --out out/smoke        a little of everything
  fitmac eval --preset main --out out/main          the paper's main table
  fitmac eval --suite object --perturbation pos,task --config base,full \\
      --seeds 1000,1001 --episodes 5 --out out/try
  fitmac eval --preset main --shard 0/4 --out out/main    a quarter, for a scheduler
  fitmac eval --suite my-suite.toml --out out/mine        tasks of your own

Each option takes several values, separated by commas. A configuration is base,
full, wo-target, wo-execution, wo-hard-pick or wo-hard-place; a parameter is
changed by adding it, as in full+gate.failure_streak=2. Results are appended to
OUT/*.jsonl as they come; the same command goes on where a killed one ended, and
presets that have episodes in common play them once if they share OUT. Results of
another build of the program are refused, as they may differ. `fitmac report OUT`
makes tables and plots of them.

Seeds 1000 to 9999 are for choosing parameters; reports use 7, 11, 13, 17, 23.")]
pub(crate) struct Args {
    /// Named experiments, played in this order: main, harm, backbones, ablation, seeds, sweeps,
    /// contrast, displacement, ablation-pi05, learned, smoke. The options below change all of them.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    preset: Vec<String>,
    /// Suites: object, spatial, or a file like sim-harness/assets/suites/object.toml.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    suite: Vec<String>,
    /// Tasks; all of the suite if left out.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    task: Vec<String>,
    /// Perturbations: none, task, pos, obj, sem, env.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    perturbation: Vec<String>,
    /// Displaces the thing that pos moves by these distances instead, m.
    #[arg(long, value_delimiter = ',', value_name = "METRES")]
    displace: Vec<f64>,
    /// Scales the target by these factors instead of obj's own variant.
    #[arg(long, value_delimiter = ',', value_name = "FACTORS")]
    scale: Vec<f64>,
    /// Surrogates: openvla-like, pi0-like, pi05-like, bc (learned), and controls.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    backbone: Vec<String>,
    /// Configurations of the controller.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    config: Vec<String>,
    /// Profiles: guarded, paper.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    profile: Vec<String>,
    /// What the controller sees: truth, modelled.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    perception: Vec<String>,
    /// Who grounds the instruction: agents (the project's own), simulator (the answer).
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    knowledge: Vec<String>,
    /// Seeds.
    #[arg(long, value_delimiter = ',', value_name = "NUMBERS")]
    seeds: Vec<u64>,
    /// Episodes a task and seed.
    #[arg(long, value_name = "NUMBER")]
    episodes: Option<u32>,
    /// The folder for results.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Run share I of N only, from 0.
    #[arg(long, value_name = "I/N", default_value = "0/1")]
    shard: String,
    /// Count episodes of these builds as played: for changes that decide nothing.
    #[arg(long, value_delimiter = ',', value_name = "BUILDS")]
    accept_build: Vec<String>,
    /// Threads; 0 for all cores.
    #[arg(long, default_value_t = 0)]
    jobs: usize,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs what is missing.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let grids = grids(args).map_err(|error| BadInput(error.to_string()))?;
    let shard = Shard::parse(&args.shard).map_err(|error| BadInput(error.to_string()))?;
    let signals = Signals::listen()?;
    let stop = AtomicBool::new(false);
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template(
        "{pos} of {len} episodes, {elapsed} so far, {eta} left  {msg}",
    )?);
    let began = Instant::now();
    let successes = std::sync::atomic::AtomicUsize::new(0);
    let watch = |progress: Progress<'_>| {
        use std::sync::atomic::Ordering::Relaxed;
        stop.store(signals.stop_requested(), Relaxed);
        bar.set_length(progress.total as u64);
        match progress.last {
            None => {
                bar.set_position(progress.done as u64);
                // What was found cost no time: it must not flatter the estimate.
                bar.reset_eta();
            }
            Some(record) => {
                let won = successes.fetch_add(usize::from(record.success), Relaxed)
                    + usize::from(record.success);
                bar.set_position(progress.done as u64);
                bar.set_message(format!("{won} succeeded"));
            }
        }
    };
    let destination = Destination {
        folder: &args.out,
        shard,
        accepted_builds: &args.accept_build,
    };
    let summary =
        evaluation::run(&grids, &destination, args.jobs, &stop, &watch).map_err(explained)?;
    bar.finish_and_clear();
    print(args, &summary, began.elapsed().as_secs_f64());
    Ok(if summary.stopped {
        Exit::Interrupted
    } else {
        Exit::Done
    })
}

/// The error with its exit status, and what became of the episodes.
fn explained(error: SimError) -> anyhow::Error {
    if error.is_bad_input() {
        return BadInput(error.to_string()).into();
    }
    let unwritten = matches!(error, SimError::Io { .. });
    let error = anyhow::Error::new(error);
    if unwritten {
        error.context(
            "results could not be written; finished episodes are kept: make room, or give another \
             --out, and the same command goes on",
        )
    } else {
        error
    }
}

fn print(args: &Args, summary: &Summary, wall_s: f64) {
    let speed = summary.simulated_s / wall_s.max(1e-9);
    if args.json {
        let value = serde_json::json!({
            "total": summary.total,
            "found": summary.found,
            "run": summary.run,
            "successes": summary.successes,
            "stopped": summary.stopped,
            "simulated_s": summary.simulated_s,
            "wall_s": wall_s,
            "out": args.out,
        });
        println!("{value}");
        return;
    }
    println!(
        "{} of {} episodes run now, {} found; {} of those run succeeded",
        summary.run, summary.total, summary.found, summary.successes
    );
    println!(
        "{:.0} simulated seconds in {wall_s:.0} s: {speed:.0} times real time on all threads",
        summary.simulated_s
    );
    if summary.stopped {
        println!("interrupted: the same command goes on from here");
    } else {
        println!(
            "results in {}; `fitmac report {0}` shows them",
            args.out.display()
        );
    }
}

/// The grids that the arguments ask for.
fn grids(args: &Args) -> Result<Vec<Grid>, SimError> {
    if args.preset.is_empty() {
        let plain = Grid {
            perturbations: Vec::new(),
            ..Preset::Smoke.grid()?
        };
        return Ok(vec![changed(plain, args)?]);
    }
    let presets = args.preset.iter().map(|name| Preset::by_name(name)?.grid());
    presets.map(|grid| changed(grid?, args)).collect()
}

/// A grid with what the options say of it.
fn changed(mut grid: Grid, args: &Args) -> Result<Grid, SimError> {
    let replace = |slot: &mut Vec<String>, given: &[String]| {
        if !given.is_empty() {
            *slot = given.to_vec();
        }
    };
    replace(&mut grid.suites, &args.suite);
    replace(&mut grid.tasks, &args.task);
    replace(&mut grid.backbones, &args.backbone);
    let perturbations = perturbations(args)?;
    if !perturbations.is_empty() {
        grid.perturbations = perturbations;
    }
    if grid.perturbations.is_empty() {
        grid.perturbations = vec![(Perturbation::None, Level::Standard)];
    }
    if !args.config.is_empty() {
        grid.configs = args
            .config
            .iter()
            .map(|c| Config::parse(c))
            .collect::<Result<_, _>>()?;
    }
    if !args.profile.is_empty() {
        grid.profiles = args
            .profile
            .iter()
            .map(|p| Profile::by_name(p))
            .collect::<Result<_, _>>()?;
    }
    if !args.perception.is_empty() {
        grid.visions = args
            .perception
            .iter()
            .map(|v| Vision::by_name(v))
            .collect::<Result<_, _>>()?;
    }
    if !args.knowledge.is_empty() {
        grid.knowledges = args
            .knowledge
            .iter()
            .map(|k| Knowledge::by_name(k))
            .collect::<Result<_, _>>()?;
    }
    if !args.seeds.is_empty() {
        grid.seeds.clone_from(&args.seeds);
    }
    grid.episodes = args.episodes.unwrap_or(grid.episodes);
    // Names are checked before the first episode runs.
    grid.episodes()?;
    Ok(grid)
}

fn perturbations(args: &Args) -> Result<Vec<(Perturbation, Level)>, SimError> {
    let mut list = Vec::new();
    for name in &args.perturbation {
        let perturbation = Perturbation::by_name(name)?;
        match perturbation {
            Perturbation::Pos if !args.displace.is_empty() => {
                list.extend(
                    args.displace
                        .iter()
                        .map(|d| (perturbation, Level::DisplacedM(*d))),
                );
            }
            Perturbation::Obj if !args.scale.is_empty() => {
                list.extend(args.scale.iter().map(|s| (perturbation, Level::Scaled(*s))));
            }
            _ => list.push((perturbation, Level::Standard)),
        }
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn parse(line: &str) -> Result<Grid, SimError> {
        let words = std::iter::once("eval").chain(line.split_whitespace());
        Ok(grids(&Line::try_parse_from(words).unwrap().args)?.remove(0))
    }

    #[test]
    fn options_take_several_values_and_change_a_preset() {
        let grid = parse("--preset main --suite object --seeds 7,11 --episodes 3 --out x").unwrap();
        assert_eq!(grid.suites, ["object"]);
        assert_eq!((grid.seeds.as_slice(), grid.episodes), (&[7, 11][..], 3));
        assert_eq!(grid.perturbations.len(), 6, "the preset's own");
        let words = [
            "eval",
            "--preset",
            "main,harm",
            "--seeds",
            "1000",
            "--out",
            "x",
        ];
        let two = grids(&Line::try_parse_from(words).unwrap().args).unwrap();
        assert_eq!((two.len(), two[1].backbones.len()), (2, 4));
        assert!(two.iter().all(|grid| grid.seeds == [1000]));
        let line = "--suite object --perturbation pos --displace 0.05,0.1 --config base --out x";
        let grid = parse(line).unwrap();
        assert_eq!(
            grid.perturbations[1],
            (Perturbation::Pos, Level::DisplacedM(0.1))
        );
        let plain = parse("--out x").unwrap();
        assert_eq!(plain.perturbations, [(Perturbation::None, Level::Standard)]);
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_right_ones() {
        let error = |line: &str| parse(line).unwrap_err().to_string();
        assert!(error("--suite goal --out x").contains("spatial"));
        assert!(error("--perturbation colour --out x").contains("env"));
        assert!(error("--config half --out x").contains("wo-target"));
        assert!(error("--preset big --out x").contains("ablation"));
        assert!(error("--profile bold --out x").contains("guarded"));
        assert!(error("--knowledge none --out x").contains("simulator"));
    }
}
