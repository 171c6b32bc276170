//! `cargo xtask replay-identity`.

use anyhow::bail;

use crate::{ticks, workspace::Workspace};

/// Arguments of `replay-identity`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seeds of the swarm, 1,500 ticks each.
    #[arg(long, value_name = "N", default_value_t = 40)]
    seeds: u64,
}

/// Four builds hear the same; all their answers must be the same, bit for bit.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let seeds = args.seeds.to_string();
    let mut first = None;
    for build in [ticks::DEBUG, ticks::RELEASE, ticks::LTO, ticks::NATIVE] {
        let said = build.says(workspace, &["replay", &seeds])?;
        println!("{:<22} {said}", build.name);
        match &first {
            None => first = Some(said),
            Some(first) if *first == said => {}
            Some(_) => bail!("{} answers otherwise than debug", build.name),
        }
    }
    println!("cargo xtask replay-identity: all four builds answer alike");
    Ok(())
}
