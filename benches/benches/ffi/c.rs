//! The loop in C.

use std::{ffi::c_void, ops::Range, ptr};

use anyhow::{Context, ensure};
use fitmac_benches::peers;
use fitmac_capi::{
    Config, Controller, FITMAC_ABI_VERSION, Input, Output, Status, fitmac_config_init,
    fitmac_controller_init, fitmac_reset, fitmac_tick,
};
use libloading::Library;

use crate::inputs::Step;

type Tick = unsafe extern "C" fn(*mut Controller, u64, *const Input, *mut Output) -> Status;
type Loop = unsafe extern "C" fn(
    Tick,
    *mut Controller,
    *const u64,
    *const Input,
    u64,
    *mut Output,
) -> Status;

#[repr(C, align(16))]
struct Memory([u8; 64 << 10]);

impl Memory {
    fn new() -> Box<Self> {
        Box::new(Self([0; 64 << 10]))
    }

    fn at(&mut self) -> (*mut c_void, usize) {
        (self.0.as_mut_ptr().cast(), self.0.len())
    }
}

/// A host in C and what it holds.
pub(crate) struct Host<'a> {
    run: Loop,
    controller: *mut Controller,
    now_ns: Vec<u64>,
    inputs: Vec<Input>,
    output: Box<Output>,
    _memory: [Box<Memory>; 2],
    _library: Library,
    _steps: &'a [Step],
}

fn pointer<T>(message: Option<&T>) -> *const T {
    message.map_or(ptr::null(), ptr::from_ref)
}

impl<'a> Host<'a> {
    /// Compiles the loop and makes a controller.
    pub(crate) fn new(steps: &'a [Step]) -> anyhow::Result<Self> {
        let path = peers::ffi_loop()?;
        // SAFETY: the library is our own file and runs nothing when it is loaded.
        let library = unsafe { Library::new(&path) };
        let library = library.with_context(|| format!("{} cannot be loaded", path.display()))?;
        // SAFETY: the function has this signature in `ffi_loop.c`.
        let run = unsafe { *library.get::<Loop>(b"ffi_loop\0")? };
        let mut memory = [Memory::new(), Memory::new()];
        let (mut config, mut controller): (*mut Config, *mut Controller) =
            (ptr::null_mut(), ptr::null_mut());
        let (at, size) = memory[0].at();
        // SAFETY: memory of that size that lives as long as the host.
        let made = unsafe { fitmac_config_init(at, size, ptr::null(), &raw mut config) };
        ensure!(made == Status::Ok, "fitmac_config_init: {made:?}");
        let (at, size) = memory[1].at();
        // SAFETY: as before, and a configuration.
        let made = unsafe {
            fitmac_controller_init(at, size, FITMAC_ABI_VERSION, config, &raw mut controller)
        };
        ensure!(made == Status::Ok, "fitmac_controller_init: {made:?}");
        let input = |step: &Step| Input {
            struct_size: size_of::<Input>() as u64,
            state: pointer(step.state.as_deref()),
            chunk: pointer(step.chunk.as_deref()),
            grounding: pointer(step.grounding.as_deref()),
            plan: pointer(step.plan.as_deref()),
            verifier: pointer(step.verifier.as_deref()),
            critic: pointer(step.critic.as_deref()),
            request: step.request,
            reserved: [0; 7],
        };
        // SAFETY: an output is numbers, of which zero is one.
        let mut output: Box<Output> = unsafe { Box::new(std::mem::zeroed()) };
        output.struct_size = size_of::<Output>() as u64;
        Ok(Self {
            run,
            controller,
            now_ns: steps.iter().map(|step| step.now_ns).collect(),
            inputs: steps.iter().map(input).collect(),
            output,
            _memory: memory,
            _library: library,
            _steps: steps,
        })
    }

    /// Runs through some of the inputs; from the first one on a controller as new.
    pub(crate) fn run(&mut self, steps: Range<usize>) {
        let count = steps.len() as u64;
        let (now_ns, inputs) = (&self.now_ns[steps.clone()], &self.inputs[steps.clone()]);
        // SAFETY: the controller, the inputs and the messages that they point to live as long as
        // the host.
        let status = unsafe {
            let status = match steps.start {
                0 => fitmac_reset(self.controller),
                _ => Status::Ok,
            };
            match status {
                Status::Ok => (self.run)(
                    fitmac_tick,
                    self.controller,
                    now_ns.as_ptr(),
                    inputs.as_ptr(),
                    count,
                    &raw mut *self.output,
                ),
                status => status,
            }
        };
        assert_eq!(status, Status::Ok, "the loop in C failed");
    }
}
