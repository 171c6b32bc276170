//! Messages to protobuf and back, by their layout. Every bit of every number
//! survives.

use prost::{
    DecodeError,
    encoding::{
        DecodeContext, WireType, decode_key, decode_varint, encode_key, encode_varint, skip_field,
    },
};

use crate::layout::{Field, Kind, Layout, Meaning, Payload, Shape};

/// Added to a field's number for the names of its bits, which are there for
/// people and ignored when the message is read back.
pub(super) const NAMES_OFFSET: u32 = 1000;

/// A field's number in the protobuf message.
pub(super) fn number_of(index: usize) -> u32 {
    index as u32 + 1
}

/// Appends the protobuf form of a message.
pub fn encode<T: Payload>(message: &T, out: &mut Vec<u8>) {
    encode_layout(&T::LAYOUT, message.as_bytes(), out);
}

/// Reads a message from its protobuf form. What is missing is zero.
///
/// # Errors
/// If the bytes are not protobuf, or an element is too large for its field.
pub fn decode<T: Payload>(bytes: &[u8]) -> Result<T, DecodeError> {
    let mut out = vec![0; size_of::<T>()];
    decode_layout(&T::LAYOUT, bytes, &mut out)?;
    Ok(T::from_bytes(&out))
}

fn encode_layout(layout: &Layout, bytes: &[u8], out: &mut Vec<u8>) {
    for (index, field) in layout.fields.iter().enumerate() {
        let number = number_of(index);
        let used = used_count(layout, field, bytes);
        let data = &bytes[field.offset..field.offset + used * field.kind.size()];
        encode_field(number, field, data, out);
        if let Meaning::Bits(names) = field.meaning {
            let bits = integer(field.kind, data);
            for (_, name) in names.iter().filter(|(bit, _)| bits & bit != 0) {
                prost::encoding::string::encode(number + NAMES_OFFSET, &(*name).to_owned(), out);
            }
        }
    }
}

/// Elements of a field that count.
fn used_count(layout: &Layout, field: &Field, bytes: &[u8]) -> usize {
    let (Meaning::CountedBy(counter) | Meaning::Text(counter)) = field.meaning else {
        return field.shape.count();
    };
    let (rows, row) = match field.shape {
        Shape::Scalar => (1, 1),
        Shape::Vector(n) => (n, 1),
        Shape::Matrix(rows, columns) => (rows, columns),
    };
    let count = layout.field(counter).map_or(rows, |f| {
        let value = integer(f.kind, &bytes[f.offset..f.offset + f.kind.size()]);
        usize::try_from(value).unwrap_or(usize::MAX).min(rows)
    });
    count * row
}

fn encode_field(number: u32, field: &Field, data: &[u8], out: &mut Vec<u8>) {
    match (field.kind, field.shape) {
        (Kind::Struct(inner), _) => {
            let mut nested = Vec::new();
            for element in data.chunks_exact(inner.size) {
                nested.clear();
                encode_layout(inner, element, &mut nested);
                delimited(number, &nested, out);
            }
        }
        (_, Shape::Scalar) => {
            encode_key(number, scalar_wire_type(field.kind), out);
            encode_element(field.kind, data, out);
        }
        (Kind::U8, _) => match field.meaning {
            // Text that is not UTF-8 would make the message unreadable.
            Meaning::Text(_) => delimited(number, String::from_utf8_lossy(data).as_bytes(), out),
            _ => delimited(number, data, out),
        },
        (kind, _) => {
            let mut packed = Vec::with_capacity(data.len());
            for element in data.chunks_exact(kind.size()) {
                encode_element(kind, element, &mut packed);
            }
            delimited(number, &packed, out);
        }
    }
}

fn delimited(number: u32, data: &[u8], out: &mut Vec<u8>) {
    encode_key(number, WireType::LengthDelimited, out);
    encode_varint(data.len() as u64, out);
    out.extend_from_slice(data);
}

