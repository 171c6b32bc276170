//! The way from the control thread to the recorder: a preallocated ring of
//! bytes. A full ring drops the tick and counts it.

use std::sync::Arc;

use rtrb::{Consumer, Producer, RingBuffer};

use crate::{
    counters::{Cadence, add},
    frame::{FRAME_MAX, Parts, Tick, TickHead},
    layout::Payload,
};

/// Room in the ring: about 8 s at 1 kHz with 10 objects.
pub const RING_BYTES: usize = 16 << 20;
const _: () = assert!(RING_BYTES > 16 * FRAME_MAX);

/// Takes the ticks of a loop.
pub trait Record {
    /// Takes one tick. Must not block, allocate or enter the kernel if it is
    /// to be used on the control thread.
    fn record(&mut self, parts: &Parts<'_>);
}

/// Records nothing.
impl Record for () {
    fn record(&mut self, _parts: &Parts<'_>) {}
}

/// Records into memory: for simulated time.
impl Record for Vec<Tick> {
    fn record(&mut self, parts: &Parts<'_>) {
        let mut bytes = Vec::with_capacity(parts.len());
        parts.for_each(|p| bytes.extend_from_slice(p));
        if let Ok(tick) = Tick::decode(&bytes) {
            self.push(tick);
        }
    }
}

/// The control thread's end.
pub struct RingRecord {
    ring: Producer<u8>,
    cadence: Arc<Cadence>,
}

/// The recorder's end.
pub struct RingReader {
    ring: Consumer<u8>,
    frame: Vec<u8>,
}

/// A ring with room for `bytes`; ticks that don't fit are counted in `cadence`.
#[must_use]
pub fn ring(bytes: usize, cadence: Arc<Cadence>) -> (RingRecord, RingReader) {
    let (producer, consumer) = RingBuffer::new(bytes);
    (
        RingRecord {
            ring: producer,
            cadence,
        },
        RingReader {
            ring: consumer,
            frame: Vec::with_capacity(FRAME_MAX),
        },
    )
}

impl Record for RingRecord {
    fn record(&mut self, parts: &Parts<'_>) {
        if self.ring.slots() < parts.len() {
            add(&self.cadence.counters.unrecorded, 1);
            return;
        }
        // There is room, so no part is refused.
        parts.for_each(|part| {
            let pushed = self.ring.push_entire_slice(part);
            debug_assert!(pushed.is_ok());
        });
    }
}

impl RingReader {
    /// The next whole tick, if it is there.
    pub fn next_tick(&mut self) -> Option<Tick> {
        let frame = self.next_frame()?;
        let tick = Tick::decode(frame);
        debug_assert!(tick.is_ok(), "the ring holds whole frames only");
        tick.ok()
    }

    /// The next whole frame's bytes, if it is there.
    pub fn next_frame(&mut self) -> Option<&[u8]> {
        const HEAD: usize = size_of::<TickHead>();
        let available = self.ring.slots();
        let length = {
            // The head is looked at and left, until the whole frame is there.
            let chunk = self.ring.read_chunk(HEAD).ok()?;
            let (a, b) = chunk.as_slices();
            let mut head = [0; HEAD];
            head[..a.len()].copy_from_slice(a);
            head[a.len()..].copy_from_slice(b);
            TickHead::from_bytes(&head).length as usize
        };
        if available < length {
            return None;
        }
        self.frame.resize(length, 0);
        self.ring.pop_entire_slice(&mut self.frame).ok()?;
        Some(&self.frame)
    }

    /// Whether the control thread has ended and everything was read.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.ring.is_abandoned() && self.ring.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitmac_core::message::{Command, Input, Output};

    fn output(sequence: u64) -> Output {
        Output {
            command: Command {
                sequence,
                ..Command::zeroed()
            },
            query: None,
            rebind: None,
            trace: None,
            event: None,
        }
    }

    #[test]
    fn ticks_pass_in_order_across_threads_and_the_wrap() {
        let cadence = Arc::new(Cadence::default());
        let (mut write, mut read) = ring(1000, Arc::clone(&cadence));
        let writer = std::thread::spawn(move || {
            for i in 1..=20_000 {
                let output = output(i);
                let parts = Parts::of(TickHead::default(), &Input::default(), &output);
                while write.ring.slots() < parts.len() {
                    std::thread::yield_now();
                }
                write.record(&parts);
            }
        });
        let mut next = 1;
        while !read.is_finished() {
            if let Some(tick) = read.next_tick() {
                assert_eq!(tick.output.command.sequence, next);
                next += 1;
            } else {
                std::thread::yield_now();
            }
        }
        writer.join().expect("no panic");
        assert_eq!(next, 20_001);
        assert_eq!(cadence.value("unrecorded_ticks"), Some(0));
    }

    #[test]
    fn a_full_ring_drops_whole_ticks_and_counts_them() {
        let cadence = Arc::new(Cadence::default());
        let (mut write, mut read) = ring(600, Arc::clone(&cadence));
        for i in 1..=5 {
            write.record(&Parts::of(
                TickHead::default(),
                &Input::default(),
                &output(i),
            ));
        }
        assert_eq!(cadence.value("unrecorded_ticks"), Some(3));
        let got: Vec<u64> =
            core::iter::from_fn(|| read.next_tick().map(|t| t.output.command.sequence)).collect();
        assert_eq!(got, [1, 2]);
    }
}
