//! The core's tests, and what they share: a toy world, a swarm of faults, raw bytes, a second model
//! of the specification. It knows only the core, so that an edit of the core is tested in seconds.

pub mod bytes;
pub mod invariants;
pub mod model;
pub mod replay;
pub mod soak;
pub mod swarm;
pub mod world;

use std::path::{Path, PathBuf};

/// The root of the workspace.
#[must_use]
pub fn workspace_root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors()
        .nth(2)
        .map_or_else(PathBuf::new, Path::to_path_buf)
}
