//! The part of a message that is in use.

use super::{Layout, Meaning, Shape};

impl Layout {
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
