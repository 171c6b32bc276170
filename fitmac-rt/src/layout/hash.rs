//! The hash of a layout.

use super::{Kind, Layout};

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
