//! The first place where two messages differ, by name.

use crate::layout::{Kind, Layout, Payload, Shape};

/// A field in which two messages differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The field, like `objects[2].position_m[1]`.
    pub field: String,
    /// Its value in the first message.
    pub left: String,
    /// Its value in the second.
    pub right: String,
}

impl core::fmt::Display for Difference {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: {} and {}", self.field, self.left, self.right)
    }
}

/// The first field whose bits differ, in the order of the layout.
#[must_use]
pub fn first_difference<T: Payload>(left: &T, right: &T) -> Option<Difference> {
    let mut name = String::new();
    in_layout(&T::LAYOUT, left.as_bytes(), right.as_bytes(), &mut name)
}

fn in_layout(
    layout: &Layout,
    left: &[u8],
    right: &[u8],
    prefix: &mut String,
) -> Option<Difference> {
    let field = layout.fields.iter().find(|f| {
        let range = f.offset..f.offset + f.size();
        left[range.clone()] != right[range]
    })?;
    let size = field.kind.size();
    let element = |bytes: &[u8], i: usize| -> Vec<u8> {
        let at = field.offset + i * size;
        bytes[at..at + size].to_vec()
    };
    let index = (0..field.shape.count()).find(|&i| element(left, i) != element(right, i))?;
    if !prefix.is_empty() {
        prefix.push('.');
    }
    prefix.push_str(field.name);
    match field.shape {
        Shape::Scalar => {}
        Shape::Vector(_) => *prefix += &format!("[{index}]"),
        Shape::Matrix(_, columns) => {
            *prefix += &format!("[{}][{}]", index / columns, index % columns);
        }
    }
    let (l, r) = (element(left, index), element(right, index));
    if let Kind::Struct(inner) = field.kind {
        return in_layout(inner, &l, &r, prefix);
    }
    Some(Difference {
        field: prefix.clone(),
        left: number(field.kind, &l),
        right: number(field.kind, &r),
    })
}

/// A number as text that reads back to the same bits, except for the bits of a NaN.
#[must_use]
pub(crate) fn number(kind: Kind, bytes: &[u8]) -> String {
    let mut wide = [0; 8];
    let n = bytes.len().min(8);
    wide[..n].copy_from_slice(&bytes[..n]);
    let integer = u64::from_le_bytes(wide);
    match kind {
        Kind::F32 => f32::from_bits(integer as u32).to_string(),
        Kind::F64 => f64::from_bits(integer).to_string(),
        Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => integer.to_string(),
        Kind::Struct(layout) => layout.name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitmac_core::message::{ActionChunk, StateSample};

    #[test]
    fn the_first_differing_field_is_named_down_to_its_index() {
        let a = StateSample::default();
        assert_eq!(first_difference(&a, &a), None);
        let mut b = a;
        b.objects[2].position_m[1] = 0.5;
        b.objects[9].id = 4;
        let d = first_difference(&a, &b).expect("they differ");
        assert_eq!(d.to_string(), "objects[2].position_m[1]: 0 and 0.5");

        let (a, mut b) = (ActionChunk::default(), ActionChunk::default());
        b.actions[3][6] = -1.0;
        let d = first_difference(&a, &b).expect("they differ");
        assert_eq!(d.field, "actions[3][6]");
    }

    #[test]
    fn bits_count_and_not_values() {
        let a = StateSample::default();
        let mut b = a;
        b.gripper_width_m = -0.0;
        let d = first_difference(&a, &b).expect("minus zero is another number");
        assert_eq!((d.left.as_str(), d.right.as_str()), ("0", "-0"));
    }
}
