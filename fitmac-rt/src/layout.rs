//! What a message looks like in memory, as data.
//!
//! One table a message, checked by the compiler, serves everything that must
//! know the layout: the schema hash in the service's type name, the protobuf
//! descriptors and codec of the trace, the CSV columns, and the name of the
//! first field in which two records differ.
#![allow(unsafe_code)]

/// The type of one element of a field.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Unsigned byte.
    U8,
    /// Unsigned, 16 bits.
    U16,
    /// Unsigned, 32 bits.
    U32,
    /// Unsigned, 64 bits.
    U64,
    /// IEEE 754 single.
    F32,
    /// IEEE 754 double.
    F64,
    /// Another message, nested.
    Struct(&'static Layout),
}

impl Kind {
    /// Bytes of one element.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
            Self::U64 | Self::F64 => 8,
            Self::Struct(layout) => layout.size,
        }
    }

    const fn tag(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::U16 => "u16",
            Self::U32 => "u32",
            Self::U64 => "u64",
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Struct(layout) => layout.name,
        }
    }
}

/// How many elements a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One.
    Scalar,
    /// An array.
    Vector(usize),
    /// An array of arrays: rows, columns.
    Matrix(usize, usize),
}

impl Shape {
    /// Elements in all.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vector(n) => n,
            Self::Matrix(rows, columns) => rows * columns,
        }
    }
}

/// A closed vocabulary whose codes a byte carries.
#[derive(Clone, Copy, Debug)]
pub struct Vocabulary {
    /// Its name, as the type is called.
    pub name: &'static str,
    /// Its codes and their names.
    pub members: fn() -> Vec<(u8, &'static str)>,
}

/// What the numbers of a field stand for.
#[derive(Clone, Copy, Debug)]
pub enum Meaning {
    /// The number itself.
    Number,
    /// A code of a vocabulary.
    Code(Vocabulary),
    /// A set of named bits.
    Bits(&'static [(u64, &'static str)]),
    /// UTF-8 text; the named field holds its length in bytes.
    Text(&'static str),
    /// An array of which only the first elements (rows of a matrix) count; the
    /// named field holds how many.
    CountedBy(&'static str),
}

/// One field of a message.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its name; the unit stands last in it.
    pub name: &'static str,
    /// Where it begins, bytes.
    pub offset: usize,
    /// Its element type.
    pub kind: Kind,
    /// Its number of elements.
    pub shape: Shape,
    /// What it stands for.
    pub meaning: Meaning,
}

impl Field {
    /// Bytes of the whole field.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.kind.size() * self.shape.count()
    }
}

/// The layout of a message.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// The message's name.
    pub name: &'static str,
    /// Its size, bytes.
    pub size: usize,
    /// Its fields, in the order of their offsets, without gaps.
    pub fields: &'static [Field],
}

impl Layout {
    /// A hash of names, types, shapes and offsets (FNV-1a): two builds that
    /// agree on it agree on every byte's meaning.
    #[must_use]
    pub const fn schema_hash(&self) -> u64 {
        self.hash_into(0xcbf2_9ce4_8422_2325)
    }

    const fn hash_into(&self, mut hash: u64) -> u64 {
        hash = hash_text(hash, self.name);
        hash = hash_number(hash, self.size);
        let mut i = 0;
        while i < self.fields.len() {
            let field = &self.fields[i];
            hash = hash_text(hash, field.name);
            hash = hash_text(hash, field.kind.tag());
            hash = hash_number(hash, field.offset);
            hash = hash_number(hash, field.shape.count());
            if let Kind::Struct(inner) = field.kind {
                hash = inner.hash_into(hash);
            }
            i += 1;
        }
        hash
    }

