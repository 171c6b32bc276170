//! One control tick as bytes: everything that the core was told and answered.
//!
//! The control thread writes frames into a ring; the recorder, the black box
//! and the replay read them. Only the used part of a message is kept: the core
//! looks at no more.

use fitmac_core::message::{
    ActionChunk, Command, CriticReport, GroundingRecord, Input, Output, Plan, PolicyQuery,
    RebindRequest, StateSample, TraceRecord, VerifierReport,
};

use crate::layout::{Payload, layout};

/// The head of a frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickHead {
    /// Bytes of the frame, this head included.
    pub length: u32,
    /// Which messages follow: bits of [`contents`].
    pub contents: u32,
    /// The tick's number, from 1.
    pub tick: u64,
    /// The time that the core was told, ns.
    pub now_ns: u64,
    /// How late the tick began after its deadline, ns.
    pub lateness_ns: u64,
    /// How long the tick before took, from its beginning to its command sent, ns.
    pub busy_before_ns: u64,
    /// Periods that were skipped since the tick before.
    pub skipped: u64,
    /// The request that the core was told: [`fitmac_core::wire::Request`].
    pub request: u64,
}

layout!(TickHead, "TickHead" {
    length, contents, tick, now_ns, lateness_ns, busy_before_ns, skipped, request,
});

/// Which messages a frame holds, in this order. The command is always there.
pub mod contents {
    /// A state sample.
    pub const STATE: u32 = 1;
    /// A chunk.
    pub const CHUNK: u32 = 1 << 1;
    /// A grounding record.
    pub const GROUNDING: u32 = 1 << 2;
    /// A plan.
    pub const PLAN: u32 = 1 << 3;
    /// The verifier's word.
    pub const VERIFIER: u32 = 1 << 4;
    /// The critic's word.
    pub const CRITIC: u32 = 1 << 5;
    /// A query to the policy.
    pub const QUERY: u32 = 1 << 6;
    /// A request to ground.
    pub const REBIND: u32 = 1 << 7;
    /// A trace record.
    pub const TRACE: u32 = 1 << 8;
    /// Not a message: the command was sent with the flag of the last one.
    pub const LAST: u32 = 1 << 9;
    /// The record of an event.
    pub const EVENT: u32 = 1 << 10;
}

/// Most bytes of a frame.
pub const FRAME_MAX: usize = size_of::<TickHead>()
    + size_of::<StateSample>()
    + size_of::<ActionChunk>()
    + size_of::<GroundingRecord>()
    + size_of::<Plan>()
    + size_of::<VerifierReport>()
    + size_of::<CriticReport>()
    + size_of::<Command>()
    + size_of::<PolicyQuery>()
    + size_of::<RebindRequest>()
    + 2 * size_of::<TraceRecord>();

/// The parts of a frame, in order, ready to be written.
pub struct Parts<'a> {
    head: TickHead,
    parts: [&'a [u8]; 11],
}

impl<'a> Parts<'a> {
    /// Lays out a tick. `head` gives all but `length` and `contents`, of which
    /// only [`contents::LAST`] is kept.
    #[must_use]
    pub fn of(mut head: TickHead, input: &Input<'a>, output: &'a Output) -> Self {
        use contents as c;
        head.contents &= c::LAST;
        let contents = &mut head.contents;
        let parts = [
            part(input.state, c::STATE, contents),
            part(input.chunk, c::CHUNK, contents),
            part(input.grounding, c::GROUNDING, contents),
            part(input.plan, c::PLAN, contents),
            part(input.verifier, c::VERIFIER, contents),
            part(input.critic, c::CRITIC, contents),
            output.command.as_bytes(),
            part(output.query.as_ref(), c::QUERY, contents),
            part(output.rebind.as_ref(), c::REBIND, contents),
            part(output.trace.as_ref(), c::TRACE, contents),
            part(output.event.as_ref(), c::EVENT, contents),
        ];
        let bytes: usize = parts.iter().map(|p| p.len()).sum();
        head.length = (size_of::<TickHead>() + bytes) as u32;
        head.request = u64::from(input.request);
        Self { head, parts }
    }

    /// Bytes in all.
    #[must_use]
    pub fn len(&self) -> usize {
        self.head.length as usize
    }

    /// Never: a frame has a head.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The pieces in the order in which they are written.
    pub fn for_each(&self, mut write: impl FnMut(&[u8])) {
        write(self.head.as_bytes());
        self.parts
            .iter()
            .filter(|p| !p.is_empty())
            .for_each(|p| write(p));
    }
}

fn part<'a, T: Payload>(message: Option<&'a T>, bit: u32, contents: &mut u32) -> &'a [u8] {
    message.map_or(&[], |message| {
        *contents |= bit;
        message.used_bytes()
    })
}

/// A tick, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// The head.
    pub head: TickHead,
    /// The state sample that the core was given.
    pub state: Option<Box<StateSample>>,
    /// The chunk that it was given.
    pub chunk: Option<Box<ActionChunk>>,
    /// The grounding record that it was given.
    pub grounding: Option<Box<GroundingRecord>>,
    /// The plan that it was given.
    pub plan: Option<Plan>,
    /// The verifier's word that it was given.
    pub verifier: Option<VerifierReport>,
    /// The critic's word that it was given.
    pub critic: Option<CriticReport>,
    /// What it answered. (The flag of the last command is not the core's: it
    /// stands in the head.)
    pub output: Output,
}

