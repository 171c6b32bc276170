//! The controller and its snapshots in memory of the caller.

use core::{
    ffi::c_void,
    mem::size_of,
    panic::AssertUnwindSafe,
    sync::atomic::{AtomicU32, AtomicU64, Ordering},
};
use std::panic::catch_unwind;

use fitmac_core::{Controller as Core, State};

use crate::{
    FITMAC_ABI_VERSION,
    config::Config,
    fork,
    memory::{ALIGNMENT, Stamp, assert_alignment, checked, room},
    status::{Outcome, Status, run},
};

const MAGIC: u64 = u64::from_le_bytes(*b"FITMAC-C");
const SNAPSHOT_MAGIC: u64 = u64::from_le_bytes(*b"FITMAC-S");

const IDLE: u32 = 0;
const INSIDE: u32 = 1;
/// A call failed inside: what the object holds is not to be trusted.
const FAILED: u32 = 2;

/// A controller: an opaque object. It may not be moved or copied.
#[repr(align(16))]
pub struct Controller {
    /// [`MAGIC`] and the object's own address: shows that it lives here.
    mark: AtomicU64,
    use_: AtomicU32,
    generation: u32,
    core: Core,
}

const _: () = assert_alignment::<Controller>();
const _: () = assert!(size_of::<Controller>() <= FITMAC_CONTROLLER_STORAGE);

/// Bytes that are enough for a `fitmac_controller` of this version of the
/// interface, for static memory.
pub const FITMAC_CONTROLLER_STORAGE: usize = 32 << 10;

/// What a controller remembers, without its parameters: an opaque value. It
/// may be copied within the process.
pub struct Snapshot {
    stamp: Stamp,
    state: State,
}

const _: () = assert_alignment::<Snapshot>();
const _: () = assert!(size_of::<Snapshot>() <= FITMAC_SNAPSHOT_STORAGE);

/// Bytes that are enough for a `fitmac_snapshot`, for static memory.
pub const FITMAC_SNAPSHOT_STORAGE: usize = 32 << 10;

/// What may be done to a controller that failed inside.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AfterFailure {
    Refuse,
    Allow,
}

/// Runs `call` on the controller, alone, and lets no panic out.
///
/// # Safety
/// `controller` is NULL or misaligned, or can be read as a `Controller`.
pub(crate) unsafe fn with<R>(
    controller: *mut Controller,
    call: impl FnOnce(&mut Core) -> Outcome<R>,
) -> Outcome<R> {
    // SAFETY: promised.
    unsafe { with_state(controller, AfterFailure::Refuse, call) }
}

unsafe fn with_state<R>(
    controller: *mut Controller,
    after_failure: AfterFailure,
    call: impl FnOnce(&mut Core) -> Outcome<R>,
) -> Outcome<R> {
    let controller = checked(controller)?.cast_mut();
    // SAFETY: not NULL, aligned, readable; the fields are atomics or constant
    // while the object lives.
    let (mark, use_, generation) = unsafe {
        (
            &(*controller).mark,
            &(*controller).use_,
            (*controller).generation,
        )
    };
    if mark.load(Ordering::Acquire) != mark_at(controller) {
        return Err(Status::NotInitialised);
    }
    if generation != fork::generation() {
        return Err(Status::Forked);
    }
    let before = match use_.compare_exchange(IDLE, INSIDE, Ordering::Acquire, Ordering::Relaxed) {
        Ok(idle) => idle,
        Err(FAILED) if after_failure == AfterFailure::Refuse => return Err(Status::Panicked),
        Err(FAILED) => use_
            .compare_exchange(FAILED, INSIDE, Ordering::Acquire, Ordering::Relaxed)
            .map_err(|_| Status::Busy)?,
        Err(_) => return Err(Status::Busy),
    };
    debug_assert!(before != INSIDE);
    // SAFETY: `use_` makes us the only one inside.
    let core = unsafe { &mut (*controller).core };
    let (left_as, outcome) = match catch_unwind(AssertUnwindSafe(|| call(core))) {
        Ok(outcome) => (IDLE, outcome),
        Err(_) => (FAILED, Err(Status::Panicked)),
    };
    use_.store(left_as, Ordering::Release);
    outcome
}

fn mark_at(controller: *const Controller) -> u64 {
    MAGIC ^ controller.addr() as u64
}

/// Bytes that a `fitmac_controller` takes; at most `FITMAC_CONTROLLER_STORAGE`.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_controller_size() -> usize {
    size_of::<Controller>()
}

