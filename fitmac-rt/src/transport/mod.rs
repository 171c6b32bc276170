//! How messages travel: a trait, and two implementations that pass one
//! conformance suite.
//!
//! - [`Ipc`]: shared memory between processes (iceoryx2), in wall-clock time.
//! - [`Lockstep`]: queues within one thread, for simulated time, swarm tests
//!   and replay.
//!
//! Both poll, never block and never allocate once connected. A sender never
//! waits for a receiver: a full buffer drops its oldest message.

mod ipc;
mod lockstep;

pub use ipc::{Ipc, IpcReader, IpcWriter};
pub use lockstep::{Lockstep, LockstepReader, LockstepWriter};

use crate::{
    envelope::{Envelope, Header},
    layout::Payload,
    service::Service,
};

/// Makes the two ends of services.
pub trait Transport {
    /// The sending end.
    type Writer<T: Payload>: Write<T>;
    /// The receiving end.
    type Reader<T: Payload>: Read<T>;

    /// Connects a sender.
    ///
    /// # Errors
    /// If the service has all its senders, carries another type, or cannot be opened.
    fn writer<T: Payload>(&self, service: &Service<T>) -> Result<Self::Writer<T>, ConnectError>;

    /// Connects a receiver. It gets the service's history first.
    ///
    /// # Errors
    /// If the service has all its receivers, carries another type, or cannot be opened.
    fn reader<T: Payload>(&self, service: &Service<T>) -> Result<Self::Reader<T>, ConnectError>;
}

/// The sending end of a service.
pub trait Write<T: Payload> {
    /// Sends one message, as it stands: the header is not checked here.
    ///
    /// # Errors
    /// If the transport failed; the message may have reached some receivers.
    fn write(&mut self, header: Header, payload: &T) -> Result<(), TransportFault>;

    /// Hands the service's history to receivers that came since the last
    /// message. Sending does it, too: this is for a sender that seldom sends.
    ///
    /// # Errors
    /// If the transport failed.
    fn refresh(&mut self) -> Result<(), TransportFault>;

    /// Does what a later [`write`](Self::write) will do, as far as nobody can
    /// see it: its code and its memory are in the caches then.
    fn rehearse(&mut self) {}
}

/// The receiving end of a service.
pub trait Read<T: Payload> {
    /// Copies the oldest waiting message into `slot`, if there is one. The
    /// copy is private, and not checked yet.
    ///
    /// # Errors
    /// If the transport failed; `slot` is then unspecified.
    fn read(&mut self, slot: &mut Envelope<T>) -> Result<bool, TransportFault>;
}

/// The transport failed to carry a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the transport failed: {0}")]
pub struct TransportFault(pub &'static str);

/// A service could not be connected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConnectError {
    /// All senders that the service admits are there.
    #[error(
        "service `{service}` already has its {limit} sender(s): another process plays this role in the same instance; stop it (a stopped process must be killed), or use another --instance"
    )]
    SenderExists {
        /// The service.
        service: &'static str,
        /// How many it admits.
        limit: usize,
    },
    /// All receivers that the service admits are there.
    #[error("service `{service}` already has its {limit} receivers: disconnect one")]
    TooManyReceivers {
        /// The service.
        service: &'static str,
        /// How many it admits.
        limit: usize,
    },
    /// The service exists with another type or other settings.
    #[error(
        "service `{service}` exists with {what}: another version of FIT-MAC runs in this instance; build all processes from one release, or use another --instance"
    )]
    Incompatible {
        /// The service.
        service: &'static str,
        /// What differs.
        what: &'static str,
    },
    /// The shared memory or its directory could not be used.
    #[error("service `{service}` could not be opened: {detail}")]
    Environment {
        /// The service.
        service: &'static str,
        /// What the system said.
        detail: String,
    },
}
