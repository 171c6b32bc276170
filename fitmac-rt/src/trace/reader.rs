//! Reads a trace back, up to the damage if there is any.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufReader, Read},
    path::{Path, PathBuf},
};

use fitmac_core::message::{Command, Output};
use mcap::{
    McapError,
    records::Record as McapRecord,
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use super::{codec, topic::Topic, writer::METADATA_NAME, writer::Metadata};
use crate::{
    frame::{Tick, TickHead, contents},
    layout::Payload,
    message::{ModelCall, PromptText, Status},
};

/// Longest record that we read: a hostile length must not exhaust memory.
const RECORD_MAX: usize = 64 << 20;

/// What stands in a trace.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// One tick of the controller.
    Tick(Box<Tick>),
    /// A prompt's text, and when it was sent, ns.
    Prompt(u64, Box<PromptText>),
    /// A model call, and when its end was told, ns.
    ModelCall(u64, Box<ModelCall>),
    /// The loop's health.
    Status(Box<Status>),
}

/// Where and why a trace cannot be read on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the trace can be read up to byte {at} of {size}: {why}")]
pub struct Damage {
    /// Bytes that were read when it showed.
    pub at: u64,
    /// Bytes of the file.
    pub size: u64,
    /// What is wrong.
    pub why: String,
}

/// A file that is no trace of ours.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It cannot be read.
    #[error("{path} cannot be read: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It is no MCAP file.
    #[error("{0} is no MCAP file: give a file that `fitmac rt --trace` wrote")]
    NotMcap(PathBuf),
    /// It is an MCAP file of someone else.
    #[error(
        "{0} is an MCAP file, but no FIT-MAC trace: give a file that `fitmac rt --trace` wrote"
    )]
    NotOurs(PathBuf),
}

/// Reads a trace record by record.
pub struct TraceReader<R> {
    input: R,
    size: u64,
    at: u64,
    mcap: LinearReader,
    metadata: Metadata,
    schemas: BTreeMap<u16, (String, Vec<u8>)>,
    topics: BTreeMap<u16, Topic>,
    pending: Option<Pending>,
    ready: Option<Record>,
    end: Option<End>,
}

enum End {
    Clean,
    Damaged(Damage),
}

/// A tick of which messages may still follow.
struct Pending {
    tick: Tick,
    seen: u32,
    has_command: bool,
}

impl Pending {
    fn new(head: TickHead) -> Self {
        Self {
            tick: Tick {
                head,
                state: None,
                chunk: None,
                grounding: None,
                plan: None,
                verifier: None,
                critic: None,
                output: Output {
                    command: Command::zeroed(),
                    query: None,
                    rebind: None,
                    trace: None,
                    event: None,
                },
            },
            seen: head.contents & contents::LAST,
            has_command: false,
        }
    }

    fn is_whole(&self) -> bool {
        self.has_command && self.seen == self.tick.head.contents
    }
}

impl TraceReader<BufReader<File>> {
    /// Opens a trace.
    ///
    /// # Errors
    /// If the file cannot be read or is no trace.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let io = |source| ReadError::Io {
            path: path.to_owned(),
            source,
        };
        let file = File::open(path).map_err(io)?;
        let size = file.metadata().map_err(io)?.len();
        let mut reader = Self::new(BufReader::new(file), size);
        reader.fill();
        match &reader.end {
            Some(End::Damaged(_)) if reader.at <= 8 && size > 0 => {
                return Err(ReadError::NotMcap(path.to_owned()));
            }
            Some(_) if reader.metadata.is_empty() && reader.ready.is_none() && size > 0 => {
                return Err(ReadError::NotOurs(path.to_owned()));
            }
            _ => {}
        }
        Ok(reader)
    }
}

impl<R: Read> TraceReader<R> {
    /// Reads a trace of `size` bytes from anything.
    pub fn new(input: R, size: u64) -> Self {
        Self {
            input,
            size,
            at: 0,
            mcap: LinearReader::new_with_options(
                LinearReaderOptions::default()
                    .with_prevalidate_chunk_crcs(true)
                    .with_record_length_limit(RECORD_MAX),
            ),
            metadata: Metadata::new(),
            schemas: BTreeMap::new(),
            topics: BTreeMap::new(),
            pending: None,
            ready: None,
            end: None,
        }
    }

    /// What the trace says of itself. Complete once the first record was read.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// What ended the reading, if it was not the trace's end. Known when the
    /// iteration has ended.
    #[must_use]
    pub fn damage(&self) -> Option<&Damage> {
        match &self.end {
            Some(End::Damaged(damage)) => Some(damage),
            _ => None,
        }
    }

    /// Reads until a record is ready or the end is reached.
    fn fill(&mut self) {
        while self.ready.is_none() && self.end.is_none() {
            if let Err(why) = self.step() {
                self.end = Some(End::Damaged(Damage {
                    at: self.at,
                    size: self.size,
                    why,
                }));
            }
        }
        // What is pending at the end counts if nothing of it is missing.
        if self.ready.is_none() {
            self.ready = self.release();
        }
    }

    fn release(&mut self) -> Option<Record> {
        self.pending
            .take()
            .filter(Pending::is_whole)
            .map(|p| Record::Tick(Box::new(p.tick)))
    }

