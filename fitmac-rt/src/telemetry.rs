//! The telemetry thread: takes ticks off the control thread's ring, hands them
//! to whoever records them, and publishes health and trace records.

use std::{
    io,
    sync::{Arc, atomic::Ordering::Relaxed},
    thread::{self, JoinHandle},
    time::Duration,
};

use fitmac_core::message::{Command, TraceRecord};

use crate::{
    clock,
    counters::{self, Cadence},
    frame::Tick,
    instance::{Instance, InstanceError},
    layout::Payload,
    message::{COUNTER_CAPACITY, ModelCall, PromptText, Status},
    port::{Receiver, Sender, Session},
    realtime,
    ring::RingReader,
    service,
    signals::Signals,
    transport::{ConnectError, Ipc},
};

/// Pause when the ring is empty: it holds seconds, so this only costs delay.
const PAUSE: Duration = Duration::from_millis(2);
/// Time between two status messages, ns.
const STATUS_EVERY_NS: u64 = 100_000_000;

/// Takes what is recorded. Runs on the telemetry thread: it may be slow.
pub trait Consume: Send {
    /// Takes a tick.
    ///
    /// # Errors
    /// If it could not be kept; the consumer is not called again.
    fn tick(&mut self, tick: &Tick) -> io::Result<()>;

    /// Takes a prompt's text, at `now_ns`.
    ///
    /// # Errors
    /// If it could not be kept; the consumer is not called again.
    fn prompt(&mut self, now_ns: u64, prompt: &PromptText) -> io::Result<()> {
        let _ = (now_ns, prompt);
        Ok(())
    }

    /// Takes a model call that ended at `now_ns`.
    ///
    /// # Errors
    /// If it could not be kept; the consumer is not called again.
    fn model_call(&mut self, now_ns: u64, call: &ModelCall) -> io::Result<()> {
        let _ = (now_ns, call);
        Ok(())
    }

    /// Takes the health of the loop, ten times a second.
    ///
    /// # Errors
    /// If it could not be kept; the consumer is not called again.
    fn status(&mut self, status: &Status) -> io::Result<()> {
        let _ = status;
        Ok(())
    }

    /// The loop has ended: everything must be on disk when this returns.
    ///
    /// # Errors
    /// If it could not be kept.
    fn finish(&mut self) -> io::Result<()>;

    /// What it is, for messages: "trace file /x/y.mcap".
    fn name(&self) -> String;
}

/// What became of a consumer.
#[derive(Debug)]
pub struct Recorded {
    /// What it is.
    pub name: String,
    /// How it ended.
    pub outcome: io::Result<()>,
    /// Ticks that it took.
    pub ticks: u64,
}

/// The running thread.
pub struct Telemetry {
    thread: JoinHandle<Vec<Recorded>>,
}

