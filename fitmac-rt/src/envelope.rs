//! The envelope around every message: who sent it, when, and in what layout.
//!
//! A message from another process is copied once into private memory, and the
//! copy is checked: what the sender does to the original afterwards changes
//! nothing.
#![allow(unsafe_code)]

use crate::layout::Payload;

/// "FMAC" in memory.
pub const MAGIC: u32 = u32::from_le_bytes(*b"FMAC");
/// Rises with every incompatible change of the envelope or the protocol.
pub const ABI_VERSION: u16 = 1;

/// The head of every message.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// [`MAGIC`].
    pub magic: u32,
    /// [`ABI_VERSION`].
    pub abi_version: u16,
    /// Zero.
    pub reserved: u16,
    /// Size of the payload, bytes.
    pub payload_size: u64,
    /// [`crate::layout::Layout::schema_hash`] of the payload.
    pub schema_hash: u64,
    /// Names the run of the sender; a later run has a greater number.
    pub session: u64,
    /// Rises by one with each message of a sender on a service, from 1.
    pub sequence: u64,
    /// When it was sent, ns of the monotonic clock.
    pub stamp_ns: u64,
}

/// A message in its envelope.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Envelope<T> {
    /// The head.
    pub header: Header,
    /// The message.
    pub payload: T,
}

/// Why a message was dropped unread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HeaderFault {
    /// Not one of our messages.
    #[error("the magic number is {0:#010x}: the sender is not FIT-MAC or its memory is corrupt")]
    Magic(u32),
    /// Another version of the protocol.
    #[error(
        "the sender speaks version {0} of the protocol, this process {ABI_VERSION}: build both from one release"
    )]
    Abi(u16),
    /// Another size of the payload.
    #[error(
        "the payload has {found} bytes instead of {expected}: build both sides from one release"
    )]
    Size {
        /// What the header says.
        found: u64,
        /// What this build expects.
        expected: u64,
    },
    /// Another layout of the payload.
    #[error(
        "the payload's layout differs (schema {found:016x} instead of {expected:016x}): build both sides from one release"
    )]
    Schema {
        /// What the header says.
        found: u64,
        /// What this build expects.
        expected: u64,
    },
}

impl<T: Payload> Envelope<T> {
    /// The hash of the payload's layout.
    pub const SCHEMA_HASH: u64 = T::LAYOUT.schema_hash();

    const NO_PADDING: () = assert!(
        size_of::<Self>() == size_of::<Header>() + size_of::<T>(),
        "an envelope has padding"
    );

    /// An empty place to receive into.
    #[must_use]
    pub fn empty() -> Self {
        Self::new(0, 0, 0, T::zeroed())
    }

    /// A message in a well-formed envelope.
    #[must_use]
    pub fn new(session: u64, sequence: u64, stamp_ns: u64, payload: T) -> Self {
        let () = Self::NO_PADDING;
        Self {
            header: Self::header(session, sequence, stamp_ns),
            payload,
        }
    }

    /// A well-formed head.
    #[must_use]
    pub fn header(session: u64, sequence: u64, stamp_ns: u64) -> Header {
        Header {
            magic: MAGIC,
            abi_version: ABI_VERSION,
            reserved: 0,
            payload_size: size_of::<T>() as u64,
            schema_hash: Self::SCHEMA_HASH,
            session,
            sequence,
            stamp_ns,
        }
    }

