//! The robot: sends a sample, and takes the time until its command is there.

use fitmac_core::message::{Command, StateSample};
use fitmac_core_tests::world::{Scene, World};
use fitmac_rt::{
    clock, endpoint::HarnessEndpoint, envelope::Envelope, instance::Instance, port::Session,
    realtime::Prepared, transport::Ipc,
};

use crate::{LEAD_NS, PERIOD_NS, distribution::Distribution, echo, in_front};

/// Rounds before the first that counts: the controller begins with a hold.
const WARM_UP: u64 = 500;
/// A sample that has no answer after this time is given up, ns. It counts with
/// this time.
const GIVE_UP_NS: u64 = 100_000_000;

/// Where samples go and commands come from.
trait Line {
    fn send(&mut self, now_ns: u64, sample: &mut StateSample) -> anyhow::Result<()>;
    /// The command that a sample of `sent_ns` has led to, once it is there.
    fn answer(&mut self, sent_ns: u64) -> anyhow::Result<Option<Command>>;
}

/// The bare echo.
struct Floor {
    states: iceoryx2::port::publisher::Publisher<
        iceoryx2::prelude::ipc::Service,
        Envelope<StateSample>,
        (),
    >,
    commands: iceoryx2::port::subscriber::Subscriber<
        iceoryx2::prelude::ipc::Service,
        Envelope<Command>,
        (),
    >,
    sequence: u64,
}

impl Floor {
    fn join(instance: &Instance) -> anyhow::Result<Self> {
        let ends = echo::Ends::join(instance)?;
        Ok(Self {
            states: ends.sender("state")?,
            commands: ends.receiver("command")?,
            sequence: 0,
        })
    }
}

impl Line for Floor {
    fn send(&mut self, now_ns: u64, sample: &mut StateSample) -> anyhow::Result<()> {
        self.sequence += 1;
        let message = Envelope::new(1, self.sequence, now_ns, *sample);
        self.states.loan_uninit()?.write_payload(message).send()?;
        Ok(())
    }

    fn answer(&mut self, sent_ns: u64) -> anyhow::Result<Option<Command>> {
        let sample = self.commands.receive()?;
        let command = sample.map(|sample| sample.payload().payload);
        Ok(command.filter(|command| command.stamp_ns >= sent_ns))
    }
}

/// FIT-MAC.
struct Ours(HarnessEndpoint<Ipc>);

impl Line for Ours {
    fn send(&mut self, now_ns: u64, sample: &mut StateSample) -> anyhow::Result<()> {
        Ok(self.0.publish_state(now_ns, sample)?)
    }

    fn answer(&mut self, sent_ns: u64) -> anyhow::Result<Option<Command>> {
        let command = self.0.poll_command().map(|envelope| envelope.payload);
        // A tick that began after the sample was sent has used it.
        Ok(command.filter(|command| command.stamp_ns >= sent_ns))
    }
}

/// A robot in its toy world.
pub(crate) struct Robot {
    world: World,
    floor: Floor,
    ours: Ours,
    _prepared: Prepared,
}

impl Robot {
    /// On this thread, which stays on `core` from now on.
    pub(crate) fn join(floor: &Instance, ours: &Instance, core: usize) -> anyhow::Result<Self> {
        let ends = HarnessEndpoint::connect(&Ipc::join(ours)?, Session::start())?;
        Ok(Self {
            world: Scene::can_to_plate().world,
            floor: Floor::join(floor)?,
            ours: Ours(ends),
            _prepared: in_front(core).prepare()?,
        })
    }

    /// Sends to the echo and to the controller in turn, half a period after the
    /// other, so many times each; gives the times until the answers were there.
    pub(crate) fn round_trips(&mut self, rounds: u64) -> anyhow::Result<[Distribution; 2]> {
        let mut times = [Distribution::default(), Distribution::default()];
        let mut slot_ns = clock::now_ns() + PERIOD_NS;
        for round in 0..WARM_UP + rounds {
            let mut sample = self.world.sample();
            let (floor_ns, _) = trip(&mut self.floor, &mut sample, slot_ns)?;
            slot_ns = after(slot_ns);
            let (ours_ns, command) = trip(&mut self.ours, &mut sample, slot_ns)?;
            slot_ns = after(slot_ns);
            if let Some(command) = command {
                self.world.apply(&command);
            }
            self.world.advance(PERIOD_NS);
            if round >= WARM_UP {
                times[0].add(floor_ns, 1);
                times[1].add(ours_ns, 1);
            }
        }
        Ok(times)
    }

    /// Sends the controller a sample each period until `ended`.
    pub(crate) fn samples(&mut self, mut ended: impl FnMut() -> bool) -> anyhow::Result<()> {
        let mut slot_ns = clock::now_ns();
        while !ended() {
            clock::sleep_until(slot_ns);
            slot_ns = clock::now_ns().max(slot_ns) + PERIOD_NS;
            if let Some(command) = self.ours.answer(0)? {
                self.world.apply(&command);
            }
            self.world.advance(PERIOD_NS);
            let mut sample = self.world.sample();
            let now_ns = clock::now_ns();
            stamp(&mut sample, now_ns);
            self.ours.send(now_ns, &mut sample)?;
        }
        Ok(())
    }
}

fn stamp(sample: &mut StateSample, now_ns: u64) {
    sample.stamp_ns = now_ns;
    for object in &mut sample.objects {
        object.stamp_ns = now_ns;
    }
}

/// The next slot of the other line: half a period on, and not in the past.
fn after(slot_ns: u64) -> u64 {
    let next_ns = slot_ns + PERIOD_NS / 2;
    let behind_ns = (clock::now_ns() + LEAD_NS).saturating_sub(next_ns);
    next_ns + behind_ns.div_ceil(PERIOD_NS) * PERIOD_NS
}

/// Sends a sample at `slot_ns` and waits for its command.
fn trip(
    line: &mut dyn Line,
    sample: &mut StateSample,
    slot_ns: u64,
) -> anyhow::Result<(u64, Option<Command>)> {
    stamp(sample, slot_ns);
    clock::sleep_until(slot_ns - LEAD_NS);
    while clock::now_ns() < slot_ns {
        std::hint::spin_loop();
    }
    let sent_ns = clock::now_ns();
    sample.stamp_ns = sent_ns;
    line.send(sent_ns, sample)?;
    loop {
        let command = line.answer(sent_ns)?;
        let taken_ns = clock::now_ns() - sent_ns;
        if command.is_some() || taken_ns > GIVE_UP_NS {
            return Ok((taken_ns, command));
        }
        std::hint::spin_loop();
    }
}
