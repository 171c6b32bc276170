//! The controller.

use fitmac_core::{
    Controller as Core, State, ValidParams,
    message::{
        ActionChunk, Command, CriticReport, GroundingRecord, Input, ObjectSample, Plan,
        PolicyQuery, RebindRequest, StateSample, TraceRecord, VerifierReport,
    },
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyBytes};

use crate::config::Config;

/// A message of the core: numbers only, without padding.
///
/// # Safety
/// Every run of bytes is a value, and every byte of a value is one of a number.
unsafe trait Message: Copy {
    const NAME: &'static str;
}

macro_rules! messages {
    ($($name:ident),+) => {
        // SAFETY: the core declares them `repr(C)`, of integers and floats, and
        // fails its build if one has padding.
        $(unsafe impl Message for $name { const NAME: &'static str = stringify!($name); })+

        /// Bytes of each message.
        #[pyfunction]
        pub(crate) fn sizes() -> Vec<(&'static str, usize)> {
            vec![$((stringify!($name), size_of::<$name>())),+]
        }
    };
}

messages!(
    ObjectSample,
    StateSample,
    ActionChunk,
    GroundingRecord,
    Plan,
    VerifierReport,
    CriticReport,
    Command,
    PolicyQuery,
    RebindRequest,
    TraceRecord
);

fn read<T: Message>(bytes: Option<&[u8]>) -> PyResult<Option<T>> {
    let Some(bytes) = bytes else { return Ok(None) };
    if bytes.len() != size_of::<T>() {
        let (name, wanted, got) = (T::NAME, size_of::<T>(), bytes.len());
        return Err(PyValueError::new_err(format!(
            "{name} has {wanted} bytes, not {got}"
        )));
    }
    // SAFETY: there are so many bytes, and any are a value.
    Ok(Some(unsafe { bytes.as_ptr().cast::<T>().read_unaligned() }))
}

fn write<'py, T: Message>(py: Python<'py>, message: &T) -> Bound<'py, PyBytes> {
    // SAFETY: every byte of it is one of a number.
    let bytes = unsafe {
        core::slice::from_raw_parts(core::ptr::from_ref(message).cast::<u8>(), size_of::<T>())
    };
    PyBytes::new(py, bytes)
}

type Bytes<'py> = Bound<'py, PyBytes>;
/// Command, query, rebind request, trace record, event.
type Answer<'py> = (
    Bytes<'py>,
    Option<Bytes<'py>>,
    Option<Bytes<'py>>,
    Option<Bytes<'py>>,
    Option<Bytes<'py>>,
);

/// What a controller remembers, and the parameters that it had.
#[pyclass(frozen)]
pub(crate) struct Snapshot {
    state: State,
    params: ValidParams,
}

/// Watches the policy and decides who acts.
#[pyclass]
pub(crate) struct Controller {
    core: Core,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(config: &Config) -> PyResult<Self> {
        let core = Core::new(config.valid()?);
        Ok(Self { core })
    }

    /// Decides one control tick. Messages are their bytes.
    #[pyo3(signature = (now_ns, state, chunk, grounding, plan, verifier, critic, request))]
    #[expect(
        clippy::too_many_arguments,
        reason = "one for each message of the core's input"
    )]
    fn tick<'py>(
        &mut self,
        py: Python<'py>,
        now_ns: u64,
        state: Option<&[u8]>,
        chunk: Option<&[u8]>,
        grounding: Option<&[u8]>,
        plan: Option<&[u8]>,
        verifier: Option<&[u8]>,
        critic: Option<&[u8]>,
        request: u8,
    ) -> PyResult<Answer<'py>> {
        let (state, chunk) = (read::<StateSample>(state)?, read::<ActionChunk>(chunk)?);
        let grounding = read::<GroundingRecord>(grounding)?;
        let (plan, verifier) = (read::<Plan>(plan)?, read::<VerifierReport>(verifier)?);
        let critic = read::<CriticReport>(critic)?;
        let input = Input {
            state: state.as_ref(),
            chunk: chunk.as_ref(),
            grounding: grounding.as_ref(),
            plan: plan.as_ref(),
            verifier: verifier.as_ref(),
            critic: critic.as_ref(),
            request,
        };
        let output = self.core.tick(now_ns, &input);
        Ok((
            write(py, &output.command),
            output.query.as_ref().map(|query| write(py, query)),
            output.rebind.as_ref().map(|rebind| write(py, rebind)),
            output.trace.as_ref().map(|trace| write(py, trace)),
            output.event.as_ref().map(|event| write(py, event)),
        ))
    }

    /// What the controller remembers now.
    fn snapshot(&self) -> Snapshot {
        Snapshot {
            state: self.core.state().clone(),
            params: *self.core.params(),
        }
    }

    /// Goes on from a snapshot of a controller with the same parameters; raises
    /// a `ValueError` for others.
    fn restore(&mut self, snapshot: &Snapshot) -> PyResult<()> {
        if snapshot.params.get() != self.core.params().get() {
            return Err(PyValueError::new_err(
                "snapshot: it is of a controller with other parameters",
            ));
        }
        self.core.restore(snapshot.state.clone());
        Ok(())
    }

    /// As new: forgets everything but its parameters.
    fn reset(&mut self) {
        self.core = Core::new(*self.core.params());
    }
}
