//! What the policy answered.

use fitmac_core::message::{ACTION_DIM, ActionChunk, CHUNK_CAPACITY};
use rmpv::Value;

use crate::{array::Matrix, convention::Conventions, metadata::decode, refusal::Refusal};

/// A checked answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The actions, one a policy step, as many as declared.
    pub actions: Vec<[f32; ACTION_DIM]>,
    /// How long the server says that it took, ms; absent where it doesn't say.
    pub server_ms: Option<f64>,
}

impl Answer {
    /// Reads a frame and checks it against what was declared.
    ///
    /// # Errors
    /// Why nothing of it is used.
    pub fn read(frame: &[u8], conventions: &Conventions) -> Result<Self, Refusal> {
        let answer = decode("answer", frame)?;
        if !answer.is_map() {
            return Err(Refusal::malformed("answer", "is no map"));
        }
        let actions = entry(&answer, "actions");
        let actions = actions.ok_or_else(|| Refusal::malformed("actions", "is missing"))?;
        let matrix = Matrix::<ACTION_DIM>::read("actions", actions)?;
        let server_ms = entry(&answer, "server_timing")
            .and_then(|timing| entry(timing, "infer_ms"))
            .and_then(Value::as_f64)
            .filter(|ms| ms.is_finite() && *ms >= 0.0);
        Ok(Self {
            actions: conventions.check(&matrix.rows)?,
            server_ms,
        })
    }

    /// The answer as a message to the controller, of an observation taken at `observation_ns`. Who
    /// sends it fills in the rest.
    #[must_use]
    pub fn chunk(&self, conventions: &Conventions, observation_ns: u64) -> ActionChunk {
        debug_assert!(self.actions.len() <= CHUNK_CAPACITY, "the check bounds it");
        let mut chunk = ActionChunk {
            observation_ns,
            horizon: u32::try_from(self.actions.len()).unwrap_or(u32::MAX),
            action_space: conventions.action_space.code(),
            frame: conventions.frame.code(),
            gripper: conventions.gripper.code(),
            ..ActionChunk::default()
        };
        for (slot, action) in chunk.actions.iter_mut().zip(&self.actions) {
            *slot = *action;
        }
        chunk
    }
}

fn entry<'a>(map: &'a Value, key: &str) -> Option<&'a Value> {
    let entries = map.as_map()?.iter();
    entries
        .into_iter()
        .find(|(name, _)| name.as_str() == Some(key))
        .map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::packed;

    fn frame(entries: Vec<(&str, Value)>) -> Vec<u8> {
        let entries = entries.into_iter().map(|(k, v)| (Value::from(k), v));
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, &Value::Map(entries.collect())).unwrap();
        bytes
    }

    fn actions(rows: usize) -> Value {
        let data: Vec<u8> = (0..rows * 7)
            .flat_map(|i| (0.01 * i as f64).to_le_bytes())
            .collect();
        packed("<f8", &[rows, 7], &data).to_owned()
    }

    #[test]
    fn an_answer_becomes_a_chunk() {
        let timing = Value::Map(vec![(Value::from("infer_ms"), Value::from(71.5))]);
        let frame = frame(vec![("actions", actions(5)), ("server_timing", timing)]);
        let conventions = Conventions::libero(5);
        let answer = Answer::read(&frame, &conventions).unwrap();
        assert_eq!(answer.server_ms, Some(71.5));
        let chunk = answer.chunk(&conventions, 42);
        assert_eq!((chunk.horizon, chunk.observation_ns), (5, 42));
        assert_eq!(chunk.actions[4][6], 0.34);
        assert_eq!(chunk.actions[5], [0.0; 7]);
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_an_answer_or_a_refusal() {
        let conventions = Conventions::libero(3);
        let sound = frame(vec![("actions", actions(3))]);
        for cut in 0..sound.len() {
            assert!(Answer::read(&sound[..cut], &conventions).is_err());
        }
        let mut accepted = 0;
        for bit in 0..8 * sound.len() {
            let mut bad = sound.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            if let Ok(answer) = Answer::read(&bad, &conventions) {
                assert_eq!(answer.actions.len(), 3);
                assert!(answer.actions.iter().flatten().all(|x| x.abs() <= 1.5));
                accepted += 1;
            }
        }
        // Flips within the numbers change a value and can stay sound.
        assert!(accepted > 0);
    }

    #[test]
    fn what_is_missing_is_named() {
        let conventions = Conventions::libero(3);
        let said = |frame: &[u8]| Answer::read(frame, &conventions).unwrap_err().to_string();
        assert!(said(&frame(vec![])).contains("`actions` is missing"));
        assert!(said(&[0xc0]).contains("`answer` is no map"));
        assert!(said(&frame(vec![("actions", actions(4))])).contains("declared are 3"));
    }
}