    fn step(&mut self) -> Result<(), String> {
        let record = match self.mcap.next_event() {
            None => {
                self.end = Some(End::Clean);
                return Ok(());
            }
            Some(Err(e)) => return Err(explain(&e)),
            Some(Ok(LinearReadEvent::ReadRequest(hint))) => {
                let space = self.mcap.insert(hint.min(RECORD_MAX));
                let n = self.input.read(space).map_err(|e| e.to_string())?;
                self.mcap.notify_read(n);
                self.at += n as u64;
                return Ok(());
            }
            Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                owned(mcap::parse_record(opcode, data).map_err(|e| explain(&e))?)
            }
        };
        match record {
            Owned::Metadata(metadata) => self.metadata = metadata,
            Owned::Schema(id, name, data) => {
                self.schemas.insert(id, (name, data));
            }
            Owned::Channel { id, schema, topic } => self.channel(id, schema, &topic)?,
            Owned::Message {
                channel,
                time,
                data,
            } => {
                if let Some(topic) = self.topics.get(&channel) {
                    self.message(*topic, time, &data)?;
                }
            }
            Owned::Other => {}
        }
        Ok(())
    }

    fn channel(&mut self, id: u16, schema: u16, name: &str) -> Result<(), String> {
        let Some(topic) = Topic::named(name) else {
            return Ok(());
        };
        if self.schemas.get(&schema) != Some(&topic.schema()) {
            let version = self.metadata.get("version").map_or("another", |v| v);
            return Err(format!(
                "topic {name} has another layout than in this version ({}): read it with version {version}",
                env!("CARGO_PKG_VERSION")
            ));
        }
        self.topics.insert(id, topic);
        Ok(())
    }

    fn message(&mut self, topic: Topic, time: u64, data: &[u8]) -> Result<(), String> {
        fn get<T: Payload>(data: &[u8]) -> Result<T, String> {
            codec::decode(data).map_err(|e| format!("{}: {e}", T::LAYOUT.name))
        }
        match topic {
            Topic::Tick => {
                let next = Pending::new(get(data)?);
                if let Some(before) = self.pending.replace(next) {
                    if !before.is_whole() {
                        return Err(format!("tick {} is incomplete", before.tick.head.tick));
                    }
                    self.ready = Some(Record::Tick(Box::new(before.tick)));
                }
                return Ok(());
            }
            Topic::Prompt => {
                self.ready = Some(Record::Prompt(time, Box::new(get(data)?)));
                return Ok(());
            }
            Topic::ModelCall => {
                self.ready = Some(Record::ModelCall(time, Box::new(get(data)?)));
                return Ok(());
            }
            Topic::Status => {
                self.ready = Some(Record::Status(Box::new(get(data)?)));
                return Ok(());
            }
            _ => {}
        }
        let Some(Pending {
            tick,
            seen,
            has_command,
        }) = &mut self.pending
        else {
            return Err("a message stands before the first tick".into());
        };
        *seen |= match topic {
            Topic::State => put(&mut tick.state, Box::new(get(data)?), contents::STATE),
            Topic::Chunk => put(&mut tick.chunk, Box::new(get(data)?), contents::CHUNK),
            Topic::Grounding => put(
                &mut tick.grounding,
                Box::new(get(data)?),
                contents::GROUNDING,
            ),
            Topic::Plan => put(&mut tick.plan, get(data)?, contents::PLAN),
            Topic::Verifier => put(&mut tick.verifier, get(data)?, contents::VERIFIER),
            Topic::Critic => put(&mut tick.critic, get(data)?, contents::CRITIC),
            Topic::Query => put(&mut tick.output.query, get(data)?, contents::QUERY),
            Topic::Rebind => put(&mut tick.output.rebind, get(data)?, contents::REBIND),
            Topic::Trace => put(&mut tick.output.trace, get(data)?, contents::TRACE),
            Topic::Event => put(&mut tick.output.event, get(data)?, contents::EVENT),
            Topic::Command => {
                tick.output.command = get(data)?;
                *has_command = true;
                0
            }
            Topic::Tick | Topic::Prompt | Topic::ModelCall | Topic::Status => 0,
        };
        Ok(())
    }
}

fn put<T>(place: &mut Option<T>, value: T, bit: u32) -> u32 {
    *place = Some(value);
    bit
}

/// A record without the reader's lifetime.
enum Owned {
    Metadata(Metadata),
    Schema(u16, String, Vec<u8>),
    Channel {
        id: u16,
        schema: u16,
        topic: String,
    },
    Message {
        channel: u16,
        time: u64,
        data: Vec<u8>,
    },
    Other,
}

fn owned(record: McapRecord<'_>) -> Owned {
    match record {
        McapRecord::Metadata(m) if m.name == METADATA_NAME => Owned::Metadata(m.metadata),
        McapRecord::Schema { header, data } => {
            Owned::Schema(header.id, header.name, data.into_owned())
        }
        McapRecord::Channel(c) => Owned::Channel {
            id: c.id,
            schema: c.schema_id,
            topic: c.topic,
        },
        McapRecord::Message { header, data } => Owned::Message {
            channel: header.channel_id,
            time: header.log_time,
            data: data.into_owned(),
        },
        _ => Owned::Other,
    }
}

fn explain(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => {
            "it ends in the middle of a record; the recorder was killed or the disk was full".into()
        }
        McapError::BadMagic => "the marks of an MCAP file are missing".into(),
        McapError::BadChunkCrc { .. } | McapError::BadDataCrc { .. } => {
            format!("its bytes were changed ({error})")
        }
        other => other.to_string(),
    }
}

impl<R: Read> Iterator for TraceReader<R> {
    type Item = Record;

    fn next(&mut self) -> Option<Record> {
        self.fill();
        self.ready.take()
    }
}
