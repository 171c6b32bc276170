//! Writes a trace.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter, Seek, Write},
    path::{Path, PathBuf},
};

use fitmac_core::message::{
    ActionChunk, Command, CriticReport, GroundingRecord, Plan, PolicyQuery, RebindRequest,
    StateSample, TraceRecord, VerifierReport,
};
use foxglove::{
    Encode,
    messages::{FrameTransforms, Log, SceneUpdate},
};
use mcap::{Compression, WriteOptions, records::MessageHeader};

use super::{codec, scene::Scene, schema};
use crate::{
    frame::{Tick, TickHead},
    layout::Payload,
    message::{ModelCall, PromptText, Status},
    telemetry::Consume,
};

/// A chunk is closed when it has this many bytes: what a crash may cost.
const CHUNK_BYTES: u64 = 256 << 10;
/// A chunk is closed after this time at the latest, ns.
const FLUSH_EVERY_NS: u64 = 500_000_000;
/// The name of our metadata record.
pub(super) const METADATA_NAME: &str = "fitmac";

/// What a trace says of itself: version, parameters, options.
pub type Metadata = BTreeMap<String, String>;

/// Writes ticks as MCAP to anything that can be written and sought.
pub struct TraceWriter<W: Write + Seek> {
    mcap: mcap::Writer<W>,
    channels: Channels,
    scene: Scene,
    buffer: Vec<u8>,
    flushed_ns: u64,
}

struct Channels {
    tick: u16,
    state: u16,
    chunk: u16,
    grounding: u16,
    plan: u16,
    verifier: u16,
    critic: u16,
    command: u16,
    query: u16,
    rebind: u16,
    trace: u16,
    event: u16,
    prompt: u16,
    model_call: u16,
    status: u16,
    tf: u16,
    scene: u16,
    log: u16,
}

impl<W: Write + Seek> TraceWriter<W> {
    /// Starts a trace, compressed with Zstandard.
    ///
    /// # Errors
    /// If the head cannot be written.
    pub fn new(out: W, metadata: &Metadata) -> io::Result<Self> {
        Self::packed(out, metadata, Some(Compression::Zstd))
    }

    /// Starts a trace that is not compressed: it takes no memory to speak of, and less time.
    ///
    /// # Errors
    /// If the head cannot be written.
    pub fn uncompressed(out: W, metadata: &Metadata) -> io::Result<Self> {
        Self::packed(out, metadata, None)
    }

    fn packed(out: W, metadata: &Metadata, compression: Option<Compression>) -> io::Result<Self> {
        let mut mcap = WriteOptions::new()
            .profile("fitmac")
            .library(format!("fitmac {}", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            .compression(compression)
            // Threads of its own would take cores and memory from a control machine.
            .compression_threads(0)
            .create(out)
            .map_err(to_io)?;
        mcap.write_metadata(&mcap::records::Metadata {
            name: METADATA_NAME.into(),
            metadata: metadata.clone(),
        })
        .map_err(to_io)?;
        let channels = Channels {
            tick: channel::<TickHead, _>(&mut mcap, "/tick")?,
            state: channel::<StateSample, _>(&mut mcap, "/state")?,
            chunk: channel::<ActionChunk, _>(&mut mcap, "/chunk")?,
            grounding: channel::<GroundingRecord, _>(&mut mcap, "/grounding")?,
            plan: channel::<Plan, _>(&mut mcap, "/plan")?,
            verifier: channel::<VerifierReport, _>(&mut mcap, "/verifier")?,
            critic: channel::<CriticReport, _>(&mut mcap, "/critic")?,
            command: channel::<Command, _>(&mut mcap, "/command")?,
            query: channel::<PolicyQuery, _>(&mut mcap, "/query")?,
            rebind: channel::<RebindRequest, _>(&mut mcap, "/rebind")?,
            trace: channel::<TraceRecord, _>(&mut mcap, "/trace")?,
            event: channel::<TraceRecord, _>(&mut mcap, "/event")?,
            prompt: channel::<PromptText, _>(&mut mcap, "/prompt")?,
            model_call: channel::<ModelCall, _>(&mut mcap, "/model_call")?,
            status: channel::<Status, _>(&mut mcap, "/status")?,
            tf: foxglove_channel::<FrameTransforms, _>(&mut mcap, "/tf")?,
            scene: foxglove_channel::<SceneUpdate, _>(&mut mcap, "/scene")?,
            log: foxglove_channel::<Log, _>(&mut mcap, "/log")?,
        };
        Ok(Self {
            mcap,
            channels,
            scene: Scene::default(),
            buffer: Vec::new(),
            flushed_ns: 0,
        })
    }

    /// Writes a tick.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn tick(&mut self, tick: &Tick) -> io::Result<()> {
        let at = At {
            now_ns: tick.head.now_ns,
            tick: tick.head.tick,
        };
        let Channels {
            tick: head,
            state,
            chunk,
            grounding,
            plan,
            verifier,
            critic,
            command,
            query,
            rebind,
            trace,
            event,
            ..
        } = self.channels;
        self.message(head, at, Some(&tick.head))?;
        self.message(state, at, tick.state.as_deref())?;
        self.message(chunk, at, tick.chunk.as_deref())?;
        self.message(grounding, at, tick.grounding.as_deref())?;
        self.message(plan, at, tick.plan.as_ref())?;
        self.message(verifier, at, tick.verifier.as_ref())?;
        self.message(critic, at, tick.critic.as_ref())?;
        self.message(command, at, Some(&tick.output.command))?;
        self.message(query, at, tick.output.query.as_ref())?;
        self.message(rebind, at, tick.output.rebind.as_ref())?;
        self.message(trace, at, tick.output.trace.as_ref())?;
        self.message(event, at, tick.output.event.as_ref())?;
        self.pictures(at, tick)?;
        if at.now_ns.saturating_sub(self.flushed_ns) > FLUSH_EVERY_NS {
            self.flushed_ns = at.now_ns;
            self.mcap.flush().map_err(to_io)?;
        }
        Ok(())
    }

    /// Writes a prompt's text.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn prompt(&mut self, now_ns: u64, prompt: &PromptText) -> io::Result<()> {
        self.message(self.channels.prompt, At { now_ns, tick: 0 }, Some(prompt))
    }

