//! The controller process.

use std::sync::Arc;

use fitmac_core::{Controller, ValidParams};

use crate::{
    control_loop::{self, Ended, LoopOptions, LoopOptionsError},
    counters::Cadence,
    cycle::Cycle,
    endpoint::ControllerEndpoint,
    instance::{Instance, InstanceError},
    port::Session,
    realtime::{Core, Measure, NotRealTime, RealTime, allowed_cores},
    ring::{RING_BYTES, ring},
    signals::Signals,
    telemetry::{Consume, Recorded, Telemetry, TelemetryError},
    transport::{ConnectError, Ipc},
};

/// What a controller is to do.
pub struct ControllerRole {
    /// Where.
    pub instance: Instance,
    /// With which parameters.
    pub params: ValidParams,
    /// How it keeps time.
    pub timing: LoopOptions,
    /// What it asks of the system.
    pub real_time: RealTime,
    /// What takes the record.
    pub consumers: Vec<Box<dyn Consume>>,
}

/// How a controller ended.
#[derive(Debug)]
pub struct ControllerReport {
    /// Why the loop ended.
    pub ended: Ended,
    /// What it asked of the system, and got.
    pub measures: Vec<Measure>,
    /// How long things took, and what was counted.
    pub cadence: Arc<Cadence>,
    /// What became of the record.
    pub recorded: Vec<Recorded>,
}

/// A controller could not start.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// The instance could not be used, or another controller has it.
    #[error(transparent)]
    Instance(#[from] InstanceError),
    /// A service could not be opened.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The telemetry could not start.
    #[error(transparent)]
    Telemetry(#[from] TelemetryError),
    /// The system refused real time.
    #[error(transparent)]
    NotRealTime(#[from] NotRealTime),
    /// The timing is out of range.
    #[error(transparent)]
    Timing(#[from] LoopOptionsError),
}

/// Runs a controller on the calling thread until a signal ends it.
///
/// `started` is called when everything is connected, right before the first
/// tick.
///
/// # Errors
/// If it could not start. Once the loop runs it has no errors.
pub fn controller(
    role: ControllerRole,
    signals: &Signals,
    started: impl FnOnce(&[Measure]),
) -> Result<ControllerReport, ControllerError> {
    role.timing.validate()?;
    // Declared first, so that it is given back last.
    let _lock = role.instance.lock_controller()?;
    let session = Session::start();
    let transport = Ipc::join(&role.instance)?;
    let endpoint = ControllerEndpoint::connect(&transport, session)?;
    let cadence = Arc::new(Cadence::default());
    let (record, reader) = ring(RING_BYTES, Arc::clone(&cadence));
    // Before this thread takes its core and priority: a new thread inherits both.
    let telemetry = Telemetry::start(
        &role.instance,
        session,
        reader,
        Arc::clone(&cadence),
        role.consumers,
        signals.clone(),
        control_core(&role.real_time),
    )?;
    let mut cycle = Cycle::new(endpoint, Controller::new(role.params), record);
    let run = || -> Result<_, ControllerError> {
        role.instance.take_memory()?;
        let prepared = role.real_time.prepare()?;
        started(&prepared.measures);
        let ended = control_loop::run(&mut cycle, &role.timing, &cadence, signals)?;
        Ok((ended, prepared.measures))
    };
    let outcome = run();
    // Its end of the ring goes, and the telemetry thread comes to its end.
    drop(cycle);
    let recorded = telemetry.finish();
    let (ended, measures) = outcome?;
    Ok(ControllerReport {
        ended,
        measures,
        cadence,
        recorded,
    })
}

fn control_core(real_time: &RealTime) -> Option<usize> {
    match real_time.core {
        Core::Any => None,
        Core::Number(core) => Some(core),
        Core::Last => allowed_cores().last().copied(),
    }
}
