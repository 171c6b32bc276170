//! An instance: the directory and the shared-memory prefix of one running
//! system, so that several run side by side and leave nothing behind.

use std::{
    fs::{self, File, OpenOptions},
    io,
    os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt},
    path::{Path, PathBuf},
    time::Duration,
};

use iceoryx2::prelude::{Config, FileName, Node, Path as IoxPath, SemanticString, ipc};
use rustix::fs::{FlockOperation, flock};

use crate::room::SHARED_MEMORY;

/// Longest name of an instance.
const NAME_CAPACITY: usize = 40;
/// Longest path of an instance's directory (a limit of the shared-memory library).
const ROOT_CAPACITY: usize = 180;
/// How long a clean-up waits for another process that cleans the same node.
const CLEAN_UP_WAIT: Duration = Duration::from_millis(500);

/// An instance could not be used.
#[derive(Debug, thiserror::Error)]
pub enum InstanceError {
    /// The name cannot be a directory's.
    #[error(
        "`{0}` is no name for an instance: use 1 to {NAME_CAPACITY} letters, digits, `-` or `_`"
    )]
    Name(String),
    /// The path of the directory is too long.
    #[error(
        "the instance's directory {0} has too long a path: set XDG_RUNTIME_DIR to a shorter one (at most {ROOT_CAPACITY} bytes)"
    )]
    RootTooLong(PathBuf),
    /// The directory could not be made or opened.
    #[error("the instance's directory {root} cannot be used: {source}")]
    Directory {
        /// The directory.
        root: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The directory belongs to someone else.
    #[error(
        "the instance's directory {root} belongs to user {owner}: all processes of an instance run as one user; remove it or use another --instance"
    )]
    Foreign {
        /// The directory.
        root: PathBuf,
        /// Its owner.
        owner: u32,
    },
    /// A controller runs already.
    #[error(
        "a controller already runs in {root} (process {pid}): stop it, or use another --instance"
    )]
    ControllerRuns {
        /// The directory.
        root: PathBuf,
        /// The process id that it left in its lock file.
        pid: String,
    },
    /// Shared memory has no room.
    #[error(
        "shared memory ({SHARED_MEMORY}) has {} KiB free, and an instance needs {} KiB: remove what fills it (`ls -l {SHARED_MEMORY}`; `fitmac rt clean` for what dead processes left), or enlarge it (`mount -o remount,size=64M {SHARED_MEMORY}`; for a container `--shm-size=64m`)",
        .free >> 10,
        .needed >> 10
    )]
    NoRoom {
        /// What is free, bytes.
        free: u64,
        /// What has to be, bytes.
        needed: u64,
    },
    /// The shared-memory library refused.
    #[error(
        "shared memory in {root} cannot be used: {detail}; check that /dev/shm is mounted and has room"
    )]
    Transport {
        /// The directory.
        root: PathBuf,
        /// What the library said.
        detail: String,
    },
}

/// Where one running system lives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instance {
    root: PathBuf,
}

impl Instance {
    /// The instance of this name, for the current user: in `$XDG_RUNTIME_DIR/fitmac`
    /// or, without that, `<temporary directory>/fitmac-<user id>`.
    ///
    /// # Errors
    /// If the name or the path is unfit.
    pub fn named(name: &str) -> Result<Self, InstanceError> {
        let fits = (1..=NAME_CAPACITY).contains(&name.len())
            && name
                .bytes()
                .all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_');
        if !fits {
            return Err(InstanceError::Name(name.escape_default().to_string()));
        }
        let base = match std::env::var_os("XDG_RUNTIME_DIR") {
            Some(dir) if !dir.is_empty() => PathBuf::from(dir).join("fitmac"),
            _ => {
                std::env::temp_dir().join(format!("fitmac-{}", rustix::process::getuid().as_raw()))
            }
        };
        Self::at(&base.join(name))
    }

    /// The instance in this directory.
    ///
    /// # Errors
    /// If the path is too long or not absolute.
    pub fn at(root: &Path) -> Result<Self, InstanceError> {
        let root = std::path::absolute(root).map_err(|source| InstanceError::Directory {
            root: root.to_owned(),
            source,
        })?;
        if root.as_os_str().len() > ROOT_CAPACITY {
            return Err(InstanceError::RootTooLong(root));
        }
        Ok(Self { root })
    }

