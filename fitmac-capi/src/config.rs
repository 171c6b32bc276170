//! Parameters in memory of the caller.

use core::{
    ffi::{c_char, c_void},
    fmt::Write as _,
    mem::size_of,
};

use fitmac_core::{ValidParams, params::Params};

use crate::{
    file,
    memory::{ALIGNMENT, Stamp, TextOut, assert_alignment, checked, room, text},
    status::{Outcome, Status, run},
};

const MAGIC: u64 = u64::from_le_bytes(*b"FITMAC-P");
/// Largest configuration file, bytes.
const FILE_MAX: usize = 64 << 10;

/// The parameters of a controller: an opaque value. It may be copied.
#[derive(Clone, Copy)]
pub struct Config {
    stamp: Stamp,
    params: Params,
}

const _: () = assert_alignment::<Config>();
const _: () = assert!(size_of::<Config>() <= FITMAC_CONFIG_STORAGE);

/// Bytes that are enough for a `fitmac_config`, for static memory.
pub const FITMAC_CONFIG_STORAGE: usize = 4 << 10;

impl Config {
    /// # Safety
    /// `config` is NULL or misaligned, or can be read as a `Config`.
    unsafe fn read(config: *const Self) -> Outcome<*const Self> {
        let config = checked(config)?;
        // SAFETY: it can be read; a stamp is numbers only.
        unsafe { (*config).stamp }.check::<Self>(MAGIC)?;
        Ok(config)
    }

    /// The parameters, checked.
    ///
    /// # Safety
    /// As for [`Self::read`].
    pub(crate) unsafe fn valid(config: *const Self) -> Outcome<ValidParams> {
        // SAFETY: promised; the stamp shows that it was initialised.
        let params = unsafe { (*Self::read(config)?).params };
        params.validate().map_err(|_| Status::OutOfRange)
    }
}

/// Bytes that a `fitmac_config` takes.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_config_size() -> usize {
    size_of::<Config>()
}

/// Alignment of a `fitmac_config`, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_config_alignment() -> usize {
    ALIGNMENT
}

/// Makes a configuration in `memory`, which has `size` bytes, with the values
/// of `profile`: "guarded" (do no harm; also for NULL) or "paper" (as
/// published). `config` gets the object's address, which is `memory`'s.
///
/// # Safety
/// Pointers that are not NULL point to memory of the said size; `profile` ends
/// with a NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_config_init(
    memory: *mut c_void,
    size: usize,
    profile: *const c_char,
    config: *mut *mut Config,
) -> Status {
    let make = || {
        let place = room::<Config>(memory, size)?;
        let out = checked(config)?.cast_mut();
        let params = if profile.is_null() {
            Params::guarded()
        } else {
            // SAFETY: not NULL, ends with a NUL.
            file::profile(unsafe { text(profile) }?)?
        };
        let stamp = Stamp::of::<Config>(MAGIC);
        // SAFETY: there is room; both pointers were checked.
        unsafe {
            place.write(Config { stamp, params });
            out.write(place);
        }
        Ok(())
    };
    run(make)
}

/// Sets one parameter: `key` like "gate.failure_streak", `value` like "3",
/// "0.25", "false" or "refuse". Ranges are checked by `fitmac_config_check` and
/// `fitmac_controller_init`.
///
/// # Safety
/// `config` is a configuration that no other thread uses now; the texts end
/// with a NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_config_set(
    config: *mut Config,
    key: *const c_char,
    value: *const c_char,
) -> Status {
    let set = || {
        // SAFETY: promised.
        let (config, key, value) =
            unsafe { (Config::read(config)?.cast_mut(), text(key)?, text(value)?) };
        // SAFETY: checked, and nobody else uses it.
        unsafe { &mut (*config).params }
            .assign(key, value)
            .map_err(file::refused)
    };
    run(set)
}

/// Reads the text of a configuration file: `profile = "paper"`, `[gate]`,
/// `failure_streak = 3`. What it does not name keeps its value; on an error
/// nothing changes, and `line`, if not NULL, gets the line (from 1).
///
/// # Safety
/// `config` is a configuration that no other thread uses now; `text` has
/// `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_config_parse(
    config: *mut Config,
    text: *const c_char,
    length: usize,
    line: *mut u32,
) -> Status {
    let mut at = 0;
    let parse = || {
        // SAFETY: promised.
        let config = unsafe { Config::read(config)? }.cast_mut();
        let text = checked(text.cast::<u8>())?;
        if length > FILE_MAX {
            return Err(Status::WrongSize);
        }
        // SAFETY: it has so many bytes.
        let bytes = unsafe { core::slice::from_raw_parts(text, length) };
        let text = core::str::from_utf8(bytes).map_err(|_| Status::BadValue)?;
        // SAFETY: checked, and nobody else uses it.
        let place = unsafe { &mut (*config).params };
        let mut params = *place;
        file::read(&mut params, text, &mut at)?;
        *place = params;
        Ok(())
    };
    let status = run(parse);
    if let Ok(line) = checked(line) {
        // SAFETY: not NULL, aligned.
        unsafe { line.cast_mut().write(at) };
    }
    status
}

/// Checks every parameter and the relations between them. If some do not hold,
/// `message`, if not NULL, gets all their names, values and ranges, cut to
/// `size` bytes with the NUL.
///
/// # Safety
/// `config` is a configuration that no other thread changes now; `message` has
/// room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fitmac_config_check(
    config: *const Config,
    message: *mut c_char,
    size: usize,
) -> Status {
    // SAFETY: promised.
    let mut out = unsafe { TextOut::new(message, size) };
    let check = || {
        // SAFETY: promised; the stamp shows that it was initialised.
        let params = unsafe { (*Config::read(config)?).params };
        params.validate().map(|_| ()).map_err(|violations| {
            // A text that is cut is no failure.
            let _cut = write!(out, "{violations}");
            Status::OutOfRange
        })
    };
    run(check)
}
