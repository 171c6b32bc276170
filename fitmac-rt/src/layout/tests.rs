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
