//! `cargo xtask bench`.

use std::{ffi::OsString, fs};

use anyhow::{Context, bail};

use crate::{mujoco, process, workspace::Workspace};

/// Arguments of `bench`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The benchmark; without it they are listed.
    name: Option<String>,
    /// Arguments of the benchmark.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Builds and becomes the benchmark.
pub(crate) fn run(workspace: &Workspace, args: &Args) -> anyhow::Result<()> {
    let known = names(workspace)?;
    let Some(name) = &args.name else {
        known.iter().for_each(|name| println!("{name}"));
        return Ok(());
    };
    if !known.contains(name) {
        bail!(
            "there is no benchmark {name:?}; there are: {}",
            known.join(", ")
        );
    }
    mujoco::install(workspace)?;
    let mut bench = process::cargo(workspace);
    bench.args([
        "bench",
        "--locked",
        "--package=fitmac-benches",
        "--bench",
        name,
        "--",
    ]);
    process::become_command(bench.args(&args.arguments))
}

/// The benchmarks: every file of `benches/benches`.
fn names(workspace: &Workspace) -> anyhow::Result<Vec<String>> {
    let folder = workspace.root().join("benches/benches");
    let entries =
        fs::read_dir(&folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            names.extend(
                path.file_stem()
                    .map(|stem| stem.to_string_lossy().into_owned()),
            );
        }
    }
    names.sort();
    Ok(names)
}
