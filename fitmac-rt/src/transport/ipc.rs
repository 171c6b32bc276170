//! The transport between processes: iceoryx2, polled.
#![allow(unsafe_code)]

use std::{rc::Rc, time::Duration};

use iceoryx2::{
    port::{
        publisher::{Publisher, PublisherCreateError},
        subscriber::{Subscriber, SubscriberCreateError},
        update_connections::UpdateConnections as _,
    },
    prelude::{BackpressureStrategy, Node, NodeBuilder, PortFactory as _, SignalHandlingMode, ipc},
    service::{
        builder::publish_subscribe::{
            PublishSubscribeCreateError, PublishSubscribeOpenError,
            PublishSubscribeOpenOrCreateError,
        },
        port_factory::publish_subscribe::PortFactory,
    },
};

use super::{ConnectError, Read, Transport, TransportFault, Write};
use crate::{
    envelope::{Envelope, Header},
    instance::{Instance, InstanceError, Membership},
    layout::Payload,
    service::Service,
};

/// Nodes (processes, or threads with a connection of their own) that a service admits.
const MAX_NODES: usize = 32;
/// Attempts at a service that another process creates or removes at this moment.
const ATTEMPTS: u32 = 50;
const ATTEMPT_PAUSE: Duration = Duration::from_millis(10);

/// The shared-memory transport of one process in an instance.
///
/// Its ends stay on the thread that made them. It is connected before the
/// control loop is armed: connecting costs system calls.
#[derive(Clone)]
pub struct Ipc {
    node: Rc<Node<ipc::Service>>,
    // After the node: the last member cleans up when the node is gone.
    membership: Rc<Membership>,
}

impl Ipc {
    /// Joins an instance. What processes that died have left is removed first.
    ///
    /// # Errors
    /// If the instance's directory cannot be used, or shared memory has no room.
    pub fn join(instance: &Instance) -> Result<Self, InstanceError> {
        instance.look_for_room()?;
        iceoryx2::prelude::set_log_level_from_env_or(iceoryx2::prelude::LogLevel::Fatal);
        let membership = instance.join()?;
        let node = NodeBuilder::new()
            .config(&instance.iceoryx_config()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|e| InstanceError::Transport {
                root: instance.root().to_owned(),
                detail: e.to_string(),
            })?;
        Ok(Self {
            node: Rc::new(node),
            membership: Rc::new(membership),
        })
    }

    fn open<T: Payload>(&self, service: &Service<T>) -> Result<Factory<T>, ConnectError> {
        let environment = |detail: String| ConnectError::Environment {
            service: service.name,
            detail,
        };
        let name = service
            .name
            .try_into()
            .map_err(|e| environment(format!("{e:?}")))?;
        let mut attempt = 0;
        let factory = loop {
            let result = self
                .node
                .service_builder(&name)
                .publish_subscribe::<Envelope<T>>()
                .max_publishers(service.max_publishers)
                .max_subscribers(service.max_subscribers)
                .max_nodes(MAX_NODES)
                .subscriber_max_buffer_size(service.buffer)
                .subscriber_max_borrowed_samples(1)
                .history_size(service.history)
                .enable_safe_overflow(true)
                .open_or_create();
            match result {
                Ok(factory) => break factory,
                Err(e) if attempt < ATTEMPTS && is_transient(e) => {
                    attempt += 1;
                    std::thread::sleep(ATTEMPT_PAUSE);
                }
                Err(e) => return Err(refusal(service.name, e)),
            }
        };
        // An existing service with *more* room passes the check of the
        // library: a second controller would then pass too.
        if factory.static_config().max_publishers() != service.max_publishers {
            return Err(ConnectError::Incompatible {
                service: service.name,
                what: "another number of senders",
            });
        }
        Ok(factory)
    }
}

type Factory<T> = PortFactory<ipc::Service, Envelope<T>, ()>;

fn is_transient(error: PublishSubscribeOpenOrCreateError) -> bool {
    use PublishSubscribeOpenOrCreateError as E;
    matches!(
        error,
        E::SystemInFlux
            | E::PublishSubscribeOpenError(
                PublishSubscribeOpenError::IsMarkedForDestruction
                    | PublishSubscribeOpenError::DoesNotExist
            )
            | E::PublishSubscribeCreateError(
                PublishSubscribeCreateError::AlreadyExists
                    | PublishSubscribeCreateError::IsBeingCreatedByAnotherInstance
            )
    )
}

