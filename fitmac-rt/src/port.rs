//! The two ends of a service with their bookkeeping: a [`Sender`] numbers and
//! stamps what it sends, a [`Receiver`] checks what it gets and counts what it
//! drops.

use crate::{
    clock,
    envelope::{Envelope, Header, HeaderFault},
    layout::Payload,
    service::Service,
    transport::{ConnectError, Read, Transport, TransportFault, Write},
};

/// Names a run of a process: the monotonic time of its start, so that a later
/// run has a greater number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Session(pub u64);

impl Session {
    /// The session of a run that starts now.
    #[must_use]
    pub fn start() -> Self {
        Self(clock::now_ns())
    }
}

/// The sending end of a service.
pub struct Sender<T: Payload, Tr: Transport> {
    writer: Tr::Writer<T>,
    session: Session,
    sequence: u64,
}

impl<T: Payload, Tr: Transport> Sender<T, Tr> {
    /// Connects.
    ///
    /// # Errors
    /// As [`Transport::writer`].
    pub fn connect(
        transport: &Tr,
        service: &Service<T>,
        session: Session,
    ) -> Result<Self, ConnectError> {
        Ok(Self {
            writer: transport.writer(service)?,
            session,
            sequence: 0,
        })
    }

    /// Sends a message, stamped with `now_ns`.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send(&mut self, now_ns: u64, message: &T) -> Result<(), TransportFault> {
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write(
            Envelope::<T>::header(self.session.0, self.sequence, now_ns),
            message,
        )
    }

    /// Hands the service's history to receivers that came since the last
    /// message.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn refresh(&mut self) -> Result<(), TransportFault> {
        self.writer.refresh()
    }

    /// Does what sending will do, as far as no receiver can see it.
    pub(crate) fn rehearse(&mut self) {
        self.writer.rehearse();
    }

    /// Sends a message under any header: for tests of the receivers.
    ///
    /// # Errors
    /// If the transport failed.
    pub fn send_raw(&mut self, header: Header, message: &T) -> Result<(), TransportFault> {
        self.writer.write(header, message)
    }

    /// The number of the newest message, 0 before the first.
    #[must_use]
    pub fn sequence(&self) -> u64 {
        self.sequence
    }

    /// The session under which this end sends.
    #[must_use]
    pub fn session(&self) -> Session {
        self.session
    }
}

/// What a receiver has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReceiverCounts {
    /// Well-formed messages.
    pub received: u64,
    /// Messages of the current sender that were overwritten before they were
    /// read, by the gaps of their numbers.
    pub overwritten: u64,
    /// Messages dropped for their header.
    pub malformed: u64,
    /// Failures of the transport.
    pub transport: u64,
    /// Changes of the sender's session.
    pub sessions: u64,
}

/// The receiving end of a service.
pub struct Receiver<T: Payload, Tr: Transport> {
    reader: Tr::Reader<T>,
    slot: Box<Envelope<T>>,
    counts: ReceiverCounts,
    last: Option<(u64, u64)>,
    newest_fault: Option<HeaderFault>,
}

impl<T: Payload, Tr: Transport> Receiver<T, Tr> {
    /// Connects.
    ///
    /// # Errors
    /// As [`Transport::reader`].
    pub fn connect(transport: &Tr, service: &Service<T>) -> Result<Self, ConnectError> {
        Ok(Self {
            reader: transport.reader(service)?,
            slot: Box::new(Envelope::empty()),
            counts: ReceiverCounts::default(),
            last: None,
            newest_fault: None,
        })
    }

    /// The oldest waiting message, if there is one and it is well-formed.
    /// Never blocks, and reads at most one message, so its time is bounded.
    pub fn poll(&mut self) -> Option<&Envelope<T>> {
        self.receive().then_some(&*self.slot)
    }

    /// The newest waiting message: older ones are passed over. Bounded by the
    /// service's buffer.
    pub fn poll_newest(&mut self, service: &Service<T>) -> Option<&Envelope<T>> {
        let mut any = false;
        for _ in 0..service.buffer {
            if !self.receive() {
                break;
            }
            any = true;
        }
        any.then_some(&*self.slot)
    }

    /// Receives into the slot; returns whether it now holds a new, well-formed message.
    pub(crate) fn receive(&mut self) -> bool {
        match self.reader.read(&mut self.slot) {
            Ok(false) => false,
            Ok(true) => match self.slot.check() {
                Ok(()) => {
                    self.count();
                    true
                }
                Err(fault) => {
                    self.counts.malformed += 1;
                    self.newest_fault = Some(fault);
                    false
                }
            },
            Err(_) => {
                self.counts.transport += 1;
                false
            }
        }
    }

    fn count(&mut self) {
        let Header {
            session, sequence, ..
        } = self.slot.header;
        self.counts.received += 1;
        match self.last {
            Some((before, last)) if before == session => {
                let missed = sequence.wrapping_sub(last).wrapping_sub(1);
                // A number that stands still or runs back is no gap.
                if sequence > last {
                    self.counts.overwritten = self.counts.overwritten.saturating_add(missed);
                }
            }
            Some(_) => self.counts.sessions += 1,
            None => {}
        }
        self.last = Some((session, sequence));
    }

    /// The message that was received last (zeros before the first).
    #[must_use]
    pub fn newest(&self) -> &Envelope<T> {
        &self.slot
    }

    /// What this end has seen.
    #[must_use]
    pub fn counts(&self) -> ReceiverCounts {
        self.counts
    }

    /// Why a message was dropped last, if one was.
    #[must_use]
    pub fn newest_fault(&self) -> Option<HeaderFault> {
        self.newest_fault
    }
}