fn scalar_wire_type(kind: Kind) -> WireType {
    match kind {
        Kind::F32 => WireType::ThirtyTwoBit,
        Kind::F64 => WireType::SixtyFourBit,
        Kind::Struct(_) => WireType::LengthDelimited,
        Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => WireType::Varint,
    }
}

fn encode_element(kind: Kind, element: &[u8], out: &mut Vec<u8>) {
    match kind {
        Kind::F32 | Kind::F64 => out.extend_from_slice(element),
        _ => encode_varint(integer(kind, element), out),
    }
}

/// An unsigned integer of any width, little-endian as all our machines are.
fn integer(kind: Kind, element: &[u8]) -> u64 {
    let mut wide = [0; 8];
    let n = kind.size().min(8).min(element.len());
    wide[..n].copy_from_slice(&element[..n]);
    u64::from_le_bytes(wide)
}

const _: () = assert!(
    cfg!(target_endian = "little"),
    "the trace is written for little-endian machines"
);

#[allow(deprecated)] // the library's way to make an error, marked as internal
fn malformed(what: &'static str) -> DecodeError {
    DecodeError::new(what)
}

fn decode_layout(layout: &Layout, mut bytes: &[u8], out: &mut [u8]) -> Result<(), DecodeError> {
    let mut filled = vec![0_usize; layout.fields.len()];
    while !bytes.is_empty() {
        let (number, wire_type) = decode_key(&mut bytes)?;
        let index = (number as usize).wrapping_sub(1);
        let Some(field) = layout.fields.get(index) else {
            skip_field(wire_type, number, &mut bytes, DecodeContext::default())?;
            continue;
        };
        let place = &mut out[field.offset..field.offset + field.size()];
        match wire_type {
            WireType::LengthDelimited => {
                let length = usize::try_from(decode_varint(&mut bytes)?).unwrap_or(usize::MAX);
                let data = take(&mut bytes, length)?;
                decode_delimited(field, data, &mut filled[index], place)?;
            }
            _ => decode_element(field.kind, wire_type, &mut bytes, place)?,
        }
    }
    Ok(())
}

fn take<'a>(bytes: &mut &'a [u8], length: usize) -> Result<&'a [u8], DecodeError> {
    if length > bytes.len() {
        return Err(malformed("a field is longer than its message"));
    }
    let (head, rest) = bytes.split_at(length);
    *bytes = rest;
    Ok(head)
}

fn decode_delimited(
    field: &Field,
    mut data: &[u8],
    filled: &mut usize,
    place: &mut [u8],
) -> Result<(), DecodeError> {
    let size = field.kind.size();
    let next = |filled: &mut usize| {
        let at = *filled * size;
        *filled += 1;
        (at + size <= place.len())
            .then_some(at..at + size)
            .ok_or(malformed("an array has too many elements"))
    };
    match field.kind {
        Kind::Struct(inner) => {
            let range = next(filled)?;
            decode_layout(inner, data, &mut place[range])
        }
        Kind::U8 => {
            let room = place
                .get_mut(..data.len())
                .ok_or(malformed("a byte field is too long"))?;
            room.copy_from_slice(data);
            Ok(())
        }
        kind => {
            while !data.is_empty() {
                let at = *filled * size;
                *filled += 1;
                let element = place
                    .get_mut(at..at + size)
                    .ok_or(malformed("an array has too many elements"))?;
                decode_element(kind, scalar_wire_type(kind), &mut data, element)?;
            }
            Ok(())
        }
    }
}

