//! `fitmac`: the one front door.
//!
//! One file a command in [`cmd`], each with its `Args` and `run`. A command
//! returns an [`exit::Exit`] or an error; [`exit::status_of`] turns an error into an
//! exit status.

mod cmd;
mod exit;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

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
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Say what of the real-time set-up is missing and how to get it.
    Doctor(cmd::doctor::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Doctor(args) => cmd::doctor::run(&args),
    };
    match result {
        Ok(exit) => exit.into(),
        Err(error) => {
            eprintln!("fitmac: {error:#}");
            exit::status_of(&error).into()
        }
    }
}
