//! What a process holds of the system.

use std::{
    fmt, fs, io,
    path::{Path, PathBuf},
    time::Duration,
};

use fitmac_rt::instance::Instance;

/// What the controller holds at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// When, since the beginning.
    pub at: Duration,
    /// Memory in RAM, KiB.
    pub resident_kib: u64,
    /// Open files.
    pub open_files: u64,
    /// Threads.
    pub threads: u64,
    /// Files of the instance, on disk and in shared memory.
    pub instance_files: u64,
    /// Size of the trace, MiB.
    pub trace_mib: u64,
}

impl Sample {
    /// Looks at a process, its instance and its trace.
    ///
    /// # Errors
    /// If the process has ended.
    pub fn take(at: Duration, pid: u32, instance: &Instance, trace: &Path) -> io::Result<Self> {
        let process = PathBuf::from(format!("/proc/{pid}"));
        let status = fs::read_to_string(process.join("status"))?;
        let of = |key: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(key));
            let number = line.and_then(|rest| rest.split_whitespace().next()?.parse().ok());
            number.ok_or_else(|| io::Error::other(format!("no {key} in the status")))
        };
        Ok(Self {
            at,
            resident_kib: of("VmRSS:")?,
            open_files: fs::read_dir(process.join("fd"))?.count() as u64,
            threads: of("Threads:")?,
            instance_files: instance.files().len() as u64,
            trace_mib: fs::metadata(trace)?.len() >> 20,
        })
    }
}

impl fmt::Display for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:>5} s: {} KiB resident, {} open files, {} threads, {} files of the instance, \
             trace {} MiB",
            self.at.as_secs(),
            self.resident_kib,
            self.open_files,
            self.threads,
            self.instance_files,
            self.trace_mib
        )
    }
}
