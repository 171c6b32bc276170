//! A robot cell for tests of faults: `fitmac rt` as a real process, and around
//! it the lightest robot, policy and agents that are real, as threads or as
//! processes of their own, in a private instance.
//!
//! The robot is the toy world behind the same watchdog that a real robot has.
//! It takes a millisecond's step in each of its own ticks: on a busy machine
//! it becomes slow, never jumpy, so that distances have bounds everywhere.

mod agents;
mod memory;
mod policy;
mod robot;
mod thread;

pub use agents::{AgentsState, agents};
pub use memory::Memory;
pub use policy::{PolicyState, policy};
pub use robot::{Moment, RobotState, Spoil, robot};
pub use thread::{Peer, Shared};

use std::{
    path::{Path, PathBuf},
    process::Command as Process,
    time::{Duration, Instant},
};

use fitmac_core::{message::Command, wire::Mode};
use fitmac_rt::{
    clock,
    endpoint::OperatorEndpoint,
    instance::Instance,
    port::{Receiver, Session},
    service,
    transport::Ipc,
};

use crate::fitmac::{Finished, Place, Run};

/// After this long a test gives up waiting.
const GIVE_UP: Duration = Duration::from_secs(60);
/// Pause of everything that polls; half a tick of the loop.
pub(crate) const PAUSE: Duration = Duration::from_micros(500);

/// Name of the instance, within the cell's own folder.
const INSTANCE: &str = "cell";

/// A robot cell.
pub struct Cell {
    /// The robot, if it is a thread of ours.
    pub robot: Option<Peer<RobotState>>,
    /// The policy, if it is a thread of ours.
    pub policy: Option<Peer<PolicyState>>,
    /// The agents, if they are a thread of ours.
    pub agents: Option<Peer<AgentsState>>,
    place: Place,
    instance: Instance,
    commands: Peer<Vec<Heard>>,
    rt: Option<Run>,
}

/// A command as it was sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heard {
    /// When it was sent, ns.
    pub sent_ns: u64,
    /// The controller's run.
    pub session: u64,
    /// The command.
    pub command: Command,
}

impl Heard {
    /// Whether all of these reasons are given.
    #[must_use]
    pub fn says(&self, reasons: u64) -> bool {
        self.command.reasons & reasons == reasons
    }

    /// Its mode.
    ///
    /// # Panics
    /// If it has none.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.command.mode().expect("a known mode")
    }

    /// Whether actions of the policy or of a recovery are played.
    #[must_use]
    pub fn acts(&self) -> bool {
        let from_policy = self.command.flags & Command::FROM_POLICY != 0;
        self.mode() < Mode::Hold && (from_policy || self.command.sub_phase != 0)
    }
}

impl Cell {
    /// A cell with nobody in it.
    ///
    /// # Panics
    /// If its instance cannot be used.
    #[must_use]
    pub fn empty() -> Self {
        let place = Place::beside_others();
        let instance =
            Instance::at(&place.folder().join("fitmac").join(INSTANCE)).expect("a short path");
        Self {
            commands: Peer::start("commands", &instance, Vec::new(), listen),
            place,
            instance,
            robot: None,
            policy: None,
            agents: None,
            rt: None,
        }
    }

    /// A cell with robot, policy and agents, whose controller runs with these
    /// arguments and plays actions.
    #[must_use]
    pub fn running(policy: PolicyState, arguments: &[&str]) -> Self {
        let mut cell = Self::empty();
        cell.add_robot(RobotState::default());
        cell.add_policy(policy);
        cell.add_agents(AgentsState::default());
        cell.start(arguments);
        cell.wait("actions", 0, Heard::acts);
        cell
    }

    /// Puts a robot into it.
    pub fn add_robot(&mut self, state: RobotState) {
        self.robot = Some(Peer::start("robot", &self.instance, state, robot));
    }

    /// Puts a policy into it.
    pub fn add_policy(&mut self, state: PolicyState) {
        self.policy = Some(Peer::start("policy", &self.instance, state, policy));
    }