    /// Checks the head of a private copy.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check(&self) -> Result<(), HeaderFault> {
        let Header {
            magic,
            abi_version,
            payload_size,
            schema_hash,
            ..
        } = self.header;
        let expected = size_of::<T>() as u64;
        if magic != MAGIC {
            Err(HeaderFault::Magic(magic))
        } else if abi_version != ABI_VERSION {
            Err(HeaderFault::Abi(abi_version))
        } else if payload_size != expected {
            Err(HeaderFault::Size {
                found: payload_size,
                expected,
            })
        } else if schema_hash != Self::SCHEMA_HASH {
            Err(HeaderFault::Schema {
                found: schema_hash,
                expected: Self::SCHEMA_HASH,
            })
        } else {
            Ok(())
        }
    }

    /// Copies an envelope out of memory that its sender can still write to:
    /// once, and no more of a counted array than is in use. What stood here
    /// behind that stays.
    ///
    /// # Safety
    /// `source` must point to a readable, aligned envelope.
    pub unsafe fn copy_from_shared(&mut self, source: *const Self) {
        let sent = source.cast::<u8>();
        match const { T::LAYOUT.tail() } {
            // SAFETY: the caller's promise.
            None => unsafe { self.copy_bytes(sent, 0, size_of::<Self>()) },
            Some(tail) => {
                let fixed = size_of::<Header>() + tail.offset();
                // SAFETY: the caller's promise.
                unsafe { self.copy_bytes(sent, 0, fixed) };
                // Our copy says how much follows, and never more than there is.
                let used = size_of::<Header>() + tail.used(self.payload.as_bytes());
                // SAFETY: the caller's promise.
                unsafe { self.copy_bytes(sent, fixed, used) };
            }
        }
        // The copy is what is read from here on: the compiler must not go
        // back to the shared original.
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
        core::hint::black_box(self);
    }

    /// Copies the bytes from `begin` to `end`.
    ///
    /// # Safety
    /// `source` must point to a readable envelope.
    unsafe fn copy_bytes(&mut self, source: *const u8, begin: usize, end: usize) {
        assert!(begin <= end && end <= size_of::<Self>());
        let to = core::ptr::from_mut(self).cast::<u8>();
        // SAFETY: both are envelopes, `source` by the caller's promise; the
        // range lies within, and every bit pattern is valid.
        unsafe { core::ptr::copy_nonoverlapping(source.add(begin), to.add(begin), end - begin) };
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
        core::hint::black_box(self);
    }
}

/// The type name under which a service carries `T`: name, version, schema hash.
#[must_use]
pub fn type_name<T: Payload>() -> &'static str {
    Named::<T>::TEXT
}

struct Named<T>(core::marker::PhantomData<T>);

impl<T: Payload> Named<T> {
    const BYTES: ([u8; 96], usize) = {
        let mut out = [0; 96];
        let mut n = push(&mut out, 0, "Fitmac.");
        n = push(&mut out, n, T::LAYOUT.name);
        n = push(&mut out, n, ".v");
        out[n] = b'0' + ABI_VERSION as u8;
        out[n + 1] = b'.';
        n += 2;
        let hash = T::LAYOUT.schema_hash();
        let mut shift = 64;
        while shift > 0 {
            shift -= 4;
            out[n] = b"0123456789abcdef"[((hash >> shift) & 15) as usize];
            n += 1;
        }
        (out, n)
    };
    const TEXT: &str = match core::str::from_utf8(Self::BYTES.0.split_at(Self::BYTES.1).0) {
        Ok(text) => text,
        Err(_) => panic!("a message's name is not UTF-8"),
    };
}

const _: () = assert!(ABI_VERSION < 10, "the type name holds one digit");

const fn push(out: &mut [u8; 96], mut at: usize, text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut i = 0;
    while i < bytes.len() {
        out[at] = bytes[i];
        at += 1;
        i += 1;
    }
    at
}

// SAFETY: `repr(C)`, no pointers, no padding, every bit pattern valid
// (`Payload`), and the type name carries a hash of the layout.
unsafe impl<T: Payload> iceoryx2::prelude::ZeroCopySend for Envelope<T> {
    unsafe fn type_name() -> &'static str {
        type_name::<T>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitmac_core::message::{Command, StateSample};

    #[test]
    fn names_carry_version_and_schema() {
        let name = type_name::<StateSample>();
        let hash = format!("{:016x}", Envelope::<StateSample>::SCHEMA_HASH);
        assert_eq!(name, format!("Fitmac.StateSample.v{ABI_VERSION}.{hash}"));
        assert_ne!(
            Envelope::<StateSample>::SCHEMA_HASH,
            Envelope::<Command>::SCHEMA_HASH
        );
    }

    #[test]
    fn every_field_of_the_head_is_checked() {
        let good = Envelope::new(1, 2, 3, StateSample::default());
        assert_eq!(good.check(), Ok(()));
        let mut e = good;
        e.header.magic ^= 1;
        assert!(matches!(e.check(), Err(HeaderFault::Magic(_))));
        let mut e = good;
        e.header.abi_version += 1;
        assert!(matches!(e.check(), Err(HeaderFault::Abi(2))));
        let mut e = good;
        e.header.payload_size -= 1;
        assert!(matches!(e.check(), Err(HeaderFault::Size { .. })));
        let mut e = good;
        e.header.schema_hash ^= 1;
        assert!(matches!(e.check(), Err(HeaderFault::Schema { .. })));
    }
}
