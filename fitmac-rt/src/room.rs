//! Room in shared memory.
//!
//! The files there are sparse: one can be made where nothing fits, and whoever
//! touches a page that the system cannot find dies of SIGBUS. So room is looked
//! for before an instance is joined, and taken before the control loop starts.

use std::{
    fs::{self, OpenOptions},
    io,
    os::unix::fs::MetadataExt,
    path::Path,
};

use rustix::{
    fs::{FallocateFlags, fallocate, statvfs},
    io::Errno,
};

use crate::instance::{Instance, InstanceError};

/// Where shared memory is.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// What all processes of an instance take together, bytes, and then some.
const NEEDED: u64 = 16 << 20;
/// The system counts a file's memory in blocks of so many bytes.
const BLOCK: u64 = 512;

impl Instance {
    /// Whether there is room for all of the instance, beside what it has already.
    ///
    /// # Errors
    /// If there is not.
    pub(crate) fn look_for_room(&self) -> Result<(), InstanceError> {
        let free = free().map_err(|error| self.unusable(Path::new(SHARED_MEMORY), &error))?;
        let files = self.shared_memory_files();
        let has: u64 = files
            .iter()
            .filter_map(|file| fs::metadata(file).ok())
            .map(|file| file.blocks() * BLOCK)
            .sum();
        match free {
            Some(free) if free < NEEDED.saturating_sub(has) => Err(no_room(free)),
            _ => Ok(()),
        }
    }

    /// Gives every page of the instance's shared files memory that nobody takes
    /// away again. To be called before a control loop starts.
    ///
    /// # Errors
    /// If there is too little.
    pub fn take_memory(&self) -> Result<(), InstanceError> {
        for file in self.shared_memory_files() {
            take(&file).map_err(|error| match error.kind() {
                io::ErrorKind::StorageFull => no_room(free().ok().flatten().unwrap_or(0)),
                _ => self.unusable(&file, &error),
            })?;
        }
        Ok(())
    }

    fn unusable(&self, what: &Path, error: &io::Error) -> InstanceError {
        InstanceError::Transport {
            root: self.root().to_owned(),
            detail: format!("{}: {error}", what.display()),
        }
    }
}

fn no_room(free: u64) -> InstanceError {
    InstanceError::NoRoom {
        free,
        needed: NEEDED,
    }
}

/// Room that is free, bytes; `None` if there is no limit.
fn free() -> io::Result<Option<u64>> {
    let of = statvfs(SHARED_MEMORY)?;
    // A limit of zero blocks is none.
    Ok((of.f_blocks > 0).then(|| of.f_bavail.saturating_mul(of.f_frsize)))
}

/// Gives all of a file memory. One that is gone by now needs none.
fn take(file: &Path) -> io::Result<()> {
    let opened = match OpenOptions::new().read(true).write(true).open(file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        opened => opened?,
    };
    let length = opened.metadata()?.len();
    if length == 0 {
        return Ok(());
    }
    loop {
        match fallocate(&opened, FallocateFlags::empty(), 0, length) {
            Err(Errno::INTR) => {}
            // Where a file system cannot do it, a page is given when it is touched.
            Err(Errno::OPNOTSUPP) | Ok(()) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_an_error_and_no_signal() {
        let instance = Instance::temporary().expect("a temporary instance");
        let path = Path::new(SHARED_MEMORY).join(format!("{}test", instance.prefix()));
        let file = fs::File::create(&path).expect("a file there");
        file.set_len(1 << 20).expect("it is sparse");
        instance.take_memory().expect("a megabyte fits");
        let blocks = file.metadata().expect("it is open").blocks();
        assert_eq!(blocks * BLOCK, 1 << 20, "all of it is there");
        // Far more than any machine has.
        file.set_len(1 << 50).expect("it is sparse");
        let error = instance.take_memory().expect_err("it cannot fit");
        assert!(matches!(error, InstanceError::NoRoom { .. }), "{error}");
        fs::remove_file(&path).expect("it is there");
        take(&path).expect("what is gone needs no room");
    }
}
