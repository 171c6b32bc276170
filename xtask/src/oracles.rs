//! The Python environment of the test oracles.
//!
//! The environment counts as made once a copy of the requirements that it was
//! made from lies in it; that copy is written last.

use std::fs;

use anyhow::{Context, bail};

use crate::{
    process::step,
    python::Python,
    workspace::{Workspace, not_writable},
};

/// Makes sure that the environment fits the pinned requirements.
pub(crate) fn install(workspace: &Workspace) -> anyhow::Result<()> {
    let requirements = [
        (workspace.oracle_requirements(), "--prefer-binary"),
        // Whole lists of what goes together, whatever the packages say.
        (workspace.link_requirements(), "--no-deps"),
    ];
    let requirements: Vec<_> = requirements
        .into_iter()
        .filter(|(file, _)| file.exists())
        .collect();
    if requirements.is_empty() {
        return Ok(()); // no oracle is in use
    }
    let mut wanted = String::new();
    for (file, _) in &requirements {
        wanted += &fs::read_to_string(file)
            .with_context(|| format!("{} cannot be read", file.display()))?;
    }
    let environment = workspace.oracle_environment();
    let made_from = environment.join("made-from-requirements.txt");
    if fs::read_to_string(&made_from).is_ok_and(|made| made == wanted) {
        return Ok(());
    }
    step(&format!(
        "Installing the test oracles into {} (once)",
        workspace.shown(&environment)
    ));
    fs::create_dir_all(&environment).map_err(|error| not_writable(&environment, &error))?;
    Python::find()?.create_environment(&environment)?;
    let python = Python::of_environment(&environment);
    for (file, option) in &requirements {
        let arguments = [
            "install",
            "--retries=2",
            "--only-binary=:all:",
            option,
            "--requirement",
        ];
        let arguments = arguments.iter().map(AsRef::as_ref);
        if !python.pip(arguments.chain([file.as_os_str()]))? {
            bail!(
                "pip could not install the test oracles (its reason is above): check the network \
                 or the proxy and run this again"
            );
        }
    }
    fs::write(&made_from, wanted).map_err(|error| not_writable(&made_from, &error))
}