    /// An instance of its own that is removed when the value is dropped.
    ///
    /// # Errors
    /// If the temporary directory cannot be used.
    pub fn temporary() -> Result<TemporaryInstance, InstanceError> {
        let base = std::env::temp_dir();
        let dir = tempfile::Builder::new()
            .prefix("fitmac-")
            .tempdir_in(&base)
            .map_err(|source| InstanceError::Directory { root: base, source })?;
        Ok(TemporaryInstance {
            instance: Self::at(dir.path())?,
            _dir: dir,
        })
    }

    /// Its directory.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The prefix of its shared-memory objects: a hash of the directory.
    #[must_use]
    pub fn prefix(&self) -> String {
        let hash = self
            .root
            .as_os_str()
            .as_encoded_bytes()
            .iter()
            .fold(0xcbf2_9ce4_8422_2325_u64, |h, &b| {
                (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
            });
        format!("fitmac_{hash:016x}_")
    }

    /// Everything of this instance that exists now, on disk and in shared memory.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let mut found = self.shared_memory_files();
        let mut open = vec![self.root.clone()];
        while let Some(dir) = open.pop() {
            for entry in fs::read_dir(&dir).into_iter().flatten().flatten() {
                let path = entry.path();
                if entry.file_type().is_ok_and(|t| t.is_dir()) {
                    open.push(path);
                } else {
                    found.push(path);
                }
            }
        }
        found.sort();
        found
    }

    pub(crate) fn shared_memory_files(&self) -> Vec<PathBuf> {
        let prefix = self.prefix();
        fs::read_dir(SHARED_MEMORY)
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix))
            .map(|entry| entry.path())
            .collect()
    }

    /// Removes what dead processes have left: all of it if no process is in
    /// the instance, else the dead ones' part. Returns whether all is gone.
    ///
    /// # Errors
    /// If the directory cannot be used.
    pub fn clean_up(&self) -> Result<bool, InstanceError> {
        if !self.root.exists() && self.shared_memory_files().is_empty() {
            return Ok(true);
        }
        drop(self.join()?);
        Ok(!self.root.join(MEMBERS).exists())
    }

    /// Enters the instance: while any member lives nobody removes its files.
    pub(crate) fn join(&self) -> Result<Membership, InstanceError> {
        self.make_root()?;
        let lock = self.lock(MEMBERS, FlockOperation::LockShared)?;
        Node::<ipc::Service>::blocking_cleanup_dead_nodes(&self.iceoryx_config()?, CLEAN_UP_WAIT);
        Ok(Membership {
            instance: self.clone(),
            lock,
        })
    }

    /// Takes the right to be the one controller, until the value is dropped.
    ///
    /// # Errors
    /// If another process has it.
    pub fn lock_controller(&self) -> Result<ControllerLock, InstanceError> {
        self.make_root()?;
        let path = self.root.join(CONTROLLER);
        match self.lock(CONTROLLER, FlockOperation::NonBlockingLockExclusive) {
            Ok(file) => {
                // For people and for the error message of a second controller.
                fs::write(&path, std::process::id().to_string())
                    .map_err(|e| self.directory_error(e))?;
                Ok(ControllerLock { path, _file: file })
            }
            Err(InstanceError::Directory { source, .. })
                if source.kind() == io::ErrorKind::WouldBlock =>
            {
                Err(InstanceError::ControllerRuns {
                    root: self.root.clone(),
                    pid: fs::read_to_string(&path).unwrap_or_default(),
                })
            }
            Err(other) => Err(other),
        }
    }

    pub(crate) fn iceoryx_config(&self) -> Result<Config, InstanceError> {
        let unusable = |detail: String| InstanceError::Transport {
            root: self.root.clone(),
            detail,
        };
        let mut config = Config::default();
        config.global.prefix =
            FileName::new(self.prefix().as_bytes()).map_err(|e| unusable(format!("{e:?}")))?;
        let root = self.root.join(SERVICES);
        config.global.set_root_path(
            &IoxPath::new(root.as_os_str().as_encoded_bytes())
                .map_err(|e| unusable(format!("{e:?}")))?,
        );
        Ok(config)
    }

    fn make_root(&self) -> Result<(), InstanceError> {
        fs::DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&self.root)
            .map_err(|e| self.directory_error(e))?;
        let owner = fs::metadata(&self.root)
            .map_err(|e| self.directory_error(e))?
            .uid();
        if owner != rustix::process::getuid().as_raw() {
            return Err(InstanceError::Foreign {
                root: self.root.clone(),
                owner,
            });
        }
        Ok(())
    }

    fn directory_error(&self, source: io::Error) -> InstanceError {
        InstanceError::Directory {
            root: self.root.clone(),
            source,
        }
    }

    /// Locks a file of the directory. The file may be removed between opening
    /// and locking: a lock counts only on the file that has the name.
    fn lock(&self, name: &str, operation: FlockOperation) -> Result<File, InstanceError> {
        let path = self.root.join(name);
        loop {
            self.make_root()?;
            let opened = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(&path);
            let file = match opened {
                Ok(file) => file,
                Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
                Err(e) => return Err(self.directory_error(e)),
            };
            flock(&file, operation).map_err(|e| self.directory_error(e.into()))?;
            let locked = file.metadata().map_err(|e| self.directory_error(e))?;
            if fs::metadata(&path).is_ok_and(|named| named.ino() == locked.ino()) {
                return Ok(file);
            }
        }
    }

    fn remove_everything(&self) {
        for path in self.shared_memory_files() {
            let _ = fs::remove_file(path);
        }
        let _ = fs::remove_dir_all(self.root.join(SERVICES));
        let _ = fs::remove_file(self.root.join(MEMBERS));
        // A controller that was killed leaves its lock file; one that lives holds it.
        let controller = self.root.join(CONTROLLER);
        if let Ok(file) = File::open(&controller)
            && flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok()
        {
            let _ = fs::remove_file(&controller);
        }
        // Only if nothing of the user's is in it.
        let _ = fs::remove_dir(&self.root);
    }
}

