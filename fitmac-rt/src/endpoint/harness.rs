//! The robot's side.

use fitmac_core::message::{Command, StateSample, VerifierReport};

use crate::{
    envelope::Envelope,
    port::{Receiver, ReceiverCounts, Sender, Session},
    service,
    transport::{ConnectError, Transport, TransportFault},
};

/// The ends of the robot or simulator.
pub struct HarnessEndpoint<Tr: Transport> {
    state: Sender<StateSample, Tr>,
    verifier: Sender<VerifierReport, Tr>,
    command: Receiver<Command, Tr>,
}

impl<Tr: Transport> HarnessEndpoint<Tr> {
    /// Connects all ends.
    ///
    /// # Errors
    /// If another harness is there, or a service cannot be opened.
    pub fn connect(transport: &Tr, session: Session) -> Result<Self, ConnectError> {
        Ok(Self {
            state: Sender::connect(transport, &service::STATE, session)?,
            verifier: Sender::connect(transport, &service::VERIFIER, session)?,
            command: Receiver::connect(transport, &service::COMMAND)?,
        })
    }

    /// Publishes a sample at `now_ns`. Its sequence number and session are
    /// filled in; its stamp is the caller's: when the sample was taken.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn publish_state(
        &mut self,
        now_ns: u64,
        sample: &mut StateSample,
    ) -> Result<(), TransportFault> {
        sample.session = self.state.session().0;
        sample.sequence = self.state.sequence().wrapping_add(1);
        self.state.send(now_ns, sample)
    }

    /// Publishes the task verifier's word; its sequence number is filled in.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn publish_verifier(
        &mut self,
        now_ns: u64,
        report: &mut VerifierReport,
    ) -> Result<(), TransportFault> {
        report.sequence = self.verifier.sequence().wrapping_add(1);
        self.verifier.send(now_ns, report)
    }

    /// The newest command, if one came since the last call. Judge its age with
    /// a [`super::CommandWatch`]: a robot stops by itself when commands cease.
    pub fn poll_command(&mut self) -> Option<&Envelope<Command>> {
        self.command.poll_newest(&service::COMMAND)
    }

    /// The sending end of the state, for tests that send what a sound harness would not.
    pub fn state_sender(&mut self) -> &mut Sender<StateSample, Tr> {
        &mut self.state
    }

    /// What the command end has seen.
    #[must_use]
    pub fn command_counts(&self) -> ReceiverCounts {
        self.command.counts()
    }
}