/// Alignment of a `fitmac_controller`, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_controller_alignment() -> usize {
    ALIGNMENT
}

/// Makes a controller in `memory`, which has `size` bytes and which nobody else
/// uses meanwhile. `abi_version` is `FITMAC_ABI_VERSION`, as the caller was
/// compiled with. `controller` gets the object's address, which is `memory`'s.
///
/// # Safety
/// Pointers that are not NULL point to memory of the said size; `config` is a
/// configuration.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_controller_init(
    memory: *mut c_void,
    size: usize,
    abi_version: u32,
    config: *const Config,
    controller: *mut *mut Controller,
) -> Status {
    let make = || {
        if abi_version != FITMAC_ABI_VERSION {
            return Err(Status::WrongVersion);
        }
        let place = room::<Controller>(memory, size)?;
        let out = checked(controller)?.cast_mut();
        // SAFETY: promised.
        let params = unsafe { Config::valid(config) }?;
        let core = Core::new(params);
        // SAFETY: there is room; both pointers were checked.
        unsafe {
            place.write(Controller {
                mark: AtomicU64::new(mark_at(place)),
                use_: AtomicU32::new(IDLE),
                generation: fork::watch(),
                core,
            });
            out.write(place);
        }
        Ok(())
    };
    run(make)
}

/// Retires a controller: later calls on it are refused. There is nothing to
/// free; this only turns a use after the end into an error.
///
/// # Safety
/// `controller` is a controller, or memory of its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_controller_deinit(controller: *mut Controller) -> Status {
    let retire = || {
        // SAFETY: promised.
        unsafe { with_state(controller, AfterFailure::Allow, |_| Ok(())) }?;
        // SAFETY: it is a controller.
        unsafe { &(*controller).mark }.store(0, Ordering::Release);
        Ok(())
    };
    run(retire)
}

/// Makes a controller as new: it forgets everything but its parameters. (To
/// start another episode, send `FITMAC_REQUEST_RESET` with a tick.)
///
/// # Safety
/// `controller` is a controller, or memory of its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_reset(controller: *mut Controller) -> Status {
    let reset = |core: &mut Core| {
        *core = Core::new(*core.params());
        Ok(())
    };
    // SAFETY: promised.
    run(|| unsafe { with_state(controller, AfterFailure::Allow, reset) })
}

/// Bytes that a `fitmac_snapshot` takes.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_snapshot_size() -> usize {
    size_of::<Snapshot>()
}

/// Alignment of a `fitmac_snapshot`, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_snapshot_alignment() -> usize {
    ALIGNMENT
}

/// Writes what the controller remembers into `memory`, which has `size` bytes.
///
/// # Safety
/// `controller` is a controller, or memory of its size; `memory` is used by
/// nobody else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_take_snapshot(
    controller: *mut Controller,
    memory: *mut c_void,
    size: usize,
) -> Status {
    let take = || {
        let place = room::<Snapshot>(memory, size)?;
        let write = |core: &mut Core| {
            let stamp = Stamp::of::<Snapshot>(SNAPSHOT_MAGIC);
            let state = core.state().clone();
            // SAFETY: there is room, and nobody else uses it.
            unsafe { place.write(Snapshot { stamp, state }) };
            Ok(())
        };
        // SAFETY: promised.
        unsafe { with(controller, write) }
    };
    run(take)
}

/// Goes on from a snapshot of a controller with the same parameters. Bytes that
/// no `fitmac_take_snapshot` of this process wrote are refused as far as
/// their stamp shows it; don't load snapshots from files: replay a trace.
///
/// # Safety
/// `controller` is a controller, or memory of its size; `memory` has `size`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_restore(
    controller: *mut Controller,
    memory: *const c_void,
    size: usize,
) -> Status {
    let restore = || {
        let place = room::<Snapshot>(memory.cast_mut(), size)?;
        // SAFETY: readable; a stamp is numbers only.
        unsafe { (*place).stamp }.check::<Snapshot>(SNAPSHOT_MAGIC)?;
        let read = |core: &mut Core| {
            // SAFETY: the stamp shows that it is a snapshot.
            core.restore(unsafe { (*place).state.clone() });
            Ok(())
        };
        // SAFETY: promised.
        unsafe { with_state(controller, AfterFailure::Allow, read) }
    };
    run(restore)
}

#[cfg(test)]
mod tests;
