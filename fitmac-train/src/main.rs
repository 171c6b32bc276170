//! `train-bc`: trains the surrogate S4 on demonstrations made in the simulator, and tries it.
//!
//! One stage a file: [`expert`] demonstrates, [`gather`] plays the episodes, [`dataset`] keeps and
//! varies what was seen, [`learn`] fits the network, [`trial`] plays the result.

mod dataset;
mod expert;
mod gather;
mod learn;
mod trial;

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use sim_harness::backbone::bc::Network;
use sim_harness::perturb::Perturbation;
use sim_harness::suite::Suite;

use gather::Round;
use learn::{Pace, Training};

/// Seeds of one round do not reach those of the next.
const SEEDS_A_ROUND: u64 = 100_000;

/// Share of the answers in which the expert helps.
const HELP: f64 = 0.3;

/// Train the surrogate policy S4 by behaviour cloning.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Example:
  cargo xtask train-bc --out out/bc

Six minutes of processor time, on two cores. The committed weights are those of the defaults. The
same options give the same weights on machines with the same kind of processor."
)]
struct Args {
    /// Suites to train on, one network each, at the same time.
    #[arg(long, value_delimiter = ',', default_values_t = ["object".to_owned(), "spatial".to_owned()])]
    suite: Vec<String>,
    /// Episodes a task that the expert plays first.
    #[arg(long, default_value_t = 25)]
    demonstrations: u32,
    /// Rounds in which the network plays and the expert corrects it.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// Episodes a task in each of them.
    #[arg(long, default_value_t = 10)]
    episodes: u32,
    /// Steps of learning before each of them.
    #[arg(long, default_value_t = 3000)]
    steps: u32,
    /// Steps of learning at the end.
    #[arg(long, default_value_t = 15_000)]
    last_steps: u32,
    /// Draws the episodes, first weights and the order of the samples.
    #[arg(long, default_value_t = 1_000_000)]
    seed: u64,
    /// Trial episodes a task and perturbation after training.
    #[arg(long, default_value_t = 3)]
    trials: u32,
    /// Threads; a suite learns on one.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Where the weights are written, SUITE.bin.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    std::fs::create_dir_all(&args.out)
        .with_context(|| format!("{} cannot be made", args.out.display()))?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(args.jobs)
        .build_global()?;
    let suites = args
        .suite
        .iter()
        .map(|name| Suite::embedded(name))
        .collect::<Result<Vec<_>, _>>()?;
    let bars = MultiProgress::new();
    suites
        .par_iter()
        .try_for_each(|suite| make(suite, &args, &bars))
}

/// Trains on a suite, writes the weights and tries them.
fn make(suite: &Suite, args: &Args, bars: &MultiProgress) -> anyhow::Result<()> {
    let network = train(suite, args, bars)?;
    let bytes = network.to_bytes();
    let path = args.out.join(format!("{}.bin", suite.name));
    std::fs::write(&path, &bytes).with_context(|| path.display().to_string())?;
    let digest = Sha256::digest(&bytes);
    let sha256: String = digest.iter().map(|b| format!("{b:02x}")).collect();
    let (path, length) = (path.display(), bytes.len());
    say(suite, &format!("{path}: {length} bytes, SHA-256 {sha256}"));
    for perturbation in Perturbation::ALL {
        let (won, of) = trial::cell(suite, perturbation, &network, args.trials)?;
        let name = perturbation.name();
        say(suite, &format!("{name}: {won} of {of} trials succeeded"));
    }
    Ok(())
}

fn train(suite: &Suite, args: &Args, bars: &MultiProgress) -> anyhow::Result<Network> {
    let mut samples = Vec::new();
    let mut training: Option<Training> = None;
    for round in 0..=args.rounds {
        let network = training.as_ref().map(Training::network);
        let gathering = Round {
            suite,
            network: network.as_ref(),
            expert_share: expert_share(round, args.rounds),
            episodes: if round == 0 {
                args.demonstrations
            } else {
                args.episodes
            },
            seed: args.seed + u64::from(round) * SEEDS_A_ROUND,
        };
        let total = u64::from(gathering.episodes) * suite.tasks.len() as u64;
        let bar = bar(bars, total, suite, &format!("round {round}, episodes"))?;
        let gathered = gathering.play(&bar)?;
        bar.finish_and_clear();
        let (won, played) = (gathered.succeeded, gathered.played);
        samples.extend(gathered.samples);
        let learner = training.get_or_insert_with(|| Training::new(&samples, args.seed));
        let (steps, pace) = if round == args.rounds {
            (args.last_steps, Pace::Falling)
        } else {
            (args.steps, Pace::Steady)
        };
        let bar = self::bar(
            bars,
            u64::from(steps),
            suite,
            &format!("round {round}, steps"),
        )?;
        let loss = learner.fit(&samples, steps, pace, &bar);
        bar.finish_and_clear();
        let known = samples.len();
        say(
            suite,
            &format!(
                "round {round}: {won} of {played} episodes succeeded, {known} samples, loss {loss:.4}"
            ),
        );
    }
    training
        .map(|t| t.network())
        .context("there is no round of training")
}

/// Share of the answers that the expert gives in a round. In all but the last it helps a little: the
/// network then sees every stage of the motion before it masters the first.
fn expert_share(round: u32, rounds: u32) -> f64 {
    match round {
        0 => 1.0,
        _ if round < rounds => HELP,
        _ => 0.0,
    }
}

fn say(suite: &Suite, what: &str) {
    println!("{}: {what}", suite.name);
}

fn bar(
    bars: &MultiProgress,
    length: u64,
    suite: &Suite,
    what: &str,
) -> anyhow::Result<ProgressBar> {
    let style = ProgressStyle::with_template("{msg} {pos} of {len}, {elapsed} so far, {eta} left")?;
    let bar = ProgressBar::new(length)
        .with_style(style)
        .with_message(format!("{}: {what}", suite.name));
    Ok(bars.add(bar))
}
