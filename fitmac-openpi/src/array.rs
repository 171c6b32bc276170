//! Numpy arrays within msgpack, as openpi's `msgpack_numpy` writes them: a map with the *binary*
//! keys `__ndarray__` (true), `data` (binary, C order), `dtype` (text, as numpy's `dtype.str`) and
//! `shape` (a list of lengths).

use rmpv::{Value, ValueRef};

use crate::refusal::Refusal;

const MARK: &[u8] = b"__ndarray__";
const DATA: &[u8] = b"data";
const DTYPE: &[u8] = b"dtype";
const SHAPE: &[u8] = b"shape";

/// Floating-point formats of numpy that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Float {
    /// 32 bits, little-endian: `<f4`.
    F32,
    /// 64 bits, little-endian: `<f8`.
    F64,
}

impl Float {
    fn of(dtype: &str) -> Option<Self> {
        match dtype {
            "<f4" => Some(Self::F32),
            "<f8" => Some(Self::F64),
            _ => None,
        }
    }

    const fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A matrix of floats out of an answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix<const COLUMNS: usize> {
    /// The rows, from the first.
    pub rows: Vec<[f64; COLUMNS]>,
}

impl<const COLUMNS: usize> Matrix<COLUMNS> {
    /// Reads an array of shape (n, `COLUMNS`). `field` is the name that a refusal gives.
    ///
    /// # Errors
    /// [`Refusal::Malformed`], [`Refusal::Format`], [`Refusal::Shape`].
    pub fn read(field: &'static str, value: &Value) -> Result<Self, Refusal> {
        let malformed = |problem: &str| Refusal::malformed(field, problem);
        let map = value.as_map().ok_or_else(|| malformed("is no array"))?;
        let part = |key: &[u8]| map.iter().find(|(k, _)| is_bytes(k, key)).map(|(_, v)| v);
        if part(MARK) != Some(&Value::Boolean(true)) {
            return Err(malformed("is no array"));
        }
        let dtype = part(DTYPE).and_then(Value::as_str);
        let dtype = dtype.ok_or_else(|| malformed("has no dtype"))?;
        let float = Float::of(dtype).ok_or_else(|| Refusal::Format {
            field,
            dtype: dtype.chars().take(16).collect(),
        })?;
        let shape = part(SHAPE).and_then(Value::as_array);
        let shape = shape.ok_or_else(|| malformed("has no shape"))?;
        let lengths: Option<Vec<u64>> = shape.iter().map(Value::as_u64).collect();
        let lengths = lengths.ok_or_else(|| malformed("has a shape that is no list of lengths"))?;
        let rows = match lengths.as_slice() {
            [rows, columns] if *columns == COLUMNS as u64 => *rows,
            _ => {
                return Err(Refusal::Shape {
                    field,
                    shape: lengths,
                    columns: COLUMNS,
                });
            }
        };
        let data = match part(DATA) {
            Some(Value::Binary(data)) => data,
            _ => return Err(malformed("has no data")),
        };
        let row_bytes = COLUMNS * float.bytes();
        let wanted = usize::try_from(rows).ok();
        if wanted.and_then(|rows| rows.checked_mul(row_bytes)) != Some(data.len()) {
            let problem = format!("has {} bytes for {rows} rows of {row_bytes}", data.len());
            return Err(malformed(&problem));
        }
        let rows = data
            .chunks_exact(row_bytes)
            .map(|row| read_row(row, float))
            .collect();
        Ok(Self { rows })
    }
}

fn read_row<const COLUMNS: usize>(row: &[u8], float: Float) -> [f64; COLUMNS] {
    let mut numbers = row.chunks_exact(float.bytes()).map(|bytes| match float {
        Float::F32 => bytes
            .try_into()
            .map_or(f64::NAN, |b| f64::from(f32::from_le_bytes(b))),
        Float::F64 => bytes.try_into().map_or(f64::NAN, f64::from_le_bytes),
    });
    std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN))
}

fn is_bytes(value: &Value, bytes: &[u8]) -> bool {
    matches!(value, Value::Binary(found) if found == bytes)
}

/// An array to send: its bytes in C order.
#[must_use]
pub fn packed<'a>(dtype: &'a str, shape: &[usize], data: &'a [u8]) -> ValueRef<'a> {
    let shape = shape.iter().map(|length| ValueRef::from(*length as u64));
    ValueRef::Map(vec![
        (ValueRef::Binary(MARK), ValueRef::Boolean(true)),
        (ValueRef::Binary(DATA), ValueRef::Binary(data)),
        (ValueRef::Binary(DTYPE), ValueRef::from(dtype)),
        (ValueRef::Binary(SHAPE), ValueRef::Array(shape.collect())),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(dtype: &str, shape: &[usize], data: &[u8]) -> Result<Matrix<2>, Refusal> {
        Matrix::read("actions", &packed(dtype, shape, data).to_owned())
    }

    #[test]
    fn both_formats_are_read() {
        let wide: Vec<u8> = [1.5_f64, -2.0]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        assert_eq!(read("<f8", &[1, 2], &wide).unwrap().rows, [[1.5, -2.0]]);
        let narrow: Vec<u8> = [1.5_f32, -2.0, 0.0, 4.0]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let rows = read("<f4", &[2, 2], &narrow).unwrap().rows;
        assert_eq!(rows, [[1.5, -2.0], [0.0, 4.0]]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (dtype, shape, bytes, name) in [
            ("|u1", vec![1, 2], 2, "format"),
            ("<f8", vec![2], 16, "shape"),
            ("<f8", vec![1, 3], 24, "shape"),
            ("<f8", vec![1, 1, 2], 16, "shape"),
            ("<f8", vec![2, 2], 16, "malformed"),
            ("<f8", vec![usize::MAX, 2], 16, "malformed"),
        ] {
            let refusal = read(dtype, &shape, &vec![0; bytes]).unwrap_err();
            assert_eq!(refusal.name(), name, "{dtype} {shape:?}: {refusal}");
            assert!(refusal.to_string().contains("actions"), "{refusal}");
        }
        for value in [Value::Nil, Value::Map(vec![]), Value::from("actions")] {
            let refusal = Matrix::<2>::read("actions", &value).unwrap_err();
            assert_eq!(refusal.name(), "malformed");
        }
    }
}
