//! The robot: the toy world behind the watchdog of a real one.

use std::{thread::sleep, time::Duration};

use fitmac_core::message::StateSample;
use fitmac_rt::{
    clock,
    endpoint::{CommandLimits, CommandState, CommandWatch, HarnessEndpoint, StopCause},
    port::Session,
    transport::Ipc,
};

use super::thread::Shared;
use fitmac_core_tests::world::{Scene, World};

/// Time between two of its ticks; by so much the world goes on in each.
const TICK: Duration = Duration::from_millis(1);

/// A change of what is sent.
pub type Spoil<T> = Box<dyn FnMut(&mut T) + Send>;

/// A robot and its world.
pub struct RobotState {
    /// The world.
    pub world: World,
    /// Sends no samples.
    pub mute: bool,
    /// Hears no commands.
    pub deaf: bool,
    /// Changes every sample before it is sent.
    pub spoil: Option<Spoil<StateSample>>,
    /// Breaks the header of every sample: the version of the protocol is this much higher.
    pub abi_ahead: u16,
    /// What happened, tick by tick.
    pub log: Vec<Moment>,
}

/// One of the robot's ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// When, ns.
    pub now_ns: u64,
    /// Tool centre point, m.
    pub ee_m: [f64; 3],
    /// Why it follows no command, if it does not.
    pub stopped: Option<StopCause>,
}

impl Default for RobotState {
    fn default() -> Self {
        Self::new(Scene::can_to_plate().world)
    }
}

impl RobotState {
    /// A robot in this world.
    #[must_use]
    pub fn new(world: World) -> Self {
        Self {
            world,
            mute: false,
            deaf: false,
            spoil: None,
            abi_ahead: 0,
            log: Vec::new(),
        }
    }

    fn tick(&mut self, now_ns: u64, state: CommandState) {
        let stopped = match state {
            CommandState::Follow(command) if !self.deaf => {
                self.world.apply(&command);
                None
            }
            CommandState::Follow(_) => None,
            CommandState::Stop(cause) => {
                self.world.place(self.world.ee_m());
                Some(cause)
            }
        };
        self.world.advance(TICK.as_nanos() as u64);
        self.log.push(Moment {
            now_ns,
            ee_m: self.world.ee_m(),
            stopped,
        });
    }

    fn sample(&mut self, now_ns: u64) -> StateSample {
        let mut sample = self.world.sample();
        sample.stamp_ns = now_ns;
        for object in &mut sample.objects {
            object.stamp_ns = now_ns;
        }
        if let Some(spoil) = &mut self.spoil {
            spoil(&mut sample);
        }
        sample
    }
}

/// Runs the robot.
///
/// # Panics
/// If it cannot connect.
pub fn robot(transport: &Ipc, shared: &Shared<RobotState>) {
    let session = Session::start();
    let mut ends = HarnessEndpoint::connect(transport, session).expect("connects");
    let mut watch = CommandWatch::new(CommandLimits::default());
    while shared.goes_on() {
        let now_ns = clock::now_ns();
        let arrived = ends.poll_command().copied();
        let state = watch.step(now_ns, arrived.as_ref());
        let sample = shared.with(|robot| {
            robot.tick(now_ns, state);
            let (mute, abi_ahead) = (robot.mute, robot.abi_ahead);
            let sample = robot.sample(now_ns);
            (!mute).then_some((sample, abi_ahead))
        });
        if let Some((mut sample, abi_ahead)) = sample {
            sample.session = session.0;
            let sender = ends.state_sender();
            let mut header = fitmac_rt::envelope::Envelope::<StateSample>::header(
                session.0,
                sample.sequence,
                now_ns,
            );
            header.abi_version += abi_ahead;
            sender.send_raw(header, &sample).expect("sends");
        }
        sleep(TICK);
    }
}
