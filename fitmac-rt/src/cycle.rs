//! One control tick, the same in real time and in lockstep: poll, decide,
//! command, record.

use fitmac_core::{
    Controller,
    message::{Command, Input, Output},
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