fn decode_element(
    kind: Kind,
    wire_type: WireType,
    bytes: &mut &[u8],
    place: &mut [u8],
) -> Result<(), DecodeError> {
    if wire_type != scalar_wire_type(kind) || place.len() < kind.size() {
        return Err(malformed("a field has another type than its message says"));
    }
    let size = kind.size();
    match kind {
        Kind::F32 | Kind::F64 => place[..size].copy_from_slice(take(bytes, size)?),
        _ => {
            let value = decode_varint(bytes)?.to_le_bytes();
            if value[size..].iter().any(|b| *b != 0) {
                return Err(malformed("a number is too large for its field"));
            }
            place[..size].copy_from_slice(&value[..size]);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::PromptText;
    use fitmac_core::message::{ActionChunk, Command, GroundingRecord, StateSample, TraceRecord};

    /// A message whose every used byte differs from zero and from its neighbours.
    fn patterned<T: Payload>(counter: Option<(usize, u8)>) -> T {
        let mut bytes: Vec<u8> = (0..size_of::<T>()).map(|i| (i % 251 + 1) as u8).collect();
        if let Some((at, count)) = counter {
            bytes[at..at + 4].copy_from_slice(&[count, 0, 0, 0]);
        }
        T::from_bytes(&bytes)
    }

    fn survives<T: Payload>(message: &T) {
        let mut out = Vec::new();
        encode(message, &mut out);
        let back: T = decode(&out).expect("decodes");
        let used = message.used_bytes();
        assert_eq!(&back.as_bytes()[..used.len()], used, "{}", T::LAYOUT.name);
        assert!(back.as_bytes()[used.len()..].iter().all(|b| *b == 0));
        // Any cut is an error or a shorter message, never a panic.
        for end in 0..out.len() {
            let _ = decode::<T>(&out[..end]);
        }
    }

    fn offset<T: Payload>(field: &str) -> usize {
        T::LAYOUT.field(field).expect("a field").offset
    }

    #[test]
    fn every_bit_of_every_message_survives() {
        survives(&patterned::<Command>(None));
        survives(&patterned::<TraceRecord>(None));
        let counter = offset::<StateSample>("object_count");
        for count in [0, 1, 7, 32, 255] {
            survives(&patterned::<StateSample>(Some((counter, count))));
        }
        let horizon = offset::<ActionChunk>("horizon");
        survives(&patterned::<ActionChunk>(Some((horizon, 8))));
        survives(&patterned::<GroundingRecord>(None));
        let nans = Command {
            action: [f64::from_bits(0xfff8_0000_0000_0001); 7],
            setpoint_position_m: [-0.0, f64::MIN_POSITIVE / 2.0, f64::NEG_INFINITY],
            ..patterned(None)
        };
        survives(&nans);
    }

    #[test]
    fn text_is_text_and_bits_have_names() {
        let prompt = PromptText::new(1, 2, 3, "open the drawer").expect("fits");
        let mut out = Vec::new();
        encode(&prompt, &mut out);
        let back: PromptText = decode(&out).expect("decodes");
        assert_eq!(back.text(), Ok("open the drawer"));

        let mut out = Vec::new();
        let command = Command {
            reasons: fitmac_core::reason::STATE_STALE,
            ..Command::zeroed()
        };
        encode(&command, &mut out);
        assert!(out.windows(11).any(|w| w == b"state_stale"));
    }

    #[test]
    fn what_does_not_fit_is_an_error() {
        let too_many = {
            let mut out = Vec::new();
            for _ in 0..33 {
                delimited(17, &[], &mut out);
            }
            out
        };
        assert_eq!(StateSample::LAYOUT.fields[13 - 1].name, "objects");
        let wide_number = {
            // grasp_class of the first object: a byte.
            let mut object = Vec::new();
            encode_key(2, WireType::Varint, &mut object);
            encode_varint(256, &mut object);
            let mut out = Vec::new();
            delimited(13, &object, &mut out);
            out
        };
        let too_many_objects = {
            let mut out = Vec::new();
            for _ in 0..33 {
                delimited(13, &[], &mut out);
            }
            out
        };
        decode::<StateSample>(&too_many).expect("an unknown field is skipped");
        assert!(decode::<StateSample>(&wide_number).is_err());
        assert!(decode::<StateSample>(&too_many_objects).is_err());
        assert!(decode::<StateSample>(&[0xff; 40]).is_err());
    }
}