    /// The field of this name.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|f| f.name == name)
    }

    /// The message's variable tail, if its last field is a counted array.
    #[must_use]
    pub const fn tail(&self) -> Option<Tail> {
        if self.fields.is_empty() {
            return None;
        }
        let last = &self.fields[self.fields.len() - 1];
        let (Meaning::CountedBy(counter) | Meaning::Text(counter)) = last.meaning else {
            return None;
        };
        let (capacity, row) = match last.shape {
            Shape::Scalar => (1, 1),
            Shape::Vector(n) => (n, 1),
            Shape::Matrix(rows, columns) => (rows, columns),
        };
        let mut i = 0;
        while i < self.fields.len() {
            if same_text(self.fields[i].name, counter) {
                return Some(Tail {
                    counter_offset: self.fields[i].offset,
                    counter_size: self.fields[i].kind.size(),
                    offset: last.offset,
                    row_size: row * last.kind.size(),
                    capacity,
                });
            }
            i += 1;
        }
        panic!("a counted field names a counter that does not exist");
    }

    /// Fails the build unless the fields fill the message without gaps.
    const fn assert_gapless(&self) {
        let mut end = 0;
        let mut i = 0;
        while i < self.fields.len() {
            assert!(
                self.fields[i].offset == end,
                "fields out of order, missing, or padded"
            );
            end += self.fields[i].size();
            i += 1;
        }
        assert!(end == self.size, "fields missing at the end, or padding");
    }
}

/// A counted array at the end of a message.
#[derive(Clone, Copy, Debug)]
pub struct Tail {
    counter_offset: usize,
    counter_size: usize,
    offset: usize,
    row_size: usize,
    capacity: usize,
}

impl Tail {
    /// Where the array begins, bytes. The counter stands before it.
    #[must_use]
    pub const fn offset(&self) -> usize {
        self.offset
    }

    /// Bytes of the message in use. A count above the capacity uses all of it.
    #[must_use]
    pub fn used(&self, bytes: &[u8]) -> usize {
        let mut wide = [0; 8];
        wide[..self.counter_size]
            .copy_from_slice(&bytes[self.counter_offset..self.counter_offset + self.counter_size]);
        let count = usize::try_from(u64::from_le_bytes(wide))
            .unwrap_or(usize::MAX)
            .min(self.capacity);
        self.offset + count * self.row_size
    }
}

const fn hash_text(mut hash: u64, text: &str) -> u64 {
    let bytes = text.as_bytes();
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    // A separator, so that "ab","c" and "a","bc" differ.
    (hash ^ 0xff).wrapping_mul(0x0000_0100_0000_01b3)
}

const fn hash_number(mut hash: u64, number: usize) -> u64 {
    let bytes = (number as u64).to_le_bytes();
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    hash
}

const fn same_text(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use fitmac_core::message::{ActionChunk, ObjectSample, StateSample};

    #[test]
    fn the_table_agrees_with_the_type() {
        let layout = StateSample::LAYOUT;
        assert_eq!(layout.size, size_of::<StateSample>());
        let objects = layout.field("objects").expect("a field");
        assert_eq!(objects.offset, 240);
        assert!(matches!(objects.kind, Kind::Struct(l) if l.name == "ObjectSample"));
        let actions = ActionChunk::LAYOUT.field("actions").expect("a field");
        assert_eq!(actions.shape, Shape::Matrix(64, 7));
    }

    #[test]
    fn the_hash_sees_names_types_and_order() {
        const A: Field = Field {
            name: "a",
            offset: 0,
            kind: Kind::U32,
            shape: Shape::Scalar,
            meaning: Meaning::Number,
        };
        const fn of(fields: &'static [Field]) -> u64 {
            Layout {
                name: "T",
                size: 4,
                fields,
            }
            .schema_hash()
        }
        let hashes = [
            of(&[A]),
            of(&[Field { name: "b", ..A }]),
            of(&[Field {
                kind: Kind::F32,
                ..A
            }]),
            of(&[Field { offset: 4, ..A }]),
            of(&[Field {
                shape: Shape::Vector(2),
                ..A
            }]),
        ];
        for (i, a) in hashes.iter().enumerate() {
            assert!(hashes[i + 1..].iter().all(|b| a != b), "{hashes:x?}");
        }
    }

    #[test]
    fn only_the_used_part_of_a_message_counts_and_it_comes_back() {
        let mut state = StateSample {
            object_count: 2,
            ..StateSample::default()
        };
        state.objects[1].confidence = -0.0;
        state.joint_position_rad[3] = f64::from_bits(0x7ff8_0000_dead_beef);
        let bytes = state.used_bytes();
        assert_eq!(bytes.len(), 240 + 2 * size_of::<ObjectSample>());
        assert_eq!(StateSample::from_bytes(bytes).as_bytes(), state.as_bytes());
        state.object_count = u32::MAX;
        assert_eq!(state.used_bytes().len(), size_of::<StateSample>());
    }
}
