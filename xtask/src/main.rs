//! `cargo xtask`: set-up and the project's commands.
//!
//! One file a command in [`cmd`]. What the commands share: where things are
//! ([`workspace`]), Python ([`python`]), MuJoCo's library ([`mujoco`]), the
//! environment of the test oracles ([`oracles`]), a compiler for bare metal
//! ([`bare_rust`]), Debian's packages ([`debian`]), cargo's tools ([`tool`]), the ticks that tools
//! watch ([`ticks`]), lists of exceptions with their reasons ([`lists`]) and child processes
//! ([`process`]).

mod bare_rust;
mod cmd;
mod debian;
mod lists;
mod mujoco;
mod oracles;
mod process;
mod python;
mod ticks;
mod tool;
mod workspace;

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use workspace::Workspace;

/// Set-up and the project's commands.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    about,
    after_help = "Examples:
  cargo xtask demo             fetch what is missing, build, run the demo
  cargo xtask demo --seed 7    the same in another scene
  cargo xtask test             every test of the workspace
  cargo xtask ci               what continuous integration runs

Exit status: 0 done, 1 failed, 2 wrong usage. `demo` and `bench` give the status
of the program that they start."
)]
struct Cli {
    /// The workspace to work on, instead of the one this command was built from.
    #[arg(long, global = true, hide = true, value_name = "DIR")]
    root: Option<PathBuf>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fetch MuJoCo's library, once.
    Setup(cmd::setup::Args),
    /// Build and run the demo: the policy alone fails, then FIT-MAC saves it.
    Demo(cmd::demo::Args),
    /// Set up the test oracles and run every test of the workspace.
    Test(cmd::test::Args),
    /// Formatting, lints, documentation and every test.
    Ci(cmd::ci::Args),
    /// Build and run one benchmark, or list them.
    Bench(cmd::bench::Args),
    /// Build the core for two targets without an operating system (minutes).
    BareMetal(cmd::bare_metal::Args),
    /// Compare the answers of four builds to the same inputs, bit for bit (minutes).
    ReplayIdentity(cmd::replay_identity::Args),
    /// Run ticks under the real-time sanitizer (nightly compiler, a minute).
    Rtsan(cmd::rtsan::Args),
    /// Print the deepest stack of a tick (a minute).
    Stack(cmd::stack::Args),
    /// Build the C library and install it with its headers and package files.
    Install(cmd::install::Args),
    /// Write the documents that the code prints, or check them.
    Docs(cmd::docs::Args),
    /// Run the core under faults drawn from seeds; a failure names its seed.
    Swarm(cmd::swarm::Args),
    /// Feed the core raw bytes and check every tick (a minute; `--minutes N`).
    Fuzz(cmd::fuzz::Args),
    /// Compare the core with a second one, tick by tick (10 million ticks: two minutes).
    Soak(cmd::soak::Args),
    /// Change the core in every small way and see that a test notices (hours; resumable).
    Mutants(cmd::mutants::Args),
    /// Say which lines of the core no test reaches (minutes).
    Coverage(cmd::coverage::Args),
    /// Measure the reaction to every fault against real processes (2 minutes).
    Faults(cmd::faults::Args),
    /// Play every experiment of the paper and make the report (hours; it goes on where it ended).
    Evaluate(cmd::evaluate::Args),
    /// Train the surrogate that learns from demonstrations (`--out FOLDER`: six minutes).
    TrainBc(cmd::train_bc::Args),
    /// Run one controller with demo after demo around it: nothing may grow (half an hour).
    SoakRt(cmd::soak_rt::Args),
    /// Count allocations and system calls of the control thread (a million ticks: 9 minutes).
    Quiet(cmd::quiet::Args),
    /// Say what the machine lacks to build and test.
    Doctor(cmd::doctor::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let workspace = Workspace::at(cli.root);
    let result = match cli.command {
        Command::Setup(args) => cmd::setup::run(&workspace, &args),
        Command::Demo(args) => cmd::demo::run(&workspace, &args),
        Command::Test(args) => cmd::test::run(&workspace, &args),
        Command::Ci(args) => cmd::ci::run(&workspace, &args),
        Command::Bench(args) => cmd::bench::run(&workspace, &args),
        Command::BareMetal(args) => cmd::bare_metal::run(&workspace, &args),
        Command::ReplayIdentity(args) => cmd::replay_identity::run(&workspace, &args),
        Command::Rtsan(args) => cmd::rtsan::run(&workspace, &args),
        Command::Stack(args) => cmd::stack::run(&workspace, &args),
        Command::Install(args) => cmd::install::run(&workspace, &args),
        Command::Docs(args) => cmd::docs::run(&workspace, &args),
        Command::Faults(args) => cmd::faults::run(&workspace, &args),
        Command::Swarm(args) => cmd::swarm::run(&workspace, &args),
        Command::Fuzz(args) => cmd::fuzz::run(&workspace, &args),
        Command::Evaluate(args) => cmd::evaluate::run(&workspace, &args),
        Command::TrainBc(args) => cmd::train_bc::run(&workspace, &args),
        Command::Mutants(args) => cmd::mutants::run(&workspace, &args),
        Command::Coverage(args) => cmd::coverage::run(&workspace, &args),
        Command::Soak(args) => cmd::soak::run(&workspace, &args),
        Command::Quiet(args) => cmd::quiet::run(&workspace, &args),
        Command::SoakRt(args) => cmd::soak_rt::run(&workspace, &args),
        Command::Doctor(args) => cmd::doctor::run(&workspace, &args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}
