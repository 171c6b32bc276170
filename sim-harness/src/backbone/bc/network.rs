//! A network of dense layers with rectifiers between them, and its file.
//!
//! The file: eight bytes `FITMACBC`, then little-endian `u32` version, number of layers and, for
//! each, inputs and outputs; then `f32` lower and upper bounds of the inputs, and for each layer
//! its weights, output by output, and its biases.

use crate::error::SimError;

/// The file's first bytes.
const MAGIC: &[u8; 8] = b"FITMACBC";
/// The file's version.
const VERSION: u32 = 1;
/// More than any network of ours has; a broken file must not ask for gigabytes.
const MOST_NEURONS: usize = 4096;

/// A dense layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Number of inputs.
    pub inputs: usize,
    /// Weights, output by output: `inputs` numbers each.
    pub weights: Vec<f32>,
    /// A bias an output.
    pub biases: Vec<f32>,
}

/// A network.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Lower bounds of the inputs, as they occurred in training.
    pub low: Vec<f32>,
    /// Upper bounds of the inputs.
    pub high: Vec<f32>,
    /// Layers; rectifiers stand between them.
    pub layers: Vec<Layer>,
}

impl Layer {
    fn answer(&self, input: &[f32]) -> Vec<f32> {
        // One sum after the other, so that the bits are the same on every machine.
        self.weights
            .chunks_exact(self.inputs)
            .zip(&self.biases)
            .map(|(row, bias)| row.iter().zip(input).fold(*bias, |sum, (w, x)| sum + w * x))
            .collect()
    }
}

impl Network {
    /// The input as the layers see it: scaled to [-1, 1] over what occurred in training, and
    /// nothing beyond (OpenVLA clips its inputs in the same way). What was constant is 0.
    #[must_use]
    pub fn scaled(&self, input: &[f32]) -> Vec<f32> {
        let bounds = self.low.iter().zip(&self.high);
        input
            .iter()
            .zip(bounds)
            .map(|(x, (low, high))| {
                let span = high - low;
                if span > 1e-6 {
                    (2.0 * (x - low) / span - 1.0).clamp(-1.0, 1.0)
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// How many numbers it takes.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.low.len()
    }

    /// How many numbers it gives.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.biases.len())
    }

    /// The network's answer.
    #[must_use]
    pub fn answer(&self, input: &[f32]) -> Vec<f32> {
        let mut values = self.scaled(input);
        for (i, layer) in self.layers.iter().enumerate() {
            if i > 0 {
                values.iter_mut().for_each(|v| *v = v.max(0.0));
            }
            values = layer.answer(&values);
        }
        values
    }

    /// The network as a file.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes();
        out.extend(VERSION.to_le_bytes());
        out.extend(count(self.layers.len()));
        for layer in &self.layers {
            out.extend(count(layer.inputs));
            out.extend(count(layer.biases.len()));
        }
        let tensors = self.layers.iter().flat_map(|l| [&l.weights, &l.biases]);
        for tensor in [&self.low, &self.high].into_iter().chain(tensors) {
            out.extend(tensor.iter().flat_map(|v| v.to_le_bytes()));
        }
        out
    }

    /// Reads a network. `file` is the name that errors give.
    ///
    /// # Errors
    /// [`SimError::Data`] if the bytes are no network, are cut off or go on, or hold a number that
    /// is not finite.
    pub fn from_bytes(file: &str, bytes: &[u8]) -> Result<Self, SimError> {
        let wrong = |message: &str| SimError::Data {
            file: file.to_owned(),
            message: format!("{message}; make it anew with `cargo xtask train-bc`"),
        };
        let mut rest = bytes
            .strip_prefix(MAGIC)
            .ok_or_else(|| wrong("these are no weights"))?;
        let mut number = || -> Option<u32> {
            let (first, after) = rest.split_first_chunk::<4>()?;
            rest = after;
            Some(u32::from_le_bytes(*first))
        };
        let cut = || wrong("the file is cut off");
        let version = number().ok_or_else(cut)?;
        if version != VERSION {
            return Err(wrong(&format!(
                "version {version}; this program reads {VERSION}"
            )));
        }
        let layers = number().ok_or_else(cut)? as usize;
        let mut shapes = Vec::new();
        for _ in 0..layers.min(MOST_NEURONS) {
            let shape = [
                number().ok_or_else(cut)? as usize,
                number().ok_or_else(cut)? as usize,
            ];
            if shape.iter().any(|n| *n == 0 || *n > MOST_NEURONS) {
                return Err(wrong("a layer has no neurons, or too many"));
            }
            shapes.push(shape);
        }
        if shapes.is_empty() || shapes.windows(2).any(|w| w[0][1] != w[1][0]) {
            return Err(wrong("the layers do not fit together"));
        }
        let mut tensor = |length: usize| -> Result<Vec<f32>, SimError> {
            let values: Option<Vec<f32>> =
                (0..length).map(|_| number().map(f32::from_bits)).collect();
            let values = values.ok_or_else(cut)?;
            if values.iter().any(|v| !v.is_finite()) {
                return Err(wrong("a number is not finite"));
            }
            Ok(values)
        };
        let inputs = shapes[0][0];
        let (low, high) = (tensor(inputs)?, tensor(inputs)?);
        let layers = shapes
            .iter()
            .map(|&[inputs, outputs]| {
                Ok(Layer {
                    inputs,
                    weights: tensor(inputs * outputs)?,
                    biases: tensor(outputs)?,
                })
            })
            .collect::<Result<Vec<_>, SimError>>()?;
        if !rest.is_empty() {
            return Err(wrong("the file goes on after the last layer"));
        }
        Ok(Self { low, high, layers })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network() -> Network {
        Network {
            low: vec![0.0, -1.0, 5.0],
            high: vec![2.0, 1.0, 5.0],
            layers: vec![
                Layer {
                    inputs: 3,
                    weights: vec![1.0, 0.0, 7.0, 0.0, -1.0, 7.0],
                    biases: vec![0.5, 0.0],
                },
                Layer {
                    inputs: 2,
                    weights: vec![2.0, 10.0],
                    biases: vec![-1.0],
                },
            ],
        }
    }

    #[test]
    fn an_answer_is_what_the_hand_computes() {
        // Scaled: 0.5, 0.5, 0 (constant). Layer 1: 1.0, -0.5; rectified 1, 0. Layer 2: 2 - 1.
        assert_eq!(network().answer(&[1.5, 0.5, 9.0]), [1.0]);
        // Beyond the range of training nothing changes any more.
        assert_eq!(
            network().answer(&[2.0, 0.5, 5.0]),
            network().answer(&[90.0, 0.5, 5.0])
        );
    }

    #[test]
    fn a_file_reads_back_and_mistakes_are_named() {
        let bytes = network().to_bytes();
        assert_eq!(Network::from_bytes("x.bin", &bytes).unwrap(), network());
        let error = |bytes: &[u8]| Network::from_bytes("x.bin", bytes).unwrap_err().to_string();
        assert!(error(b"nonsense").contains("no weights"));
        assert!(error(&bytes[..bytes.len() - 1]).contains("cut off"));
        assert!(error(&[&bytes[..], &[0]].concat()).contains("goes on"));
        let mut bad = bytes.clone();
        let last = bad.len() - 4;
        bad[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(error(&bad).contains("not finite") && error(&bad).starts_with("x.bin"));
        let mut bad = bytes;
        bad[8] = 9;
        assert!(error(&bad).contains("version 9"));
    }
}