const MEMBERS: &str = "members.lock";
const CONTROLLER: &str = "controller.lock";
const SERVICES: &str = "services";

/// The presence of a process in an instance. The last one to leave, whatever
/// happened to the others, removes the instance's files.
pub(crate) struct Membership {
    instance: Instance,
    lock: File,
}

impl Drop for Membership {
    fn drop(&mut self) {
        if flock(&self.lock, FlockOperation::NonBlockingLockExclusive).is_ok() {
            self.instance.remove_everything();
        }
    }
}

/// The right to be the one controller of an instance.
#[derive(Debug)]
pub struct ControllerLock {
    path: PathBuf,
    _file: File,
}

impl Drop for ControllerLock {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
        // The last member may have left before us. A directory that is not
        // empty stays.
        let _ = self.path.parent().map(fs::remove_dir);
    }
}

/// An instance that is removed with the value.
#[derive(Debug)]
pub struct TemporaryInstance {
    instance: Instance,
    _dir: tempfile::TempDir,
}

impl core::ops::Deref for TemporaryInstance {
    type Target = Instance;

    fn deref(&self) -> &Instance {
        &self.instance
    }
}

impl Drop for TemporaryInstance {
    fn drop(&mut self) {
        for path in self.instance.shared_memory_files() {
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_could_leave_the_directory_are_refused() {
        for name in ["", "..", "a/b", "a b", "é", "\u{1b}[2J", &"x".repeat(41)] {
            assert!(
                matches!(Instance::named(name), Err(InstanceError::Name(_))),
                "{name:?}"
            );
        }
        assert!(Instance::named("cell-3_left").is_ok());
    }

    #[test]
    fn there_is_one_controller_and_its_lock_goes_with_it() {
        let instance = Instance::temporary().expect("a temporary instance");
        let first = instance.lock_controller().expect("free");
        let refused = instance.lock_controller().expect_err("taken");
        assert!(
            refused
                .to_string()
                .contains(&std::process::id().to_string())
        );
        drop(first);
        let again = instance.lock_controller().expect("free again");
        drop(instance.join().expect("joins"));
        drop(again);
        assert!(!instance.root().exists());
    }

    #[test]
    fn the_last_member_removes_the_files_and_not_the_users() {
        let instance = Instance::temporary().expect("a temporary instance");
        let root = instance.root().join("run");
        let instance = Instance::at(&root).expect("a short path");
        let first = instance.join().expect("joins");
        let second = instance.join().expect("joins");
        fs::write(root.join("notes.txt"), "mine").expect("writes");
        drop(first);
        assert!(root.join(MEMBERS).exists());
        drop(second);
        assert_eq!(instance.files(), vec![root.join("notes.txt")]);
        fs::remove_file(root.join("notes.txt")).expect("there");
        assert!(instance.clean_up().expect("cleans"));
        assert!(!root.exists());
    }
}