fn refusal(service: &'static str, error: PublishSubscribeOpenOrCreateError) -> ConnectError {
    use PublishSubscribeOpenError as Open;
    let incompatible = |what| ConnectError::Incompatible { service, what };
    match error {
        PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(open) => match open {
            Open::IncompatibleTypes => incompatible("another message type"),
            Open::IncompatibleMessagingPattern => incompatible("another messaging pattern"),
            Open::IncompatibleOverflowBehavior => incompatible("another overflow behaviour"),
            Open::DoesNotSupportRequestedMinBufferSize
            | Open::DoesNotSupportRequestedMinHistorySize
            | Open::DoesNotSupportRequestedAmountOfPublishers
            | Open::DoesNotSupportRequestedAmountOfSubscribers
            | Open::DoesNotSupportRequestedAmountOfNodes
            | Open::DoesNotSupportRequestedMinSubscriberBorrowedSamples => {
                incompatible("less room than this version needs")
            }
            _ => ConnectError::Environment {
                service,
                detail: open.to_string(),
            },
        },
        other => ConnectError::Environment {
            service,
            detail: other.to_string(),
        },
    }
}

impl Transport for Ipc {
    type Writer<T: Payload> = IpcWriter<T>;
    type Reader<T: Payload> = IpcReader<T>;

    fn writer<T: Payload>(&self, service: &Service<T>) -> Result<IpcWriter<T>, ConnectError> {
        self.open(service)?
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .max_loaned_samples(1)
            .create()
            .map(|publisher| IpcWriter {
                publisher,
                _membership: Rc::clone(&self.membership),
            })
            .map_err(|e| match e {
                PublisherCreateError::ExceedsMaxSupportedPublishers => ConnectError::SenderExists {
                    service: service.name,
                    limit: service.max_publishers,
                },
                other => ConnectError::Environment {
                    service: service.name,
                    detail: other.to_string(),
                },
            })
    }

    fn reader<T: Payload>(&self, service: &Service<T>) -> Result<IpcReader<T>, ConnectError> {
        self.open(service)?
            .subscriber_builder()
            .buffer_size(service.buffer)
            .create()
            .map(|subscriber| IpcReader {
                subscriber,
                _membership: Rc::clone(&self.membership),
            })
            .map_err(|e| match e {
                SubscriberCreateError::ExceedsMaxSupportedSubscribers => {
                    ConnectError::TooManyReceivers {
                        service: service.name,
                        limit: service.max_subscribers,
                    }
                }
                other => ConnectError::Environment {
                    service: service.name,
                    detail: other.to_string(),
                },
            })
    }
}

/// The sending end between processes.
pub struct IpcWriter<T: Payload> {
    publisher: Publisher<ipc::Service, Envelope<T>, ()>,
    _membership: Rc<Membership>,
}

impl<T: Payload> Write<T> for IpcWriter<T> {
    fn write(&mut self, header: Header, payload: &T) -> Result<(), TransportFault> {
        let mut sample = self
            .publisher
            .loan_uninit()
            .map_err(|_| TransportFault("no sample could be loaned"))?;
        let place = sample.payload_mut().as_mut_ptr();
        let used = payload.used_bytes();
        // SAFETY: `place` points to an envelope's memory that is loaned to us
        // alone. There is no padding; what is not in use keeps the bytes of
        // shared memory, zeros at first, and every bit pattern is valid.
        let sample = unsafe {
            (&raw mut (*place).header).write(header);
            let to = (&raw mut (*place).payload).cast::<u8>();
            to.copy_from_nonoverlapping(used.as_ptr(), used.len());
            sample.assume_init()
        };
        sample
            .send()
            .map(|_receivers| ())
            .map_err(|_| TransportFault("a message could not be delivered"))
    }

    fn refresh(&mut self) -> Result<(), TransportFault> {
        self.publisher
            .update_connections()
            .map_err(|_| TransportFault("a new receiver could not be connected"))
    }

    fn rehearse(&mut self) {
        // The memory of the next message, without a message.
        if let Ok(mut sample) = self.publisher.loan_uninit() {
            let place = sample.payload_mut().as_mut_ptr();
            // SAFETY: it is loaned to us alone, and given back unsent.
            unsafe { (&raw mut (*place).header).write(Envelope::<T>::header(0, 0, 0)) };
        }
    }
}

/// The receiving end between processes.
pub struct IpcReader<T: Payload> {
    subscriber: Subscriber<ipc::Service, Envelope<T>, ()>,
    _membership: Rc<Membership>,
}

impl<T: Payload> Read<T> for IpcReader<T> {
    fn read(&mut self, slot: &mut Envelope<T>) -> Result<bool, TransportFault> {
        let Some(sample) = self
            .subscriber
            .receive()
            .map_err(|_| TransportFault("a message could not be received"))?
        else {
            return Ok(false);
        };
        // SAFETY: the sample is a readable, aligned envelope while it is borrowed.
        unsafe { slot.copy_from_shared(core::ptr::from_ref(sample.payload())) };
        Ok(true)
    }
}
