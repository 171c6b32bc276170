//! `fitmac`: the one front door.

use clap::{Parser, Subcommand};

/// Runtime assurance for robots that run a vision-language-action policy.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {}

fn main() -> anyhow::Result<()> {
    match Cli::parse().command {}
}
