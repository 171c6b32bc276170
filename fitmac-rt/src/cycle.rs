//! One control tick, the same in real time and in lockstep: poll, decide,
//! command, record.

use fitmac_core::{
    Controller,
    message::{Command, Input, Output, StateSample},
    wire::Request,
};

use crate::{
    endpoint::ControllerEndpoint,
    frame::{Parts, TickHead, contents},
    ring::Record,
    transport::{Transport, TransportFault},
};

/// The controller with its ends and its recorder.
pub struct Cycle<Tr: Transport, R: Record> {
    endpoint: ControllerEndpoint<Tr>,
    core: Controller,
    record: R,
    tick: u64,
    imagined: Box<StateSample>,
}

/// When a tick happens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickTime {
    /// Now, ns: what the core is told.
    pub now_ns: u64,
    /// How late that is, ns.
    pub lateness_ns: u64,
    /// How long the tick before took, ns.
    pub busy_before_ns: u64,
    /// Periods skipped since then.
    pub skipped: u64,
}

/// What the loop itself wants of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Demand {
    /// Nothing: an operator's request is passed on.
    #[default]
    None,
    /// A controlled stop.
    Stop,
    /// A controlled stop, and this command is the last.
    Last,
}

/// What came of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ticked {
    /// What the core decided.
    pub output: Output,
    /// Whether the transport took it all.
    pub sent: Result<(), TransportFault>,
    /// When the state sample that the tick used was sent, ns; `None` without one.
    pub state_sent_ns: Option<u64>,
}

impl<Tr: Transport, R: Record> Cycle<Tr, R> {
    /// A controller that has not ticked yet.
    pub fn new(endpoint: ControllerEndpoint<Tr>, core: Controller, record: R) -> Self {
        Self {
            endpoint,
            core,
            record,
            tick: 0,
            imagined: Box::default(),
        }
    }

    /// One tick: takes what has arrived, decides, sends the command.
    pub fn tick(&mut self, time: TickTime, demand: Demand) -> Ticked {
        self.endpoint.poll_rest();
        let mut input = self.endpoint.input();
        if demand != Demand::None {
            input.request = Request::Stop.code();
        }
        let request = input.request;
        let output = self.core.tick(time.now_ns, &input);
        self.tick = self.tick.wrapping_add(1);
        let head = TickHead {
            tick: self.tick,
            now_ns: time.now_ns,
            lateness_ns: time.lateness_ns,
            busy_before_ns: time.busy_before_ns,
            skipped: time.skipped,
            contents: match demand {
                Demand::Last => contents::LAST,
                Demand::None | Demand::Stop => 0,
            },
            ..TickHead::default()
        };
        let sent = if demand == Demand::Last {
            let mut farewell = output;
            farewell.command.flags |= Command::LAST;
            self.endpoint.publish(time.now_ns, &farewell)
        } else {
            self.endpoint.publish(time.now_ns, &output)
        };
        let input = Input {
            request,
            ..self.endpoint.input()
        };
        self.record.record(&Parts::of(head, &input, &output));
        let state_sent_ns = self.endpoint.state_sent_ns();
        self.endpoint.clear();
        Ticked {
            output,
            sent,
            state_sent_ns,
        }
    }

    /// Does what the tick that is due at `due_ns` will do, on a copy of the
    /// controller whose answer goes nowhere: after a sleep, code and memory of a
    /// tick are out of the caches, and fetching them takes longer than the tick.
    /// To be called while the loop waits.
    pub fn rehearse(&mut self, due_ns: u64) {
        self.endpoint.poll_others();
        let imagined = &mut *self.imagined;
        *imagined = *self.endpoint.newest_state();
        // As if it had just come: an old one would be put aside at once.
        imagined.sequence = imagined.sequence.wrapping_add(1);
        imagined.stamp_ns = due_ns;
        let input = Input {
            state: Some(imagined),
            ..self.endpoint.input()
        };
        let output = self.core.clone().tick(due_ns, &input);
        core::hint::black_box(&output);
        self.endpoint.rehearse();
    }

    /// The controller's ends.
    pub fn endpoint(&mut self) -> &mut ControllerEndpoint<Tr> {
        &mut self.endpoint
    }

    /// The core.
    pub fn core(&self) -> &Controller {
        &self.core
    }

    /// The recorder, when the controller ends.
    pub fn into_record(self) -> R {
        self.record
    }

    /// The recorder so far.
    pub fn record(&self) -> &R {
        &self.record
    }
}
