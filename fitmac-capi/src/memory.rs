//! Memory and text of the caller: what must hold before it is touched.

use core::{
    ffi::{c_char, c_void},
    mem::{align_of, size_of},
};

use crate::{
    FITMAC_ABI_VERSION,
    status::{Outcome, Status},
};

/// Longest key, value or profile name, bytes.
const TEXT_MAX: usize = 256;

/// A pointer that may be read or written as a `T`.
pub(crate) fn checked<T>(pointer: *const T) -> Outcome<*const T> {
    if pointer.is_null() {
        return Err(Status::NullPointer);
    }
    if !pointer.is_aligned() {
        return Err(Status::Misaligned);
    }
    Ok(pointer)
}

/// The same, for memory in which an object shall begin to live.
pub(crate) fn room<T>(memory: *mut c_void, size: usize) -> Outcome<*mut T> {
    let pointer = checked(memory.cast::<T>().cast_const())?.cast_mut();
    if size < size_of::<T>() {
        return Err(Status::WrongSize);
    }
    Ok(pointer)
}

/// A message of the caller that may be absent.
///
/// # Safety
/// A pointer that is neither NULL nor misaligned points to a `T` that lives
/// and does not change as long as `'a`.
pub(crate) unsafe fn optional<'a, T>(pointer: *const T) -> Outcome<Option<&'a T>> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: aligned and not NULL; the rest is promised. Messages are numbers
    // only: any bytes are a valid value.
    checked(pointer).map(|p| Some(unsafe { &*p }))
}

/// Text of the caller, up to its NUL.
///
/// # Safety
/// `text` is NULL, or points to bytes that can be read up to a NUL.
pub(crate) unsafe fn text<'a>(text: *const c_char) -> Outcome<&'a str> {
    if text.is_null() {
        return Err(Status::NullPointer);
    }
    // SAFETY: no byte after the NUL is read.
    let length = (0..TEXT_MAX).find(|&i| unsafe { *text.add(i) } == 0);
    let length = length.ok_or(Status::BadValue)?;
    // SAFETY: these bytes were just read.
    let bytes = unsafe { core::slice::from_raw_parts(text.cast::<u8>(), length) };
    core::str::from_utf8(bytes).map_err(|_| Status::BadValue)
}

/// What plain objects begin with: shows what the memory holds.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub(crate) struct Stamp {
    magic: u64,
    size: u32,
    abi_version: u32,
}

impl Stamp {
    pub(crate) const fn of<T>(magic: u64) -> Self {
        Self {
            magic,
            size: size_of::<T>() as u32,
            abi_version: FITMAC_ABI_VERSION,
        }
    }

    pub(crate) const fn check<T>(self, magic: u64) -> Outcome<()> {
        if self.magic != magic {
            return Err(Status::NotInitialised);
        }
        if self.abi_version != FITMAC_ABI_VERSION {
            return Err(Status::WrongVersion);
        }
        if self.size as usize != size_of::<T>() {
            return Err(Status::WrongSize);
        }
        Ok(())
    }
}

/// The alignment of every object of this interface: what C's `malloc` and
/// `max_align_t` give.
pub(crate) const ALIGNMENT: usize = 16;

/// Fails the build if `T` asks for more than [`ALIGNMENT`].
pub(crate) const fn assert_alignment<T>() {
    assert!(align_of::<T>() == ALIGNMENT);
}

/// Writes text for the caller: as much as fits, with a NUL at the end.
pub(crate) struct TextOut {
    to: *mut u8,
    left: usize,
}

impl TextOut {
    /// # Safety
    /// `to` is NULL or has room for `size` bytes.
    pub(crate) unsafe fn new(to: *mut c_char, size: usize) -> Self {
        let left = if to.is_null() { 0 } else { size };
        if left > 0 {
            // SAFETY: there is room for at least one byte.
            unsafe { to.write(0) };
        }
        Self {
            to: to.cast(),
            left,
        }
    }
}

impl core::fmt::Write for TextOut {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        let mut fits = text.len().min(self.left.saturating_sub(1));
        while !text.is_char_boundary(fits) {
            fits -= 1;
        }
        if fits > 0 {
            // SAFETY: `fits` and the NUL are within what is left.
            unsafe {
                self.to.copy_from_nonoverlapping(text.as_ptr(), fits);
                self.to = self.to.add(fits);
                self.to.write(0);
            }
            self.left -= fits;
        }
        if fits < text.len() {
            self.left = 0; // what follows must not be glued to a cut
        }
        Ok(())
    }
}
