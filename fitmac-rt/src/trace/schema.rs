//! Protobuf descriptors, made from the layouts.

use prost::Message as _;
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};

use super::codec::{NAMES_OFFSET, number_of};
use crate::layout::{Field, Kind, Layout, Meaning, Payload, Shape, Vocabulary};

/// The package of all our messages.
pub const PACKAGE: &str = "fitmac";

/// The full name of a message.
#[must_use]
pub fn full_name<T: Payload>() -> String {
    format!("{PACKAGE}.{}", T::LAYOUT.name)
}

/// An encoded `FileDescriptorSet` with the message and all that it contains.
#[must_use]
pub fn descriptor_set<T: Payload>() -> Vec<u8> {
    let mut file = FileDescriptorProto {
        name: Some(format!("{PACKAGE}/{}.proto", T::LAYOUT.name)),
        package: Some(PACKAGE.into()),
        syntax: Some("proto3".into()),
        ..FileDescriptorProto::default()
    };
    add_message(&T::LAYOUT, &mut file);
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

fn add_message(layout: &Layout, file: &mut FileDescriptorProto) {
    if file.message_type.iter().any(|m| m.name() == layout.name) {
        return;
    }
    let mut message = DescriptorProto {
        name: Some(layout.name.into()),
        ..DescriptorProto::default()
    };
    for (index, field) in layout.fields.iter().enumerate() {
        let number = number_of(index);
        message.field.push(field_descriptor(number, field));
        match field.meaning {
            Meaning::Bits(_) => message.field.push(FieldDescriptorProto {
                name: Some(format!("{}_names", field.name)),
                number: Some((number + NAMES_OFFSET) as i32),
                label: Some(Label::Repeated.into()),
                r#type: Some(Type::String.into()),
                ..FieldDescriptorProto::default()
            }),
            Meaning::Code(vocabulary) => add_enum(vocabulary, file),
            Meaning::Number | Meaning::Text(_) | Meaning::CountedBy(_) => {}
        }
        if let Kind::Struct(inner) = field.kind {
            add_message(inner, file);
        }
    }
    file.message_type.push(message);
}

fn field_descriptor(number: u32, field: &Field) -> FieldDescriptorProto {
    let is_bytes = matches!((field.kind, field.shape), (Kind::U8, Shape::Vector(_)));
    let r#type = match (field.kind, field.meaning) {
        (_, Meaning::Text(_)) => Type::String,
        (_, Meaning::Code(_)) => Type::Enum,
        _ if is_bytes => Type::Bytes,
        (Kind::U8 | Kind::U16 | Kind::U32, _) => Type::Uint32,
        (Kind::U64, _) => Type::Uint64,
        (Kind::F32, _) => Type::Float,
        (Kind::F64, _) => Type::Double,
        (Kind::Struct(_), _) => Type::Message,
    };
    let repeated = field.shape != Shape::Scalar && !is_bytes;
    let type_name = match (field.kind, field.meaning) {
        (_, Meaning::Code(v)) => Some(format!(".{PACKAGE}.{}", v.name)),
        (Kind::Struct(inner), _) => Some(format!(".{PACKAGE}.{}", inner.name)),
        _ => None,
    };
    FieldDescriptorProto {
        name: Some(field.name.into()),
        number: Some(number as i32),
        label: Some(
            if repeated {
                Label::Repeated
            } else {
                Label::Optional
            }
            .into(),
        ),
        r#type: Some(r#type.into()),
        type_name,
        ..FieldDescriptorProto::default()
    }
}

fn add_enum(vocabulary: Vocabulary, file: &mut FileDescriptorProto) {
    if file.enum_type.iter().any(|e| e.name() == vocabulary.name) {
        return;
    }
    // Values share one scope in a file, so each bears its enumeration's name.
    let prefix = screaming(vocabulary.name);
    let mut members = (vocabulary.members)();
    if members.iter().all(|(code, _)| *code != 0) {
        members.insert(0, (0, "unspecified"));
    }
    members.sort_by_key(|(code, _)| *code);
    file.enum_type.push(EnumDescriptorProto {
        name: Some(vocabulary.name.into()),
        value: members
            .into_iter()
            .map(|(code, name)| EnumValueDescriptorProto {
                name: Some(format!("{prefix}_{}", name.to_ascii_uppercase())),
                number: Some(i32::from(code)),
                ..EnumValueDescriptorProto::default()
            })
            .collect(),
        ..EnumDescriptorProto::default()
    });
}

/// `SubPhase` to `SUB_PHASE`.
fn screaming(name: &str) -> String {
    let mut out = String::new();
    for (i, c) in name.chars().enumerate() {
        if i > 0 && c.is_ascii_uppercase() {
            out.push('_');
        }
        out.push(c.to_ascii_uppercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitmac_core::message::{Command, StateSample};

    fn file<T: Payload>() -> FileDescriptorProto {
        FileDescriptorSet::decode(&descriptor_set::<T>()[..])
            .expect("a descriptor set")
            .file
            .remove(0)
    }

    #[test]
    fn nested_messages_and_vocabularies_are_there_once() {
        let state = file::<StateSample>();
        let names: Vec<&str> = state.message_type.iter().map(|m| m.name()).collect();
        assert_eq!(names, ["ObjectSample", "StateSample"]);
        let command = file::<Command>();
        let mode = command
            .enum_type
            .iter()
            .find(|e| e.name() == "Mode")
            .expect("the mode is named");
        let values: Vec<(&str, i32)> = mode.value.iter().map(|v| (v.name(), v.number())).collect();
        assert_eq!(
            values,
            [
                ("MODE_NORMAL", 0),
                ("MODE_WARN", 1),
                ("MODE_HOLD", 2),
                ("MODE_STOP", 3)
            ]
        );
        assert!(
            command.enum_type.iter().any(|e| e.name() == "SubPhase"
                && e.value.iter().any(|v| v.name() == "SUB_PHASE_LIFT_TEST"))
        );
    }

    #[test]
    fn every_enumeration_begins_with_zero_as_proto3_demands() {
        for e in file::<StateSample>()
            .enum_type
            .iter()
            .chain(&file::<fitmac_core::message::ActionChunk>().enum_type)
        {
            assert_eq!(e.value[0].number(), 0, "{}", e.name());
        }
    }
}
