//! `cargo xtask stack`.

use crate::{ticks, workspace::Workspace};

/// Arguments of `stack`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seeds of the swarm, 1,500 ticks each.
    #[arg(long, value_name = "N", default_value_t = 60)]
    seeds: u64,
}

/// Paints the stack before every tick and looks how much of the paint is left.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let said = ticks::LTO.says(workspace, &["stack", &args.seeds.to_string()])?;
    println!("{said}");
    Ok(())
}
