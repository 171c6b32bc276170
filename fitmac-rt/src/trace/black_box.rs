//! The black box: the last half minute, kept in memory and written to disk
//! when the controller stops the robot.

use std::{
    collections::VecDeque,
    fs::File,
    io::{self, BufWriter},
    path::PathBuf,
};

use fitmac_core::{reason, wire::Mode};

use super::writer::{Metadata, TraceWriter};
use crate::{
    frame::{Parts, Tick, TickHead},
    layout::Payload,
    telemetry::Consume,
};

/// How far back it reaches, ns.
const REACH_NS: u64 = 30_000_000_000;
/// How long it goes on after the fault, ns.
const AFTERMATH_NS: u64 = 1_000_000_000;
/// Memory that it takes, preallocated: 30 s at 1 kHz with some 15 objects.
const CAPACITY: usize = 64 << 20;
/// Files of one run: a fault that returns must not fill the disk.
const FILES_MAX: u32 = 8;

/// Keeps the newest ticks; a fault writes them to a file of their own.
pub struct BlackBox {
    directory: PathBuf,
    metadata: Metadata,
    frames: VecDeque<u8>,
    stage: Stage,
    written: Vec<PathBuf>,
}

enum Stage {
    /// All is well.
    Watching,
    /// A fault is being recorded to its end.
    Aftermath { until_ns: u64, reason: &'static str },
    /// The fault was written; wait until it is over.
    Written,
}

impl BlackBox {
    /// A black box that writes to `directory`, which is made when it is needed.
    #[must_use]
    pub fn new(directory: PathBuf, metadata: Metadata) -> Self {
        Self {
            directory,
            metadata,
            frames: VecDeque::with_capacity(CAPACITY),
            stage: Stage::Watching,
            written: Vec::new(),
        }
    }

    /// The files that were written.
    #[must_use]
    pub fn written(&self) -> &[PathBuf] {
        &self.written
    }

    fn keep(&mut self, tick: &Tick) {
        let input = tick.input();
        let parts = Parts::of(tick.head, &input, &tick.output);
        let oldest_ns = tick.head.now_ns.saturating_sub(REACH_NS);
        while let Some(head) = self.oldest()
            && (head.now_ns < oldest_ns || self.frames.len() + parts.len() > CAPACITY)
        {
            self.frames.drain(..head.length as usize);
        }
        parts.for_each(|part| self.frames.extend(part));
    }

    fn oldest(&self) -> Option<TickHead> {
        if self.frames.is_empty() {
            return None;
        }
        let bytes: Vec<u8> = self
            .frames
            .iter()
            .take(size_of::<TickHead>())
            .copied()
            .collect();
        Some(TickHead::from_bytes(&bytes))
    }

    fn write(&mut self, now_ns: u64, reason: &str) -> io::Result<()> {
        if self.written.len() as u32 >= FILES_MAX {
            return Ok(());
        }
        std::fs::create_dir_all(&self.directory)?;
        let path = self
            .directory
            .join(format!("black-box-{}-{reason}.mcap", now_ns / 1_000_000));
        let mut metadata = self.metadata.clone();
        metadata.insert("black_box".into(), reason.into());
        // The memory of a compressor would have to be found beside a running loop.
        let file = BufWriter::new(File::create(&path)?);
        let mut writer = TraceWriter::uncompressed(file, &metadata)?;
        let bytes = self.frames.make_contiguous();
        let mut at = 0;
        while let Some(frame) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
            let length = TickHead::from_bytes(frame).length as usize;
            let tick = Tick::decode(frame).map_err(io::Error::other)?;
            writer.tick(&tick)?;
            at += length;
        }
        writer.finish()?.into_inner()?.sync_all()?;
        eprintln!(
            "fitmac: {reason}: the last half minute is in {}",
            path.display()
        );
        self.written.push(path);
        Ok(())
    }
}

/// The fault that a stopped controller names first; an orderly end is none.
fn fault(tick: &Tick) -> Option<&'static str> {
    let ordinary = reason::SHUTTING_DOWN | reason::OPERATOR_STOP;
    let command = &tick.output.command;
    let asked_to = command.reasons & ordinary != 0 || tick.head.request != 0;
    (command.mode() == Some(Mode::Stop) && !asked_to)
        .then(|| reason::names(command.reasons).next().unwrap_or("stop"))
}

impl Consume for BlackBox {
    fn tick(&mut self, tick: &Tick) -> io::Result<()> {
        self.keep(tick);
        let now_ns = tick.head.now_ns;
        let stopped = tick.output.command.mode() == Some(Mode::Stop);
        match self.stage {
            Stage::Watching => {
                if let Some(reason) = fault(tick) {
                    self.stage = Stage::Aftermath {
                        until_ns: now_ns + AFTERMATH_NS,
                        reason,
                    };
                }
                Ok(())
            }
            Stage::Aftermath { until_ns, reason } if now_ns >= until_ns => {
                self.stage = Stage::Written;
                self.write(now_ns, reason)
            }
            Stage::Aftermath { .. } => Ok(()),
            Stage::Written => {
                if !stopped {
                    self.stage = Stage::Watching;
                }
                Ok(())
            }
        }
    }

    fn finish(&mut self) -> io::Result<()> {
        if let Stage::Aftermath { until_ns, reason } = self.stage {
            self.stage = Stage::Written;
            self.write(until_ns, reason)?;
        }
        Ok(())
    }

    fn name(&self) -> String {
        format!("the black box in {}", self.directory.display())
    }
}