    /// Writes a model call that ended at `now_ns`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn model_call(&mut self, now_ns: u64, call: &ModelCall) -> io::Result<()> {
        let at = At { now_ns, tick: 0 };
        self.message(self.channels.model_call, at, Some(call))
    }

    /// Writes the loop's health.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn status(&mut self, status: &Status) -> io::Result<()> {
        let at = At {
            now_ns: status.stamp_ns,
            tick: status.ticks,
        };
        self.message(self.channels.status, at, Some(status))
    }

    /// Writes the end and the index, and returns what was written to.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.mcap.finish().map_err(to_io)?;
        Ok(self.mcap.into_inner())
    }

    fn message<T: Payload>(&mut self, channel: u16, at: At, message: Option<&T>) -> io::Result<()> {
        let Some(message) = message else {
            return Ok(());
        };
        self.buffer.clear();
        codec::encode(message, &mut self.buffer);
        self.write(channel, at)
    }

    fn pictures(&mut self, at: At, tick: &Tick) -> io::Result<()> {
        let Channels { tf, scene, log, .. } = self.channels;
        let pictures = self.scene.step(tick);
        if let Some((transforms, update)) = pictures.shapes {
            self.foxglove(tf, at, &transforms)?;
            self.foxglove(scene, at, &update)?;
        }
        for message in pictures.log {
            self.foxglove(log, at, &message)?;
        }
        Ok(())
    }

    fn foxglove<M: Encode>(&mut self, channel: u16, at: At, message: &M) -> io::Result<()> {
        self.buffer.clear();
        message
            .encode(&mut self.buffer)
            .map_err(|e| io::Error::other(e.to_string()))?;
        self.write(channel, at)
    }

    /// Writes what is in the buffer.
    fn write(&mut self, channel_id: u16, at: At) -> io::Result<()> {
        let header = MessageHeader {
            channel_id,
            sequence: at.tick as u32,
            log_time: at.now_ns,
            publish_time: at.now_ns,
        };
        self.mcap
            .write_to_known_channel(&header, &self.buffer)
            .map_err(to_io)
    }
}

#[derive(Clone, Copy)]
struct At {
    now_ns: u64,
    tick: u64,
}

fn channel<T: Payload, W: Write + Seek>(
    mcap: &mut mcap::Writer<W>,
    topic: &str,
) -> io::Result<u16> {
    let schema = mcap
        .add_schema(
            &schema::full_name::<T>(),
            "protobuf",
            &schema::descriptor_set::<T>(),
        )
        .map_err(to_io)?;
    mcap.add_channel(schema, topic, "protobuf", &BTreeMap::new())
        .map_err(to_io)
}

fn foxglove_channel<M: Encode, W: Write + Seek>(
    mcap: &mut mcap::Writer<W>,
    topic: &str,
) -> io::Result<u16> {
    let schema = M::get_schema().ok_or_else(|| io::Error::other("a message without a schema"))?;
    let id = mcap
        .add_schema(&schema.name, &schema.encoding, &schema.data)
        .map_err(to_io)?;
    mcap.add_channel(id, topic, &M::get_message_encoding(), &BTreeMap::new())
        .map_err(to_io)
}

fn to_io(error: mcap::McapError) -> io::Error {
    match error {
        mcap::McapError::Io(e) => e,
        other => io::Error::other(other.to_string()),
    }
}

/// A trace in a file, fed by the telemetry thread.
pub struct TraceFile {
    path: PathBuf,
    writer: Option<TraceWriter<BufWriter<File>>>,
}

impl TraceFile {
    /// Opens the file, so that a bad path is known before the loop starts.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(path: &Path, metadata: &Metadata) -> io::Result<Self> {
        let file = BufWriter::new(File::create(path)?);
        Ok(Self {
            path: path.to_owned(),
            writer: Some(TraceWriter::new(file, metadata)?),
        })
    }

    fn open(&mut self) -> io::Result<&mut TraceWriter<BufWriter<File>>> {
        self.writer
            .as_mut()
            .ok_or_else(|| io::Error::other("the trace is finished"))
    }
}

impl Consume for TraceFile {
    fn tick(&mut self, tick: &Tick) -> io::Result<()> {
        self.open()?.tick(tick)
    }

    fn prompt(&mut self, now_ns: u64, prompt: &PromptText) -> io::Result<()> {
        self.open()?.prompt(now_ns, prompt)
    }

    fn model_call(&mut self, now_ns: u64, call: &ModelCall) -> io::Result<()> {
        self.open()?.model_call(now_ns, call)
    }

    fn status(&mut self, status: &Status) -> io::Result<()> {
        self.open()?.status(status)
    }

    fn finish(&mut self) -> io::Result<()> {
        match self.writer.take() {
            Some(writer) => writer.finish()?.into_inner()?.sync_all(),
            None => Ok(()),
        }
    }

    fn name(&self) -> String {
        format!("the trace file {}", self.path.display())
    }
}
