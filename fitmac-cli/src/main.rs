//! `fitmac`: the one front door.
//!
//! One file a command in [`cmd`], each with its `Args` and `run`. A command
//! returns an [`Exit`] or an error; [`exit::status_of`] turns an error into an
//! exit status.

mod card;
mod cmd;
mod config;
mod crew;
mod episode;
mod exit;
mod timeline;

use std::process::ExitCode;

use anyhow::{Context, anyhow};
use clap::{Parser, Subcommand};
use exit::Exit;
use rustix::{
    event::{PollFd, PollFlags, poll},
    process::{Pid, PidfdFlags, Signal, getpid, getppid, kill_process, pidfd_open},
};

/// Runtime assurance for robots that run a vision-language-action policy.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Examples:
  fitmac demo --seed 3         a policy fails, then FIT-MAC saves it
  fitmac doctor                what the machine lacks for real time
  fitmac help demo             all about one command

Exit status:
  0    done
  1    ran to its end, but the answer is no (a check failed, runs differ)
  2    wrong usage: an argument, a configuration or an input file
  3    the machine or another process got in the way
  130  interrupted

FIT-MAC is not a safety function: keep the robot's own stops in place."
)]
struct Cli {
    /// End when the process with this id does: it is our supervisor.
    #[arg(long, hide = true, value_name = "PID")]
    supervised: Option<i32>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run planner and grounder.
    Agents(cmd::agents::Args),
    /// Print the parameters, check a file, print the reference.
    Config(cmd::config::Args),
    /// A policy fails, then FIT-MAC saves it: four processes, real time.
    Demo(cmd::demo::Args),
    /// Say what of the real-time set-up is missing and how to get it.
    Doctor(cmd::doctor::Args),
    /// Play a grid of episodes in simulated time, policy alone and with FIT-MAC.
    Eval(cmd::eval::Args),
    /// Forward kinematics and Jacobian for lines of joint coordinates.
    Fk(cmd::fk::Args),
    /// Say which object of a scene an instruction means.
    Ground(cmd::ground::Args),
    /// Inverse kinematics for lines of poses.
    Ik(cmd::ik::Args),
    /// Jerk-limited motions for lines of states, targets and limits.
    Otg(cmd::otg::Args),
    /// Split an instruction into subtasks.
    Plan(cmd::plan::Args),
    /// Run recorded inputs through the core again and compare the answers.
    Replay(cmd::replay::Args),
    /// Make tables, plots and a page of evaluation results.
    Report(cmd::report::Args),
    /// Run the controller in real time.
    Rt(cmd::rt::Args),
    /// Run the simulated robot and its world.
    Sim(cmd::sim::Args),
    /// Look into a recorded trace.
    Trace(cmd::trace::Args),
    /// Run a policy: a surrogate, or one behind an openpi server.
    Vla(cmd::vla::Args),
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(exit) => exit.into(),
        Err(error) => {
            eprintln!("fitmac: {error:#}");
            exit::status_of(&error).into()
        }
    }
}

fn run(cli: Cli) -> anyhow::Result<Exit> {
    if let Some(supervisor) = cli.supervised {
        end_with(supervisor)?;
    }
    match cli.command {
        Command::Agents(args) => cmd::agents::run(&args),
        Command::Config(args) => cmd::config::run(&args),
        Command::Demo(args) => cmd::demo::run(&args),
        Command::Doctor(args) => cmd::doctor::run(&args),
        Command::Eval(args) => cmd::eval::run(&args),
        Command::Fk(args) => cmd::fk::run(&args),
        Command::Ground(args) => cmd::ground::run(&args),
        Command::Ik(args) => cmd::ik::run(&args),
        Command::Otg(args) => cmd::otg::run(&args),
        Command::Plan(args) => cmd::plan::run(&args),
        Command::Replay(args) => cmd::replay::run(&args),
        Command::Report(args) => cmd::report::run(&args),
        Command::Rt(args) => cmd::rt::run(&args),
        Command::Sim(args) => cmd::sim::run(&args),
        Command::Trace(args) => cmd::trace::run(&args),
        Command::Vla(args) => cmd::vla::run(&args),
    }
}

/// Ends this process, in order, when its supervisor has ended.
///
/// Linux has a signal for that, but it comes once for each thread that the
/// supervisor had, and our second signal means to end at once.
fn end_with(supervisor: i32) -> anyhow::Result<()> {
    let gone = || anyhow!("the supervisor (pid {supervisor}) has ended");
    let pid = Pid::from_raw(supervisor).with_context(gone)?;
    let handle = pidfd_open(pid, PidfdFlags::empty()).with_context(gone)?;
    // It may have ended, and its number be given to another, before that.
    if getppid() != Some(pid) {
        return Err(gone());
    }
    std::thread::spawn(move || {
        let mut ends = [PollFd::new(&handle, PollFlags::IN)];
        while poll(&mut ends, None).is_err() {} // interrupted by a signal
        // Cannot fail: it goes to ourselves.
        let _ = kill_process(getpid(), Signal::TERM);
    });
    Ok(())
}