    /// Puts agents into it.
    pub fn add_agents(&mut self, state: AgentsState) {
        self.agents = Some(Peer::start("agents", &self.instance, state, agents));
    }

    /// Starts the controller and waits for its first command.
    pub fn start(&mut self, arguments: &[&str]) {
        self.start_with(&[], arguments);
    }

    /// The same under a program that changes something for it.
    pub fn start_with(&mut self, wrapper: &[&str], arguments: &[&str]) {
        let since_ns = clock::now_ns();
        self.rt = Some(self.start_under(wrapper, arguments));
        self.wait("the first command", since_ns, |_| true);
    }

    /// Starts another `fitmac` in the cell.
    #[must_use]
    pub fn another(&self, arguments: &[&str]) -> Run {
        self.place.start(arguments)
    }

    /// Starts another controller in the cell, under a program that changes
    /// something for it (`setpriv ...`).
    #[must_use]
    pub fn start_under(&self, wrapper: &[&str], arguments: &[&str]) -> Run {
        let arguments = rt_arguments(&["--allow-non-rt"], arguments);
        self.place.start_under(wrapper, &arguments)
    }

    /// The same, and it may not run without what it asks of the system.
    #[must_use]
    pub fn start_strictly_under(&self, wrapper: &[&str], arguments: &[&str]) -> Run {
        self.place
            .start_under(wrapper, &rt_arguments(&[], arguments))
    }

    /// Starts a peer as a process of its own: `robot`, `policy`, `agents` or
    /// `listener`.
    ///
    /// # Panics
    /// If it cannot be started.
    #[must_use]
    pub fn process(&self, program: &str, role: &str) -> std::process::Child {
        Process::new(program)
            .arg(role)
            .arg(self.instance.root())
            .spawn()
            .expect("the peer starts")
    }

    /// The controller.
    ///
    /// # Panics
    /// If it was not started, or has ended.
    pub fn rt(&mut self) -> &mut Run {
        self.rt.as_mut().expect("the controller runs")
    }

    /// Waits for the controller's end.
    ///
    /// # Panics
    /// If it was not started, or does not end.
    pub fn finish_rt(&mut self) -> Finished {
        self.rt.take().expect("the controller runs").finish()
    }

    /// Ends the controller in order and waits.
    pub fn end_rt(&mut self) -> Finished {
        signal(self.rt().pid(), rustix::process::Signal::TERM);
        self.finish_rt()
    }

