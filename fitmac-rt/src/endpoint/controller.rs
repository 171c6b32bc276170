//! The controller's side.

use fitmac_core::message::{
    ActionChunk, Command, CriticReport, GroundingRecord, Input, Output, Plan, PolicyQuery,
    RebindRequest, StateSample, VerifierReport,
};

use crate::{
    message::OperatorRequest,
    port::{Receiver, ReceiverCounts, Sender, Session},
    service,
    transport::{ConnectError, Transport, TransportFault},
};

/// All ends of the controller.
///
/// [`poll`](Self::poll) takes at most one message of each service, so a tick's
/// work is bounded; what waits longer is taken by the next tick.
pub struct ControllerEndpoint<Tr: Transport> {
    state: Receiver<StateSample, Tr>,
    chunk: Receiver<ActionChunk, Tr>,
    grounding: Receiver<GroundingRecord, Tr>,
    plan: Receiver<Plan, Tr>,
    verifier: Receiver<VerifierReport, Tr>,
    critic: Receiver<CriticReport, Tr>,
    request: Receiver<OperatorRequest, Tr>,
    command: Sender<Command, Tr>,
    query: Sender<PolicyQuery, Tr>,
    rebind: Sender<RebindRequest, Tr>,
    fresh: Fresh,
    turn: u32,
}

/// The services beside the state.
const OTHERS: u32 = 6;

/// Which services had a message in this tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Fresh {
    state: bool,
    chunk: bool,
    grounding: bool,
    plan: bool,
    verifier: bool,
    critic: bool,
    request: bool,
}

impl<Tr: Transport> ControllerEndpoint<Tr> {
    /// Connects all ends.
    ///
    /// # Errors
    /// If another controller is there, or a service cannot be opened.
    pub fn connect(transport: &Tr, session: Session) -> Result<Self, ConnectError> {
        Ok(Self {
            // First: it is the one that a second controller fails on.
            command: Sender::connect(transport, &service::COMMAND, session)?,
            query: Sender::connect(transport, &service::QUERY, session)?,
            rebind: Sender::connect(transport, &service::REBIND, session)?,
            state: Receiver::connect(transport, &service::STATE)?,
            chunk: Receiver::connect(transport, &service::CHUNK)?,
            grounding: Receiver::connect(transport, &service::GROUNDING)?,
            plan: Receiver::connect(transport, &service::PLAN)?,
            verifier: Receiver::connect(transport, &service::VERIFIER)?,
            critic: Receiver::connect(transport, &service::CRITIC)?,
            request: Receiver::connect(transport, &service::REQUEST)?,
            fresh: Fresh::default(),
            turn: 0,
        })
    }

    /// Takes at most one waiting message of each service.
    pub fn poll(&mut self) {
        self.clear();
        self.poll_rest();
    }

    /// Takes a waiting state sample, and nothing else; says whether there is
    /// one that no tick has used yet.
    pub fn poll_state(&mut self) -> bool {
        self.fresh.state = self.fresh.state || self.state.receive();
        self.fresh.state
    }

    /// Looks at the next one of the other services, in turn: what a loop does
    /// while it waits for the state, so that nothing but the state is left to
    /// be looked at when it comes.
    pub fn poll_next(&mut self) {
        self.poll_other(self.turn % OTHERS);
        self.turn = self.turn.saturating_add(1);
    }

    /// Looks at all the other services.
    pub(crate) fn poll_others(&mut self) {
        (0..OTHERS).for_each(|service| self.poll_other(service));
    }

    /// Takes at most one waiting message of each service, but no second one
    /// after [`poll_state`](Self::poll_state) or [`poll_next`](Self::poll_next)
    /// found one. Services that `poll_next` has just gone round are not looked
    /// at again.
    pub fn poll_rest(&mut self) {
        self.poll_state();
        if self.turn < OTHERS {
            self.poll_others();
        }
    }

    fn poll_other(&mut self, service: u32) {
        let fresh = &mut self.fresh;
        match service {
            0 => fresh.chunk = fresh.chunk || self.chunk.receive(),
            1 => fresh.grounding = fresh.grounding || self.grounding.receive(),
            2 => fresh.plan = fresh.plan || self.plan.receive(),
            3 => fresh.verifier = fresh.verifier || self.verifier.receive(),
            4 => fresh.critic = fresh.critic || self.critic.receive(),
            _ => fresh.request = fresh.request || self.request.receive(),
        }
    }

    /// Forgets what was polled: the next tick starts with nothing new.
    pub fn clear(&mut self) {
        self.fresh = Fresh::default();
        self.turn = 0;
    }

    /// Does what [`publish`](Self::publish) will do with a command, as far as
    /// nobody can see it.
    pub(crate) fn rehearse(&mut self) {
        self.command.rehearse();
    }

    /// The newest state sample, whether a tick has used it or not.
    pub(crate) fn newest_state(&self) -> &StateSample {
        &self.state.newest().payload
    }

    /// When the polled state sample was sent, ns; `None` if there is none.
    #[must_use]
    pub fn state_sent_ns(&self) -> Option<u64> {
        self.fresh
            .state
            .then_some(self.state.newest().header.stamp_ns)
    }

    /// What was polled, as the core takes it.
    #[must_use]
    pub fn input(&self) -> Input<'_> {
        let request = &self.request.newest().payload;
        Input {
            state: fresh(self.fresh.state, &self.state),
            chunk: fresh(self.fresh.chunk, &self.chunk),
            grounding: fresh(self.fresh.grounding, &self.grounding),
            plan: fresh(self.fresh.plan, &self.plan),
            verifier: fresh(self.fresh.verifier, &self.verifier),
            critic: fresh(self.fresh.critic, &self.critic),
            request: if self.fresh.request {
                request.request
            } else {
                0
            },
        }
    }

    /// Sends what the core decided at `now_ns`: the command first.
    ///
    /// # Errors
    /// If the transport failed; the rest was still sent.
    pub fn publish(&mut self, now_ns: u64, output: &Output) -> Result<(), TransportFault> {
        let command = self.command.send(now_ns, &output.command);
        let query = match &output.query {
            Some(query) => self.query.send(now_ns, query),
            None => Ok(()),
        };
        let rebind = match &output.rebind {
            Some(rebind) => self.rebind.send(now_ns, rebind),
            None => Ok(()),
        };
        command.and(query).and(rebind)
    }

    /// What the receiving ends have seen: state, chunk, grounding, plan,
    /// verifier, critic, request.
    #[must_use]
    pub fn counts(&self) -> [(&'static str, ReceiverCounts); 7] {
        [
            (service::STATE.name, self.state.counts()),
            (service::CHUNK.name, self.chunk.counts()),
            (service::GROUNDING.name, self.grounding.counts()),
            (service::PLAN.name, self.plan.counts()),
            (service::VERIFIER.name, self.verifier.counts()),
            (service::CRITIC.name, self.critic.counts()),
            (service::REQUEST.name, self.request.counts()),
        ]
    }
}

fn fresh<T: crate::layout::Payload, Tr: Transport>(
    is_fresh: bool,
    receiver: &Receiver<T, Tr>,
) -> Option<&T> {
    is_fresh.then_some(&receiver.newest().payload)
}
