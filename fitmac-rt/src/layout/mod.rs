//! What a message looks like in memory, as data.
//!
//! One table a message, checked by the compiler, serves everything that must
//! know the layout: the schema hash in the service's type name, the protobuf
//! descriptors and codec of the trace, the CSV columns, and the name of the
//! first field in which two records differ.

mod hash;
mod payload;
mod tail;
#[cfg(test)]
mod tests;

pub(crate) use payload::layout;
pub use payload::{Payload, Plain};
#[doc(hidden)]
pub use payload::{checked, describe};
pub use tail::Tail;

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
    /// The field of this name.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&'static Field> {
        self.fields.iter().find(|f| f.name == name)
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
