//! A controller, and demo after demo around it.

use std::{
    fs, io,
    path::PathBuf,
    thread::sleep,
    time::{Duration, Instant},
};

use fitmac_rt::instance::Instance;
use rustix::process::Signal;

use super::Sample;
use crate::{
    cell::signal,
    fitmac::{Finished, Place, Run, wait_for},
};

/// Name of the instance.
const INSTANCE: &str = "soak";
/// Time for those who connect, and for those who have left, to be noticed.
const SETTLE: Duration = Duration::from_millis(500);

/// A controller that goes on while robots, policies and agents come and go.
pub struct Cell {
    place: Place,
    instance: Instance,
    controller: Run,
    begun: Instant,
}

impl Cell {
    /// Starts the controller with a trace.
    ///
    /// # Panics
    /// If it does not start.
    #[must_use]
    pub fn start() -> Self {
        let place = Place::beside_others();
        let root = place.folder().join("fitmac").join(INSTANCE);
        let instance = Instance::at(&root).expect("a short path");
        let pace = ["--allow-non-rt", "--spin-us", "150", "--trace", "run.mcap"];
        let controller = start(&place, "rt", &pace);
        wait_for("the trace", || {
            place.folder().join("run.mcap").exists().then_some(())
        });
        Self {
            place,
            instance,
            controller,
            begun: Instant::now(),
        }
    }

    /// The controller's trace.
    #[must_use]
    pub fn trace(&self) -> PathBuf {
        self.place.folder().join("run.mcap")
    }

    /// What the controller holds now.
    ///
    /// # Errors
    /// If it has ended.
    pub fn sample(&self) -> io::Result<Sample> {
        let pid = self.controller.pid();
        Sample::take(self.begun.elapsed(), pid, &self.instance, &self.trace())
    }

    /// One demo: its robot, policy and agents come, work for so long, and go.
    /// Says whether the task was done by then.
    ///
    /// # Panics
    /// If one of them fails.
    pub fn demo(&mut self, seed: u64, lasts: Duration) -> bool {
        let _ = fs::remove_file(self.place.folder().join("scene.json"));
        let seed = seed.to_string();
        let drawn = ["--perturbation", "pos", "--seed", &seed];
        let crew = [
            self.role("sim", &drawn),
            self.role("vla", &["--seed", &seed]),
            self.role("agents", &[]),
        ];
        sleep(SETTLE);
        // The stop of the demo before, if there was one, is over.
        self.ask("reset");
        sleep(lasts);
        // The robot stands before it goes: a fault would be recorded otherwise.
        self.ask("stop");
        let mut done = false;
        for member in crew.into_iter().rev() {
            signal(member.pid(), Signal::TERM);
            let ended = member.finish();
            done |= ended.stdout.contains(r#""success":true"#);
        }
        sleep(SETTLE);
        done
    }

    fn role(&self, role: &str, more: &[&str]) -> Run {
        let card = ["--card", "scene.json"];
        let arguments: Vec<&str> = card.iter().chain(more).copied().collect();
        start(&self.place, role, &arguments)
    }

    /// Asks the controller, again where the machine is too busy for an answer in
    /// time.
    fn ask(&self, what: &str) {
        wait_for(what, || {
            let arguments = ["rt", what, "--instance", INSTANCE];
            let asked = self.place.start(&arguments).finish();
            asked.status.success().then_some(())
        });
    }

    /// Ends the controller in order; gives what it said, and the folder of its
    /// trace.
    #[must_use]
    pub fn finish(self) -> (Finished, Place) {
        signal(self.controller.pid(), Signal::TERM);
        (self.controller.finish(), self.place)
    }

    /// Files of the instance that exist now.
    #[must_use]
    pub fn instance(&self) -> &Instance {
        &self.instance
    }
}

/// Starts a role, which ends when this process does.
fn start(place: &Place, role: &str, more: &[&str]) -> Run {
    let supervisor = std::process::id().to_string();
    let common = ["--supervised", &supervisor, role, "--instance", INSTANCE];
    let arguments: Vec<&str> = common.iter().chain(more).copied().collect();
    place.start(&arguments)
}
