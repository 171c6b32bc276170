//! What a thread needs from the system to be in time, asked for and checked.
#![allow(unsafe_code)]

use std::{fs::File, io, io::Write as _};

use rustix::{
    mm::{MlockAllFlags, mlockall},
    thread::{CpuSet, sched_getaffinity, sched_setaffinity},
};

/// What to ask the system for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealTime {
    /// Priority of the real-time scheduler SCHED_FIFO, 1 to 99; none for the
    /// ordinary one. Default 80: above everything of the user's, below the
    /// kernel's own threads (99) and the usual place of interrupt threads is 50.
    pub priority: Option<u8>,
    /// The core to stay on; none to let the system choose. Default: the last
    /// core that the process may use, as the first one serves most interrupts.
    pub core: Core,
    /// Keep all memory in RAM, and touch the stack and the buffers before the
    /// start. Default true.
    pub lock_memory: bool,
    /// Keep the processors out of deep sleep while we run. Default true; not
    /// counted as missing where the system has no such switch.
    pub stay_awake: bool,
    /// Run even if something was refused. Default false.
    pub allow_non_rt: bool,
}

/// Which core to stay on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// The last one that the process may use.
    Last,
    /// This one.
    Number(usize),
    /// Whichever the system chooses.
    Any,
}

impl Default for RealTime {
    fn default() -> Self {
        Self {
            priority: Some(80),
            core: Core::Last,
            lock_memory: true,
            stay_awake: true,
            allow_non_rt: false,
        }
    }
}

/// One thing that was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Measure {
    /// What.
    pub what: &'static str,
    /// What came of it.
    pub outcome: Outcome,
}

/// What came of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Granted, and read back.
    Granted(String),
    /// Not asked for.
    Off,
    /// Refused: why, and what to do.
    Refused {
        /// What the system said.
        why: String,
        /// How to get it.
        remedy: &'static str,
    },
    /// Refused or absent, but only latency suffers.
    Absent(String),
}

/// The set-up of a thread; it holds what must stay open.
#[derive(Debug)]
pub struct Prepared {
    /// What was asked for, and what came of it.
    pub measures: Vec<Measure>,
    _awake: Option<File>,
}

/// The system refused part of the set-up.
#[derive(Debug, thiserror::Error)]
#[error(
    "the loop cannot run in real time:\n{}\nRun `fitmac doctor` for the whole picture, or give --allow-non-rt to run without.",
    list(.0)
)]
pub struct NotRealTime(pub Vec<Measure>);

fn list(measures: &[Measure]) -> String {
    measures
        .iter()
        .filter_map(|m| match &m.outcome {
            Outcome::Refused { why, remedy } => Some(format!("  {}: {why}; {remedy}", m.what)),
            _ => None,
        })
        .collect::<Vec<_>>()
        .join("\n")
}

impl core::fmt::Display for Measure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let what = self.what;
        match &self.outcome {
            Outcome::Granted(how) => write!(f, "{what}: {how}"),
            Outcome::Off => write!(f, "{what}: not asked for"),
            Outcome::Refused { why, .. } => write!(f, "{what}: REFUSED ({why})"),
            Outcome::Absent(why) => write!(f, "{what}: absent ({why})"),
        }
    }
}

impl RealTime {
    /// For tests and machines without permissions: asks for nothing.
    #[must_use]
    pub fn off() -> Self {
        Self {
            priority: None,
            core: Core::Any,
            lock_memory: false,
            stay_awake: false,
            allow_non_rt: true,
        }
    }

    /// Prepares the calling thread.
    ///
    /// # Errors
    /// If something was refused and `allow_non_rt` is not set; everything that
    /// was refused is named at once.
    pub fn prepare(&self) -> Result<Prepared, NotRealTime> {
        let (awake, awake_measure) = self.stay_awake();
        let measures = vec![
            self.pin(),
            self.lock_memory(),
            self.schedule(),
            awake_measure,
        ];
        let refused = measures
            .iter()
            .any(|m| matches!(m.outcome, Outcome::Refused { .. }));
        if refused && !self.allow_non_rt {
            return Err(NotRealTime(measures));
        }
        Ok(Prepared {
            measures,
            _awake: awake,
        })
    }

    fn pin(&self) -> Measure {
        let outcome = match self.core {
            Core::Any => Outcome::Off,
            Core::Last => pin_to(last_core()),
            Core::Number(core) => pin_to(Ok(core)),
        };
        Measure {
            what: "core",
            outcome,
        }
    }

