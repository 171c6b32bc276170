//! Where things are.

use std::{
    io,
    path::{Path, PathBuf},
};

/// The checkout that the commands work on.
pub(crate) struct Workspace {
    root: PathBuf,
}

impl Workspace {
    /// The given folder, or the checkout that this program was built from.
    pub(crate) fn at(root: Option<PathBuf>) -> Self {
        let built_from = || {
            let xtask = Path::new(env!("CARGO_MANIFEST_DIR"));
            xtask.parent().unwrap_or(xtask).to_path_buf()
        };
        Self {
            root: root.unwrap_or_else(built_from),
        }
    }

    /// Its top folder.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Where MuJoCo is kept.
    pub(crate) fn mujoco(&self) -> PathBuf {
        self.root.join("third_party/mujoco")
    }

    /// The pinned packages of the test oracles.
    pub(crate) fn oracle_requirements(&self) -> PathBuf {
        self.root.join("tests/oracles/requirements.txt")
    }

    /// The pinned packages of the tests of other languages' interfaces.
    pub(crate) fn link_requirements(&self) -> PathBuf {
        self.root.join("tests/oracles/link-requirements.txt")
    }

    /// The Python environment of the test oracles.
    pub(crate) fn oracle_environment(&self) -> PathBuf {
        self.root.join(".venv")
    }

    /// A path as a person working in the checkout would write it.
    pub(crate) fn shown<'a>(&self, path: &'a Path) -> std::path::Display<'a> {
        path.strip_prefix(&self.root).unwrap_or(path).display()
    }
}

/// The sentence for a folder that cannot be written.
pub(crate) fn not_writable(folder: &Path, error: &io::Error) -> anyhow::Error {
    let folder = folder.display();
    anyhow::anyhow!(match error.kind() {
        io::ErrorKind::StorageFull => format!(
            "{folder} cannot be written, the disk is full: make room (about 4 GB for everything) \
             and run the command again"
        ),
        _ => format!(
            "{folder} cannot be written ({error}): make it writable, or clone the repository into \
             a folder of yours"
        ),
    })
}
