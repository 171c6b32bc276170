//! Questions and answers as msgpack, by hand: only what openpi's server reads
//! and writes.

use rmpv::Value;

/// A question as the server understood it.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// `observation/image`: 224 x 224 x 3 bytes.
    pub image: Vec<u8>,
    /// `observation/wrist_image`: the same.
    pub wrist_image: Vec<u8>,
    /// `observation/state`.
    pub state: [f64; 8],
    /// `prompt`.
    pub prompt: String,
}

impl Question {
    /// Reads a frame as strictly as `LiberoInputs` and numpy would.
    pub(super) fn read(frame: &[u8]) -> Result<Self, String> {
        let mut rest = frame;
        let value =
            rmpv::decode::read_value(&mut rest).map_err(|e| format!("UnpackException: {e}"))?;
        let map = value.as_map().ok_or("TypeError: no dict")?;
        let entry = |key: &str| {
            let found = map.iter().find(|(k, _)| k.as_str() == Some(key));
            found.map(|(_, v)| v).ok_or(format!("KeyError: '{key}'"))
        };
        if map.len() != 4 || !rest.is_empty() {
            return Err(format!(
                "ValueError: {} keys, {} bytes after",
                map.len(),
                rest.len()
            ));
        }
        let picture = |key: &str| -> Result<Vec<u8>, String> {
            array(entry(key)?, "|u1", &[224, 224, 3]).ok_or(format!("ValueError: {key}"))
        };
        let state = array(entry("observation/state")?, "<f8", &[8]);
        let state = state.ok_or("ValueError: observation/state")?;
        let (numbers, _) = state.as_chunks::<8>();
        Ok(Self {
            image: picture("observation/image")?,
            wrist_image: picture("observation/wrist_image")?,
            state: std::array::from_fn(|i| f64::from_le_bytes(numbers[i])),
            prompt: entry("prompt")?
                .as_str()
                .ok_or("TypeError: prompt")?
                .to_owned(),
        })
    }
}

/// The bytes of an array, if it is written as openpi's `msgpack_numpy` writes it.
fn array(value: &Value, dtype: &str, shape: &[u64]) -> Option<Vec<u8>> {
    let map = value.as_map()?;
    let part = |key: &[u8]| {
        map.iter()
            .find(|(k, _)| k.as_slice() == Some(key))
            .map(|(_, v)| v)
    };
    let lengths: Option<Vec<u64>> = part(b"shape")?
        .as_array()?
        .iter()
        .map(Value::as_u64)
        .collect();
    let item: u64 = dtype[2..].parse().ok()?;
    let data = match part(b"data")? {
        Value::Binary(data) => data.clone(),
        _ => return None,
    };
    let sound = map.len() == 4
        && part(b"__ndarray__")?.as_bool() == Some(true)
        && part(b"dtype")?.as_str() == Some(dtype)
        && lengths? == shape
        && data.len() as u64 == item * shape.iter().product::<u64>();
    sound.then_some(data)
}

/// Metadata.
pub(super) fn metadata(entries: &[(&str, &str)]) -> Vec<u8> {
    let entries = entries
        .iter()
        .map(|(k, v)| (Value::from(*k), Value::from(*v)));
    bytes(&Value::Map(entries.collect()))
}

/// An answer as openpi gives it; the padding is one more entry.
pub(super) fn answer(dtype: &str, shape: &[usize], data: Vec<u8>, padding: usize) -> Vec<u8> {
    let bin = |key: &[u8]| Value::Binary(key.to_vec());
    let shape = shape.iter().map(|n| Value::from(*n as u64)).collect();
    let actions = vec![
        (bin(b"__ndarray__"), Value::from(true)),
        (bin(b"data"), Value::Binary(data)),
        (bin(b"dtype"), Value::from(dtype)),
        (bin(b"shape"), Value::Array(shape)),
    ];
    let timing = |ms: f64| Value::Map(vec![(Value::from("infer_ms"), Value::from(ms))]);
    let mut entries = vec![
        (Value::from("actions"), Value::Map(actions)),
        (Value::from("policy_timing"), timing(1.25)),
        (Value::from("server_timing"), timing(1.5)),
    ];
    if padding > 0 {
        entries.push((Value::from("padding"), Value::Binary(vec![0; padding])));
    }
    bytes(&Value::Map(entries))
}

fn bytes(value: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    rmpv::encode::write_value(&mut bytes, value).expect("a vector takes everything");
    bytes
}
