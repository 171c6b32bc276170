//! What a call answers.

use core::{ffi::c_char, panic::AssertUnwindSafe};
use std::panic::catch_unwind;

use crate::float::DefaultState;

/// What a call answers: 0 is success, all else an error that changed nothing.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A pointer is NULL that must not be.
    NullPointer = 1,
    /// A pointer does not fit the alignment of what it points to.
    Misaligned = 2,
    /// The memory is too small, or a structure has another size.
    WrongSize = 3,
    /// Caller and library were built for different versions of this interface.
    WrongVersion = 4,
    /// The memory holds no such object: never initialised, retired, or moved.
    NotInitialised = 5,
    /// Another thread, or this one further up, is inside a call on the object.
    Busy = 6,
    /// The process was forked: the controller belongs to the parent.
    Forked = 7,
    /// The library failed inside; the controller must be reset or initialised again.
    Panicked = 8,
    /// There is no such parameter or profile.
    UnknownKey = 9,
    /// The text is no value of the parameter's type, or no UTF-8, or too long.
    BadValue = 10,
    /// The configuration's text is not `[stage]` and `key = value` lines.
    BadSyntax = 11,
    /// Parameters are out of range or contradict each other.
    OutOfRange = 12,
}

impl Status {
    const ALL: [Self; 13] = [
        Self::Ok,
        Self::NullPointer,
        Self::Misaligned,
        Self::WrongSize,
        Self::WrongVersion,
        Self::NotInitialised,
        Self::Busy,
        Self::Forked,
        Self::Panicked,
        Self::UnknownKey,
        Self::BadValue,
        Self::BadSyntax,
        Self::OutOfRange,
    ];

    const fn text(self) -> &'static str {
        match self {
            Self::Ok => "done\0",
            Self::NullPointer => "a pointer is NULL that must not be\0",
            Self::Misaligned => "a pointer does not fit the alignment of what it points to\0",
            Self::WrongSize => {
                "the memory is too small, or a struct_size is not the header's: ask the _size() function\0"
            }
            Self::WrongVersion => {
                "caller and library were built for different versions of fitmac.h\0"
            }
            Self::NotInitialised => {
                "the memory holds no such object: it was not initialised, was retired, or was moved\0"
            }
            Self::Busy => {
                "another thread, or this one further up, is inside a call on this controller\0"
            }
            Self::Forked => {
                "the process was forked since the controller was initialised: only the parent may use it\0"
            }
            Self::Panicked => {
                "the library failed inside a call: stop the robot, then reset or initialise again\0"
            }
            Self::UnknownKey => "there is no such parameter or profile\0",
            Self::BadValue => "the text is no value of the parameter's type\0",
            Self::BadSyntax => "the configuration is not made of [stage] and key = value lines\0",
            Self::OutOfRange => {
                "parameters are out of range or contradict each other: fitmac_config_check() names them\0"
            }
        }
    }
}

/// What a status means, as text that lives as long as the program. Any number
/// has a text.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_status_text(status: u32) -> *const c_char {
    let known = Status::ALL.iter().find(|known| **known as u32 == status);
    known
        .map_or("no status of this library\0", |known| known.text())
        .as_ptr()
        .cast()
}

pub(crate) type Outcome<T> = Result<T, Status>;

/// The answer of a call whose outcome is known.
pub(crate) fn answer(outcome: Outcome<()>) -> Status {
    match outcome {
        Ok(()) => Status::Ok,
        Err(status) => status,
    }
}

/// The answer of a call that computes: by the default floating-point state,
/// and without letting a panic out.
pub(crate) fn run(call: impl FnOnce() -> Outcome<()>) -> Status {
    let _float = DefaultState::enter();
    let outcome = catch_unwind(AssertUnwindSafe(call));
    answer(outcome.unwrap_or(Err(Status::Panicked)))
}