/// A frame that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a frame of {length} bytes with contents {contents:#x} ends in mid-message")]
pub struct TornFrame {
    /// Its declared length.
    pub length: u32,
    /// Its declared contents.
    pub contents: u32,
}

impl Tick {
    /// Reads a frame.
    ///
    /// # Errors
    /// If the bytes end before the messages that the head declares do.
    pub fn decode(bytes: &[u8]) -> Result<Self, TornFrame> {
        use contents as c;
        let head = TickHead::from_bytes(bytes);
        let torn = TornFrame {
            length: head.length,
            contents: head.contents,
        };
        let rest = bytes.get(size_of::<TickHead>()..).ok_or(torn)?;
        let mut reader = Reader { rest, head, torn };
        let (state, chunk) = (reader.boxed(c::STATE)?, reader.boxed(c::CHUNK)?);
        let grounding = reader.boxed(c::GROUNDING)?;
        let (plan, verifier) = (reader.optional(c::PLAN)?, reader.optional(c::VERIFIER)?);
        let critic = reader.optional(c::CRITIC)?;
        let output = Output {
            command: reader.message()?,
            query: reader.optional(c::QUERY)?,
            rebind: reader.optional(c::REBIND)?,
            trace: reader.optional(c::TRACE)?,
            event: reader.optional(c::EVENT)?,
        };
        Ok(Self {
            head,
            state,
            chunk,
            grounding,
            plan,
            verifier,
            critic,
            output,
        })
    }

    /// What the core was told.
    #[must_use]
    pub fn input(&self) -> Input<'_> {
        Input {
            state: self.state.as_deref(),
            chunk: self.chunk.as_deref(),
            grounding: self.grounding.as_deref(),
            plan: self.plan.as_ref(),
            verifier: self.verifier.as_ref(),
            critic: self.critic.as_ref(),
            request: self.head.request as u8,
        }
    }
}

struct Reader<'a> {
    rest: &'a [u8],
    head: TickHead,
    torn: TornFrame,
}

impl Reader<'_> {
    fn message<T: Payload>(&mut self) -> Result<T, TornFrame> {
        let fixed = match T::LAYOUT.tail() {
            None => size_of::<T>(),
            Some(tail) => {
                let head = self.rest.get(..tail.offset()).ok_or(self.torn)?;
                tail.used(head)
            }
        };
        let bytes = self.rest.get(..fixed).ok_or(self.torn)?;
        self.rest = &self.rest[fixed..];
        Ok(T::from_bytes(bytes))
    }

    fn optional<T: Payload>(&mut self, bit: u32) -> Result<Option<T>, TornFrame> {
        match self.head.contents & bit {
            0 => Ok(None),
            _ => self.message().map(Some),
        }
    }

    fn boxed<T: Payload>(&mut self, bit: u32) -> Result<Option<Box<T>>, TornFrame> {
        Ok(self.optional(bit)?.map(Box::new))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (StateSample, ActionChunk, Plan, Output) {
        let mut state = StateSample {
            sequence: 3,
            object_count: 2,
            ..StateSample::default()
        };
        state.objects[1].id = 9;
        let mut chunk = ActionChunk {
            horizon: 8,
            ..ActionChunk::default()
        };
        chunk.actions[7][6] = -1.0;
        let output = Output {
            command: Command {
                sequence: 77,
                ..Command::zeroed()
            },
            query: None,
            rebind: Some(RebindRequest::zeroed()),
            trace: Some(TraceRecord {
                kappa: f64::INFINITY,
                ..TraceRecord::zeroed()
            }),
            event: None,
        };
        (state, chunk, Plan::default(), output)
    }

    fn frame() -> (Vec<u8>, usize) {
        let (state, chunk, plan, output) = example();
        let input = Input {
            state: Some(&state),
            chunk: Some(&chunk),
            plan: Some(&plan),
            request: 1,
            ..Input::default()
        };
        let head = TickHead {
            tick: 5,
            contents: contents::LAST | contents::CRITIC,
            ..TickHead::default()
        };
        let parts = Parts::of(head, &input, &output);
        let mut bytes = Vec::new();
        parts.for_each(|p| bytes.extend_from_slice(p));
        (bytes, parts.len())
    }

    #[test]
    fn a_tick_comes_back_as_it_was() {
        let (bytes, declared) = frame();
        assert_eq!(bytes.len(), declared);
        assert!(declared < FRAME_MAX / 2, "only used parts are kept");
        let tick = Tick::decode(&bytes).expect("whole");
        let (state, chunk, plan, output) = example();
        assert_eq!(tick.head.tick, 5);
        assert_eq!(tick.head.contents & contents::LAST, contents::LAST);
        assert_eq!(tick.output, output);
        let input = tick.input();
        assert_eq!(input.state, Some(&state));
        assert_eq!(input.chunk, Some(&chunk));
        assert_eq!(input.plan, Some(&plan));
        assert_eq!((input.request, input.critic), (1, None));
    }

    #[test]
    fn a_torn_frame_is_an_error_wherever_it_ends() {
        let (bytes, _) = frame();
        for end in 0..bytes.len() {
            assert!(Tick::decode(&bytes[..end]).is_err(), "cut at {end}");
        }
    }
}
