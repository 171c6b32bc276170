//! The tick.

use core::mem::{MaybeUninit, size_of};

use fitmac_core::message::{
    self, ActionChunk, Command, CriticReport, GroundingRecord, Plan, PolicyQuery, RebindRequest,
    StateSample, TraceRecord, VerifierReport,
};

use crate::{
    controller::{Controller, with},
    float::DefaultState,
    memory::{checked, optional},
    status::{Outcome, Status, answer},
};

/// Everything that arrived since the last tick. NULL means nothing new.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// `sizeof(fitmac_input)`.
    pub struct_size: u64,
    /// The newest robot state.
    pub state: *const StateSample,
    /// The newest action chunk.
    pub chunk: *const ActionChunk,
    /// The newest grounding record.
    pub grounding: *const GroundingRecord,
    /// The plan, at the start of an episode.
    pub plan: *const Plan,
    /// The newest word of the task verifier.
    pub verifier: *const VerifierReport,
    /// The newest word of the critic.
    pub critic: *const CriticReport,
    /// A request of the operator: `FITMAC_REQUEST_*`.
    pub request: u8,
    /// Zero.
    pub reserved: [u8; 7],
}

/// The answer to one tick. What the `has_` flags do not announce is left as it
/// was.
#[repr(C)]
pub struct Output {
    /// `sizeof(fitmac_output)`, set by the caller.
    pub struct_size: u64,
    /// How the host computes that is not IEEE 754's default: bits of
    /// `FITMAC_FLOAT_*`. The tick computed by the default nevertheless.
    pub float_state: u32,
    /// 1 if `query` was written: a request for an action chunk, to be sent to
    /// the policy.
    pub has_query: u8,
    /// 1 if `rebind` was written: a request to ground the target, to be sent to
    /// the agents.
    pub has_rebind: u8,
    /// 1 if `trace` was written: the record of a query whose first action
    /// starts in this tick.
    pub has_trace: u8,
    /// 1 if `event` was written: the record of a refusal or a change of mode.
    pub has_event: u8,
    /// The command for the robot; exactly one a tick.
    pub command: MaybeUninit<Command>,
    /// See `has_query`.
    pub query: MaybeUninit<PolicyQuery>,
    /// See `has_rebind`.
    pub rebind: MaybeUninit<RebindRequest>,
    /// See `has_trace`.
    pub trace: MaybeUninit<TraceRecord>,
    /// See `has_event`.
    pub event: MaybeUninit<TraceRecord>,
}

/// Decides one control tick at `now_ns`, nanoseconds of a monotonic clock.
/// Whatever the messages hold, one command comes out; an error means that the
/// call itself was wrong: nothing was decided, and the robot is to be stopped.
///
/// Messages are read, not kept. Nothing is allocated, locked or asked of the
/// operating system.
///
/// # Safety
/// `controller` is a controller, or memory of its size; every pointer that is
/// not NULL points to its type; no other thread writes to the messages or uses
/// `output` meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_tick(
    controller: *mut Controller,
    now_ns: u64,
    input: *const Input,
    output: *mut Output,
) -> Status {
    let tick = || {
        // SAFETY: promised; both are checked before they are touched.
        let (input, output) = unsafe { (read(input)?, writable(output)?) };
        let float = DefaultState::enter();
        // SAFETY: promised.
        unsafe {
            with(controller, |core| {
                let decided = core.tick(now_ns, &input);
                write(output, &decided, float.deviations());
                Ok(())
            })
        }
    };
    answer(tick())
}

/// # Safety
/// As [`fitmac_tick`] says.
unsafe fn read<'a>(input: *const Input) -> Outcome<message::Input<'a>> {
    let input = checked(input)?;
    // SAFETY: not NULL, aligned. The size is looked at before the rest, for a
    // shorter structure ends earlier.
    unsafe {
        if (*input).struct_size != size_of::<Input>() as u64 {
            return Err(Status::WrongSize);
        }
        let input = *input;
        Ok(message::Input {
            state: optional(input.state)?,
            chunk: optional(input.chunk)?,
            grounding: optional(input.grounding)?,
            plan: optional(input.plan)?,
            verifier: optional(input.verifier)?,
            critic: optional(input.critic)?,
            request: input.request,
        })
    }
}

/// # Safety
/// As [`fitmac_tick`] says.
unsafe fn writable(output: *mut Output) -> Outcome<*mut Output> {
    let output = checked(output)?.cast_mut();
    // SAFETY: not NULL, aligned.
    if unsafe { (*output).struct_size } != size_of::<Output>() as u64 {
        return Err(Status::WrongSize);
    }
    Ok(output)
}

/// # Safety
/// `output` is [`writable`].
unsafe fn write(output: *mut Output, decided: &message::Output, float_state: u32) {
    // SAFETY: promised. Inputs are not used any more: `output` may overlap.
    unsafe {
        (*output).float_state = float_state;
        (*output).command = MaybeUninit::new(decided.command);
        (*output).has_query = put(&mut (*output).query, decided.query.as_ref());
        (*output).has_rebind = put(&mut (*output).rebind, decided.rebind.as_ref());
        (*output).has_trace = put(&mut (*output).trace, decided.trace.as_ref());
        (*output).has_event = put(&mut (*output).event, decided.event.as_ref());
    }
}

fn put<T: Copy>(slot: &mut MaybeUninit<T>, message: Option<&T>) -> u8 {
    if let Some(message) = message {
        slot.write(*message);
    }
    u8::from(message.is_some())
}
