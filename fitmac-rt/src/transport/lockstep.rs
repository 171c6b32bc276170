//! The transport within one thread.

use core::any::Any;
use std::{
    cell::RefCell,
    collections::{BTreeMap, VecDeque},
    rc::{Rc, Weak},
};

use super::{ConnectError, Read, Transport, TransportFault, Write};
use crate::{
    envelope::{Envelope, Header},
    layout::Payload,
    service::Service,
};

/// A bus within one thread: what is sent is there at once, in order.
#[derive(Clone, Default)]
pub struct Lockstep {
    topics: Rc<RefCell<BTreeMap<&'static str, Rc<dyn Any>>>>,
}

impl Lockstep {
    /// An empty bus.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    fn topic<T: Payload>(&self, service: &Service<T>) -> Result<SharedTopic<T>, ConnectError> {
        let any = Rc::clone(
            self.topics
                .borrow_mut()
                .entry(service.name)
                .or_insert_with(|| Rc::new(RefCell::new(Topic::<T>::new(service)))),
        );
        any.downcast().map_err(|_| ConnectError::Incompatible {
            service: service.name,
            what: "another message type",
        })
    }
}

type SharedTopic<T> = Rc<RefCell<Topic<T>>>;
type Queue<T> = Rc<RefCell<VecDeque<Envelope<T>>>>;
type WeakQueue<T> = Weak<RefCell<VecDeque<Envelope<T>>>>;

struct Topic<T> {
    history: VecDeque<Envelope<T>>,
    history_limit: usize,
    writers: usize,
    readers: Vec<(WeakQueue<T>, usize)>,
}

impl<T: Payload> Topic<T> {
    fn new(service: &Service<T>) -> Self {
        Self {
            history: VecDeque::with_capacity(service.history),
            history_limit: service.history,
            writers: 0,
            readers: Vec::with_capacity(service.max_subscribers),
        }
    }

    fn publish(&mut self, envelope: &Envelope<T>) {
        push_bounded(&mut self.history, self.history_limit, envelope);
        for (queue, limit) in &self.readers {
            if let Some(queue) = queue.upgrade() {
                push_bounded(&mut queue.borrow_mut(), *limit, envelope);
            }
        }
    }
}

fn push_bounded<T: Payload>(queue: &mut VecDeque<Envelope<T>>, limit: usize, e: &Envelope<T>) {
    if limit == 0 {
        return;
    }
    if queue.len() == limit {
        queue.pop_front();
    }
    queue.push_back(*e);
}

impl Transport for Lockstep {
    type Writer<T: Payload> = LockstepWriter<T>;
    type Reader<T: Payload> = LockstepReader<T>;

    fn writer<T: Payload>(&self, service: &Service<T>) -> Result<LockstepWriter<T>, ConnectError> {
        let topic = self.topic(service)?;
        if topic.borrow().writers == service.max_publishers {
            return Err(ConnectError::SenderExists {
                service: service.name,
                limit: service.max_publishers,
            });
        }
        topic.borrow_mut().writers += 1;
        Ok(LockstepWriter { topic })
    }

    fn reader<T: Payload>(&self, service: &Service<T>) -> Result<LockstepReader<T>, ConnectError> {
        let topic = self.topic(service)?;
        let mut open = topic.borrow_mut();
        open.readers.retain(|(queue, _)| queue.strong_count() > 0);
        if open.readers.len() == service.max_subscribers {
            return Err(ConnectError::TooManyReceivers {
                service: service.name,
                limit: service.max_subscribers,
            });
        }
        let mut queue = VecDeque::with_capacity(service.buffer);
        queue.extend(open.history.iter().copied());
        let queue = Rc::new(RefCell::new(queue));
        open.readers.push((Rc::downgrade(&queue), service.buffer));
        Ok(LockstepReader { queue })
    }
}

/// The sending end within a thread.
pub struct LockstepWriter<T: Payload> {
    topic: SharedTopic<T>,
}

impl<T: Payload> Write<T> for LockstepWriter<T> {
    fn write(&mut self, header: Header, payload: &T) -> Result<(), TransportFault> {
        self.topic.borrow_mut().publish(&Envelope {
            header,
            payload: *payload,
        });
        Ok(())
    }

    /// Receivers have the history from the start.
    fn refresh(&mut self) -> Result<(), TransportFault> {
        Ok(())
    }
}

impl<T: Payload> Drop for LockstepWriter<T> {
    fn drop(&mut self) {
        let mut topic = self.topic.borrow_mut();
        topic.writers -= 1;
        // As between processes: the history goes with its sender.
        if topic.writers == 0 {
            topic.history.clear();
        }
    }
}

/// The receiving end within a thread.
pub struct LockstepReader<T: Payload> {
    queue: Queue<T>,
}

impl<T: Payload> Read<T> for LockstepReader<T> {
    fn read(&mut self, slot: &mut Envelope<T>) -> Result<bool, TransportFault> {
        Ok(self
            .queue
            .borrow_mut()
            .pop_front()
            .map(|envelope| *slot = envelope)
            .is_some())
    }
}
