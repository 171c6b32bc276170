//! Messages as plain bytes.
#![allow(unsafe_code)]

use super::{Field, Kind, Layout, Meaning, Shape};

/// A type that may be a field of a message.
///
/// # Safety
/// Every bit pattern of `Self` must be valid, and `Self` must have no padding,
/// no pointers and the size that `KIND` and `SHAPE` tell.
pub unsafe trait Plain: Copy + 'static {
    /// The type of one element.
    const KIND: Kind;
    /// The number of elements.
    const SHAPE: Shape;
}

macro_rules! plain {
    ($($ty:ty = $kind:ident),+) => {$(
        // SAFETY: a primitive number: no padding, no invalid bit pattern.
        unsafe impl Plain for $ty {
            const KIND: Kind = Kind::$kind;
            const SHAPE: Shape = Shape::Scalar;
        }
    )+};
}
plain!(
    u8 = U8,
    u16 = U16,
    u32 = U32,
    u64 = U64,
    f32 = F32,
    f64 = F64
);

// SAFETY: an array has no padding between its elements.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {
    const KIND: Kind = T::KIND;
    const SHAPE: Shape = match T::SHAPE {
        Shape::Scalar => Shape::Vector(N),
        Shape::Vector(columns) => Shape::Matrix(N, columns),
        Shape::Matrix(..) => panic!("a field has at most two dimensions"),
    };
}

/// A message: plain data with a known layout. Implemented by the `layout!` macro.
///
/// # Safety
/// `Self` is `repr(C)`; `LAYOUT` lists all of its fields, each [`Plain`],
/// without gaps. Then every bit pattern is a valid value.
pub unsafe trait Payload: Copy + core::fmt::Debug + Send + 'static {
    /// The layout.
    const LAYOUT: Layout;

    /// The message's bytes.
    fn as_bytes(&self) -> &[u8] {
        // SAFETY: no padding (checked by `layout!`), so every byte is initialised.
        unsafe { core::slice::from_raw_parts(core::ptr::from_ref(self).cast(), size_of::<Self>()) }
    }

    /// The bytes in use: those before the unused part of a counted array.
    fn used_bytes(&self) -> &[u8] {
        let bytes = self.as_bytes();
        match const { Self::LAYOUT.tail() } {
            Some(tail) => &bytes[..tail.used(bytes)],
            None => bytes,
        }
    }

    /// The message with all bytes zero.
    #[must_use]
    fn zeroed() -> Self {
        // SAFETY: every bit pattern is valid.
        unsafe { core::mem::zeroed() }
    }

    /// The message from its bytes; missing ones at the end are zero, excess
    /// ones are ignored.
    #[must_use]
    fn from_bytes(bytes: &[u8]) -> Self {
        let mut message = Self::zeroed();
        let n = bytes.len().min(size_of::<Self>());
        // SAFETY: both regions hold `n` bytes, and every bit pattern is valid.
        unsafe {
            core::ptr::copy_nonoverlapping(
                bytes.as_ptr(),
                core::ptr::from_mut(&mut message).cast::<u8>(),
                n,
            );
        }
        message
    }
}

/// Helps [`layout!`] to infer a field's type.
#[doc(hidden)]
#[must_use]
pub const fn describe<S, F: Plain>(
    name: &'static str,
    offset: usize,
    _project: fn(&S) -> &F,
    meaning: Meaning,
) -> Field {
    assert!(size_of::<F>() == F::KIND.size() * F::SHAPE.count());
    Field {
        name,
        offset,
        kind: F::KIND,
        shape: F::SHAPE,
        meaning,
    }
}

/// Declares the layout of a `repr(C)` message: `layout!(Type, "Name" { field, field: meaning })`.
///
/// Fails the build if a field is missing, out of order, or of a type that is
/// not plain, or if the message has padding.
macro_rules! layout {
    ($ty:ty, $name:literal { $($field:ident $(: $meaning:expr)?),+ $(,)? }) => {
        // SAFETY: `describe` admits plain fields only, and `checked` fails the
        // build if they do not fill the type from the first byte to the last.
        #[allow(unsafe_code)]
        unsafe impl $crate::layout::Payload for $ty {
            const LAYOUT: $crate::layout::Layout = $crate::layout::checked(
                $crate::layout::Layout {
                    name: $name,
                    size: size_of::<$ty>(),
                    fields: &[$($crate::layout::describe::<$ty, _>(
                        stringify!($field),
                        core::mem::offset_of!($ty, $field),
                        |message| &message.$field,
                        $crate::layout::layout!(@meaning $($meaning)?),
                    ),)+],
                },
            );
        }

        // SAFETY: as above; a message may be a field of another.
        #[allow(unsafe_code)]
        unsafe impl $crate::layout::Plain for $ty {
            const KIND: $crate::layout::Kind =
                $crate::layout::Kind::Struct(&<$ty as $crate::layout::Payload>::LAYOUT);
            const SHAPE: $crate::layout::Shape = $crate::layout::Shape::Scalar;
        }

        const _: $crate::layout::Layout = <$ty as $crate::layout::Payload>::LAYOUT;
    };
    (@meaning) => { $crate::layout::Meaning::Number };
    (@meaning $meaning:expr) => { $meaning };
}
pub(crate) use layout;

/// Returns the layout if it is gapless, and fails the build otherwise.
#[doc(hidden)]
#[must_use]
pub const fn checked(layout: Layout) -> Layout {
    layout.assert_gapless();
    layout
}