    fn lock_memory(&self) -> Measure {
        let outcome = if self.lock_memory {
            match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE) {
                Ok(()) => {
                    touch_stack();
                    Outcome::Granted("all pages, now and later".into())
                }
                Err(e) => Outcome::Refused {
                    why: e.to_string(),
                    remedy: "raise the limit (`@realtime - memlock unlimited` in /etc/security/limits.d) or grant CAP_IPC_LOCK",
                },
            }
        } else {
            Outcome::Off
        };
        Measure {
            what: "locked memory",
            outcome,
        }
    }

    fn schedule(&self) -> Measure {
        let outcome = match self.priority {
            None => Outcome::Off,
            Some(priority) => match set_fifo(priority) {
                Ok(()) => Outcome::Granted(format!("priority {priority}")),
                Err(e) => Outcome::Refused {
                    why: e.to_string(),
                    remedy: "raise the limit (`@realtime - rtprio 98` in /etc/security/limits.d) or grant CAP_SYS_NICE",
                },
            },
        };
        Measure {
            what: "SCHED_FIFO",
            outcome,
        }
    }

    fn stay_awake(&self) -> (Option<File>, Measure) {
        let what = "no deep sleep";
        if !self.stay_awake {
            let outcome = Outcome::Off;
            return (None, Measure { what, outcome });
        }
        // The request stands while the file is open (the kernel's PM QoS).
        let opened = File::options()
            .write(true)
            .open("/dev/cpu_dma_latency")
            .and_then(|mut file| file.write_all(&0_i32.to_ne_bytes()).map(|()| file));
        match opened {
            Ok(file) => (
                Some(file),
                Measure {
                    what,
                    outcome: Outcome::Granted("while we run".into()),
                },
            ),
            Err(e) => (
                None,
                Measure {
                    what,
                    outcome: Outcome::Absent(e.to_string()),
                },
            ),
        }
    }
}

/// The cores that the calling thread may use.
#[must_use]
pub fn allowed_cores() -> Vec<usize> {
    sched_getaffinity(None).map_or_else(
        |_| Vec::new(),
        |set| (0..CpuSet::MAX_CPU).filter(|&c| set.is_set(c)).collect(),
    )
}

/// Keeps the calling thread on these cores; best effort, for threads that
/// shall stay out of the control thread's way.
pub fn keep_off(core: usize) {
    let others: Vec<usize> = allowed_cores().into_iter().filter(|&c| c != core).collect();
    if !others.is_empty() {
        let mut set = CpuSet::new();
        others.iter().for_each(|&c| set.set(c));
        // Refused or not, the work gets done; only latency suffers.
        let _ = sched_setaffinity(None, &set);
    }
}

fn last_core() -> Result<usize, String> {
    allowed_cores()
        .last()
        .copied()
        .ok_or_else(|| "the process may use no core".to_owned())
}

fn pin_refused(why: String) -> Outcome {
    Outcome::Refused {
        why,
        remedy: "allow the core to the process (taskset, cpuset or container limit), or choose another with --core",
    }
}

fn pin_to(core: Result<usize, String>) -> Outcome {
    let pinned = core.and_then(|core| {
        if core >= CpuSet::MAX_CPU {
            return Err(format!("there is no core {core}"));
        }
        let mut set = CpuSet::new();
        set.set(core);
        sched_setaffinity(None, &set).map_err(|e| format!("core {core}: {e}"))?;
        match allowed_cores().as_slice() {
            [one] if *one == core => Ok(core),
            other => Err(format!(
                "core {core} was asked for, the system gave {other:?}"
            )),
        }
    });
    pinned.map_or_else(pin_refused, |core| {
        Outcome::Granted(format!("number {core}"))
    })
}

/// Puts the calling thread under SCHED_FIFO, and reads it back.
fn set_fifo(priority: u8) -> io::Result<()> {
    let param = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: `param` outlives the call; 0 names the calling thread.
    if unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const param) } != 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: takes no pointers.
    match unsafe { libc::sched_getscheduler(0) } {
        libc::SCHED_FIFO => Ok(()),
        other => Err(io::Error::other(format!(
            "the scheduler stayed at policy {other}"
        ))),
    }
}

/// Touches more stack than a tick will use, so that it has no page fault.
#[inline(never)]
fn touch_stack() {
    const BYTES: usize = 256 * 1024;
    let mut area = [0_u8; BYTES];
    for page in area.chunks_mut(4096) {
        page[0] = 1;
    }
    core::hint::black_box(&mut area);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_an_error_unless_allowed() {
        let impossible = RealTime {
            core: Core::Number(CpuSet::MAX_CPU + 1),
            ..RealTime::off()
        };
        let strict = RealTime {
            allow_non_rt: false,
            ..impossible.clone()
        };
        let error = strict.prepare().expect_err("there is no such core");
        assert!(error.to_string().contains("--core"), "{error}");
        let prepared = impossible.prepare().expect("allowed");
        assert!(matches!(
            prepared.measures[0].outcome,
            Outcome::Refused { .. }
        ));
    }

    #[test]
    fn a_thread_stays_on_the_core_that_it_asked_for() {
        std::thread::spawn(|| {
            let prepared = RealTime {
                core: Core::Last,
                ..RealTime::off()
            }
            .prepare()
            .expect("every machine has a core");
            assert!(matches!(prepared.measures[0].outcome, Outcome::Granted(_)));
            assert_eq!(allowed_cores().len(), 1);
        })
        .join()
        .expect("no panic");
    }
}
