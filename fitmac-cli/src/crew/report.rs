//! What the processes of a crew tell their supervisor.

use serde::{Deserialize, Serialize};

/// One line on the standard output of a process of the crew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "report", rename_all = "snake_case")]
pub(crate) enum Report {
    /// The process is connected and does its work.
    Ready,
    /// From the simulator, 20 times a second.
    Progress(Progress),
    /// From the simulator, once: the episode is decided.
    Over,
    /// From the simulator, at its end: how the episode ended.
    Outcome(Outcome),
    /// From the controller, at its end.
    Cadence(Cadence),
}

impl Report {
    /// Tells the supervisor. Whoever started the process by hand reads it too.
    pub(crate) fn send(&self) {
        if let Ok(line) = serde_json::to_string(self) {
            println!("{line}");
        }
    }
}

/// Where an episode stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Progress {
    /// Policy steps executed.
    pub(crate) step: u64,
    /// Policy steps after which the episode ends.
    pub(crate) steps_max: u64,
    /// The phase, as the core names it.
    pub(crate) phase: String,
    /// The route, as the core names it.
    pub(crate) route: String,
    /// The recovery's step, as the core names it.
    pub(crate) sub_phase: String,
    /// End effector to the object that the instruction means, m.
    pub(crate) target_distance_m: f64,
    /// That object to its destination, m.
    pub(crate) destination_distance_m: f64,
}

/// How an episode ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Outcome {
    /// The task's predicate held, with the object released and at rest.
    pub(crate) success: bool,
    /// Policy steps executed.
    pub(crate) steps: u64,
    /// Simulated time, s; it ran beside the wall clock.
    pub(crate) seconds: f64,
    /// Policy steps in which a base action was replaced.
    pub(crate) replaced_steps: u64,
    /// The object that was lifted, if any was, by its name in the scene.
    pub(crate) lifted: Option<String>,
    /// Physics steps that began late because the machine was busy.
    pub(crate) late_steps: u64,
    /// Pictures, by file name.
    pub(crate) pictures: Vec<String>,
}

/// How regular the control loop was. Times in microseconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cadence {
    /// Ticks per second asked for.
    pub(crate) rate_hz: u32,
    /// Ticks done.
    pub(crate) ticks: u64,
    /// Ticks that were skipped because an earlier one ended late.
    pub(crate) overruns: u64,
    /// How late ticks began, median.
    pub(crate) p50_us: f64,
    /// 99 of 100 began earlier.
    pub(crate) p99_us: f64,
    /// 999 of 1000 began earlier.
    pub(crate) p999_us: f64,
    /// The latest.
    pub(crate) max_us: f64,
    /// Whether the loop had real-time scheduling and locked memory.
    pub(crate) real_time: bool,
}