/// The telemetry could not start.
#[derive(Debug, thiserror::Error)]
pub enum TelemetryError {
    /// The instance could not be joined.
    #[error(transparent)]
    Instance(#[from] InstanceError),
    /// A service could not be opened.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The system has no thread for us.
    #[error("the telemetry thread could not be started: {0}")]
    Thread(#[from] io::Error),
}

impl Telemetry {
    /// Starts the thread; `control_core` is the core to stay away from.
    ///
    /// # Errors
    /// If the services cannot be opened.
    pub fn start(
        instance: &Instance,
        session: Session,
        ring: RingReader,
        cadence: Arc<Cadence>,
        consumers: Vec<Box<dyn Consume>>,
        signals: Signals,
        control_core: Option<usize>,
    ) -> Result<Self, TelemetryError> {
        let instance = instance.clone();
        let (ready, started) = std::sync::mpsc::sync_channel(1);
        let thread = thread::Builder::new()
            .name("telemetry".into())
            .spawn(move || {
                if let Some(core) = control_core {
                    realtime::keep_off(core);
                }
                // Its ends belong to the thread that makes them.
                match Ends::connect(&instance, session) {
                    Ok(ends) => {
                        let _ = ready.send(Ok(()));
                        Worker::new(ends, ring, cadence, consumers, signals).run()
                    }
                    Err(e) => {
                        let _ = ready.send(Err(e));
                        Vec::new()
                    }
                }
            })?;
        started
            .recv()
            .unwrap_or_else(|_| Err(io::Error::other("the thread ended at once").into()))?;
        Ok(Self { thread })
    }

    /// Waits until everything is recorded. The control thread's end of the
    /// ring must be gone.
    #[must_use]
    pub fn finish(self) -> Vec<Recorded> {
        self.thread.join().unwrap_or_else(|_| {
            vec![Recorded {
                name: "telemetry thread".into(),
                outcome: Err(io::Error::other("it panicked")),
                ticks: 0,
            }]
        })
    }
}

struct Ends {
    status: Sender<Status, Ipc>,
    trace: Sender<TraceRecord, Ipc>,
    prompt: Receiver<PromptText, Ipc>,
    model_call: Receiver<ModelCall, Ipc>,
}

impl Ends {
    fn connect(instance: &Instance, session: Session) -> Result<Self, TelemetryError> {
        let transport = Ipc::join(instance)?;
        Ok(Self {
            status: Sender::connect(&transport, &service::STATUS, session)?,
            trace: Sender::connect(&transport, &service::TRACE, session)?,
            prompt: Receiver::connect(&transport, &service::PROMPT)?,
            model_call: Receiver::connect(&transport, &service::MODEL_CALL)?,
        })
    }
}

struct Worker {
    ends: Ends,
    ring: RingReader,
    cadence: Arc<Cadence>,
    consumers: Vec<Consumer>,
    signals: Signals,
    newest: Command,
    status_due_ns: u64,
}

struct Consumer {
    inner: Box<dyn Consume>,
    failed: Option<io::Error>,
    ticks: u64,
}

impl Consumer {
    fn take(&mut self, cadence: &Cadence, action: impl FnOnce(&mut dyn Consume) -> io::Result<()>) {
        if self.failed.is_none()
            && let Err(e) = action(&mut *self.inner)
        {
            eprintln!(
                "fitmac: {} stopped: {e}; the loop goes on without it",
                self.inner.name()
            );
            cadence.counters.recorders_failed.fetch_add(1, Relaxed);
            self.failed = Some(e);
        }
    }
}

impl Worker {
    fn new(
        ends: Ends,
        ring: RingReader,
        cadence: Arc<Cadence>,
        consumers: Vec<Box<dyn Consume>>,
        signals: Signals,
    ) -> Self {
        let consumers = consumers
            .into_iter()
            .map(|inner| Consumer {
                inner,
                failed: None,
                ticks: 0,
            })
            .collect();
        Self {
            ends,
            ring,
            cadence,
            consumers,
            signals,
            newest: Command::zeroed(),
            status_due_ns: 0,
        }
    }

    fn run(mut self) -> Vec<Recorded> {
        loop {
            let finished = self.ring.is_finished();
            let idle = !self.drain();
            self.texts();
            self.report();
            if finished {
                break;
            }
            if idle {
                thread::sleep(PAUSE);
            }
        }
        self.consumers
            .into_iter()
            .map(|mut consumer| {
                consumer.take(&self.cadence, |c| c.finish());
                Recorded {
                    name: consumer.inner.name(),
                    outcome: consumer.failed.map_or(Ok(()), Err),
                    ticks: consumer.ticks,
                }
            })
            .collect()
    }

    /// Takes all ticks that are there; says whether there were any.
    fn drain(&mut self) -> bool {
        let mut any = false;
        while let Some(tick) = self.ring.next_tick() {
            any = true;
            self.newest = tick.output.command;
            for consumer in &mut self.consumers {
                consumer.take(&self.cadence, |c| c.tick(&tick));
                consumer.ticks += u64::from(consumer.failed.is_none());
            }
            if let Some(trace) = &tick.output.trace {
                // Live views may miss records; the file doesn't.
                let _ = self.ends.trace.send(tick.head.now_ns, trace);
            }
        }
        any
    }

    /// Takes prompts and model calls.
    fn texts(&mut self) {
        while let Some(envelope) = self.ends.prompt.poll() {
            let (now_ns, prompt) = (envelope.header.stamp_ns, envelope.payload);
            for consumer in &mut self.consumers {
                consumer.take(&self.cadence, |c| c.prompt(now_ns, &prompt));
            }
        }
        while let Some(envelope) = self.ends.model_call.poll() {
            let (now_ns, call) = (envelope.header.stamp_ns, envelope.payload);
            for consumer in &mut self.consumers {
                consumer.take(&self.cadence, |c| c.model_call(now_ns, &call));
            }
        }
    }

    fn report(&mut self) {
        if self.signals.take_report_request() {
            eprintln!("{}", self.cadence);
        }
        let now_ns = clock::now_ns();
        if now_ns < self.status_due_ns {
            return;
        }
        self.status_due_ns = now_ns + STATUS_EVERY_NS;
        let status = status(now_ns, &self.newest, &self.cadence);
        let _ = self.ends.status.send(now_ns, &status);
        for consumer in &mut self.consumers {
            consumer.take(&self.cadence, |c| c.status(&status));
        }
    }
}

fn status(now_ns: u64, newest: &Command, cadence: &Cadence) -> Status {
    let values = cadence.values();
    let mut counters = [0; COUNTER_CAPACITY];
    counters[..values.len()].copy_from_slice(&values);
    Status {
        stamp_ns: now_ns,
        ticks: values[0],
        reasons: newest.reasons,
        mode: newest.mode,
        route: newest.route,
        phase: newest.phase,
        sub_phase: newest.sub_phase,
        counter_count: counters::COUNT as u32,
        counters,
    }
}
