//! What the server says about itself when a client connects.

use std::io::Cursor;

use rmpv::{Value, decode::read_value_with_max_depth};

use crate::refusal::Refusal;

/// Deepest nesting of what a server sends.
const DEPTH_MAX: usize = 16;

/// The server's metadata: what its configuration calls `policy_metadata`. openpi's own LIBERO
/// policies send an empty map.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    entries: Vec<(String, Value)>,
}

/// A statement about the metadata that the user relies on, such as `model=pi05_libero`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expectation {
    /// The key.
    pub key: String,
    /// What stands there: a text, or a number or truth value as JSON writes it.
    pub value: String,
}

/// The server is not the one that was expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// The key is not there.
    #[error("the server's metadata has no `{key}` (expected {expected:?}); it has: {present}")]
    Missing {
        /// The key.
        key: String,
        /// What was expected.
        expected: String,
        /// The keys that it has.
        present: String,
    },
    /// Something else stands there.
    #[error("the server's metadata says `{key}` is {found:?}, expected {expected:?}")]
    Different {
        /// The key.
        key: String,
        /// What was expected.
        expected: String,
        /// What stands there.
        found: String,
    },
}

impl Metadata {
    pub(crate) fn read(frame: &[u8]) -> Result<Self, Refusal> {
        let entries = match decode("metadata", frame)? {
            Value::Map(entries) => entries,
            _ => return Err(Refusal::malformed("metadata", "is no map")),
        };
        let entry = |(key, value): (Value, Value)| Some((key.as_str()?.to_owned(), value));
        let entries: Option<Vec<_>> = entries.into_iter().map(entry).collect();
        let entries =
            entries.ok_or_else(|| Refusal::malformed("metadata", "has a key that is no text"))?;
        Ok(Self { entries })
    }

    /// What stands at a key: texts as they are, everything else as JSON writes it.
    #[must_use]
    pub fn text(&self, key: &str) -> Option<String> {
        let (_, value) = self.entries.iter().find(|(name, _)| name == key)?;
        Some(
            value
                .as_str()
                .map_or_else(|| value.to_string(), str::to_owned),
        )
    }

    /// The keys.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|(key, _)| key.as_str())
    }

    /// Checks what the user relies on.
    ///
    /// # Errors
    /// The first expectation that does not hold.
    pub fn check(&self, expectations: &[Expectation]) -> Result<(), Mismatch> {
        for Expectation { key, value } in expectations {
            match self.text(key) {
                Some(found) if found == *value => {}
                Some(found) => {
                    return Err(Mismatch::Different {
                        key: key.clone(),
                        expected: value.clone(),
                        found,
                    });
                }
                None => {
                    let present: Vec<_> = self.keys().take(32).collect();
                    return Err(Mismatch::Missing {
                        key: key.clone(),
                        expected: value.clone(),
                        present: match present.as_slice() {
                            [] => "nothing".to_owned(),
                            keys => keys.join(", "),
                        },
                    });
                }
            }
        }
        Ok(())
    }
}

/// Reads a frame: one value and nothing after it.
pub(crate) fn decode(field: &'static str, frame: &[u8]) -> Result<Value, Refusal> {
    let mut rest = Cursor::new(frame);
    let value = read_value_with_max_depth(&mut rest, DEPTH_MAX)
        .map_err(|error| Refusal::malformed(field, &format!("is no msgpack: {error}")))?;
    match usize::try_from(rest.position()) == Ok(frame.len()) {
        true => Ok(value),
        false => Err(Refusal::malformed(field, "goes on after its end")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(value: &Value) -> Vec<u8> {
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, value).unwrap();
        bytes
    }

    fn metadata() -> Metadata {
        let entries = [("model", Value::from("pi05")), ("steps", Value::from(10))];
        let entries = entries.map(|(key, value)| (Value::from(key), value));
        Metadata::read(&frame(&Value::Map(entries.into()))).unwrap()
    }

    fn expect(key: &str, value: &str) -> Expectation {
        Expectation {
            key: key.to_owned(),
            value: value.to_owned(),
        }
    }

    #[test]
    fn expectations_are_checked() {
        let metadata = metadata();
        assert_eq!(
            metadata.check(&[expect("model", "pi05"), expect("steps", "10")]),
            Ok(())
        );
        let said = metadata
            .check(&[expect("model", "pi0")])
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("\"pi05\"") && said.contains("\"pi0\""),
            "{said}"
        );
        let said = metadata
            .check(&[expect("robot", "panda")])
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("`robot`") && said.contains("model, steps"),
            "{said}"
        );
    }

    #[test]
    fn what_is_no_metadata_is_refused() {
        let mut long = frame(&Value::Map(vec![]));
        long.push(0xc0);
        let deep = [vec![0x91; 40], vec![0xc0]].concat();
        let no_text = frame(&Value::Map(vec![(Value::from(1), Value::Nil)]));
        for bytes in [
            &[][..],
            &[0xc1],
            &[0xc0],
            &[0xdf, 0xff, 0xff, 0xff, 0xff],
            &long,
            &deep,
            &no_text,
        ] {
            let refusal = Metadata::read(bytes).unwrap_err();
            assert_eq!(refusal.name(), "malformed", "{bytes:?}");
        }
    }
}