    /// The cell's folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.place.folder()
    }

    /// The cell's instance.
    #[must_use]
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Every command since then.
    #[must_use]
    pub fn commands_since(&self, since_ns: u64) -> Vec<Heard> {
        self.commands.with(|all| {
            let newer = all.iter().filter(|heard| heard.sent_ns >= since_ns);
            newer.copied().collect()
        })
    }

    /// The first command since then that is as described.
    ///
    /// # Panics
    /// If none comes.
    pub fn wait(&self, what: &str, since_ns: u64, is_it: impl Fn(&Heard) -> bool) -> Heard {
        let give_up = Instant::now() + GIVE_UP;
        let mut next = 0;
        loop {
            let found = self.commands.with(|all| {
                let found = all[next..]
                    .iter()
                    .find(|h| h.sent_ns >= since_ns && is_it(h))
                    .copied();
                next = all.len();
                found
            });
            if let Some(found) = found {
                return found;
            }
            let last = || self.commands.with(|all| all.last().copied());
            assert!(Instant::now() < give_up, "no {what}; last {:?}", last());
            std::thread::sleep(PAUSE);
        }
    }

    /// Waits until the controller's status says that this was counted.
    ///
    /// # Panics
    /// If it is not.
    pub fn wait_for_count(&self, name: &str) -> u64 {
        self.status_where(name, |n| n > 0)
    }

    /// What the controller's status says of this counter now.
    #[must_use]
    pub fn count(&self, name: &str) -> u64 {
        self.status_where(name, |_| true)
    }

    fn status_where(&self, name: &str, is_it: impl Fn(u64) -> bool) -> u64 {
        let since_ns = clock::now_ns();
        let at = fitmac_rt::counters::names()
            .iter()
            .position(|n| n == name)
            .unwrap_or_else(|| panic!("there is no counter {name}"));
        let transport = Ipc::join(&self.instance).expect("joins");
        let mut operator =
            OperatorEndpoint::connect(&transport, Session::start()).expect("connects");
        let give_up = Instant::now() + GIVE_UP;
        loop {
            let fresh = operator.poll_status().filter(|s| s.stamp_ns > since_ns);
            match fresh.map(|status| status.counters[at]) {
                Some(n) if is_it(n) => return n,
                _ => assert!(Instant::now() < give_up, "{name} was never counted"),
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// How far the tool centre point got from where it was then, m, once it
    /// stands.
    ///
    /// # Panics
    /// If there is no robot, or it does not come to rest.
    #[must_use]
    pub fn stop_distance_m(&self, since_ns: u64) -> f64 {
        /// At rest: less than this in so many of the robot's ticks.
        const REST_M: f64 = 1e-4;
        const TICKS: usize = 100;
        let robot = self.robot.as_ref().expect("a robot");
        let give_up = Instant::now() + GIVE_UP;
        loop {
            let path: Vec<[f64; 3]> = robot.with(|r| {
                let newer = r.log.iter().filter(|m| m.now_ns >= since_ns);
                newer.map(|m| m.ee_m).collect()
            });
            let far = |from: &[f64; 3], to: &[f64; 3]| kinematics::vector::distance(*from, *to);
            let rests = path.len() > TICKS && {
                let tail = &path[path.len() - TICKS..];
                tail.iter().all(|p| far(p, &tail[0]) < REST_M)
            };
            if rests {
                return path.iter().map(|p| far(p, &path[0])).fold(0.0, f64::max);
            }
            assert!(Instant::now() < give_up, "the robot does not come to rest");
            std::thread::sleep(PAUSE);
        }
    }

    /// Ends everything in order; nothing of the instance may be left.
    ///
    /// # Panics
    /// If something is.
    pub fn close(mut self) {
        if self.rt.is_some() {
            let _ = self.end_rt();
        }
        self.assert_nothing_is_left();
    }

    /// The same where the controller has ended already.
    ///
    /// # Panics
    /// If something is left.
    pub fn assert_nothing_is_left(self) {
        let Self {
            robot,
            policy,
            agents,
            commands,
            instance,
            rt,
            place,
        } = self;
        assert!(rt.is_none(), "the controller still runs");
        drop((robot, policy, agents, commands));
        assert_eq!(instance.files(), Vec::<PathBuf>::new());
        assert!(!instance.root().exists());
        drop(place);
    }
}

fn rt_arguments<'a>(permissions: &[&'a str], arguments: &[&'a str]) -> Vec<&'a str> {
    let common = [
        "rt",
        "--instance",
        INSTANCE,
        "--set",
        "clock.settle_steps=0",
    ];
    let all = common.iter().chain(permissions).chain(arguments);
    all.copied().collect()
}

/// Sends a signal to a process.
///
/// # Panics
/// If it does not run.
pub fn signal(pid: u32, signal: rustix::process::Signal) {
    let pid = i32::try_from(pid)
        .ok()
        .and_then(rustix::process::Pid::from_raw);
    rustix::process::kill_process(pid.expect("a process id"), signal).expect("it runs");
}

/// Hears every command, and keeps them.
fn listen(transport: &Ipc, peer: &Shared<Vec<Heard>>) {
    let mut receiver = Receiver::connect(transport, &service::COMMAND).expect("connects");
    while peer.goes_on() {
        if let Some(envelope) = receiver.poll() {
            let heard = Heard {
                sent_ns: envelope.header.stamp_ns,
                session: envelope.header.session,
                command: envelope.payload,
            };
            peer.with(|all| all.push(heard));
        } else {
            std::thread::sleep(PAUSE);
        }
    }
}
