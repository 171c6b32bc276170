//! What was seen and done, and how it is varied while learning.

use rand::{Rng, RngExt as _};
use sim_harness::action::Action;
use sim_harness::backbone::bc::{
    COLOURS, INPUTS, NEAR_AT, OUTPUTS, PLACES, PROPRIO, SLOT_WIDTH, WORDS_AT,
};

/// How often the words of a sample are garbled; how many of them is drawn each time.
const GARBLED: f64 = 0.3;
/// Share of the buckets that random words fill.
const FILLED: f64 = 0.3;
/// How often an object is shown in a colour of its own choice.
const RECOLOURED: f64 = 0.2;

/// What was seen at a step, and the expert's chunk for it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sample {
    /// What the network sees.
    pub(crate) input: [f32; INPUTS],
    /// What it should answer.
    pub(crate) output: [f32; OUTPUTS],
    /// Whether it is the first of its episode: nothing has moved yet.
    pub(crate) start: bool,
}

impl Sample {
    pub(crate) fn new(input: [f32; INPUTS], actions: &[Action], start: bool) -> Self {
        let mut output = [0.0; OUTPUTS];
        for (slot, value) in output.iter_mut().zip(actions.iter().flatten()) {
            *slot = *value as f32;
        }
        Self {
            input,
            output,
            start,
        }
    }
}

/// Least and greatest of each input. Colours and words go from 0 to 1 whatever occurred. Places go
/// over where things stood before anything moved: a thing that is elsewhere is seen at the edge of
/// what was its place in training, and truly only by the hand that is near it.
pub(crate) fn bounds(samples: &[Sample]) -> (Vec<f32>, Vec<f32>) {
    let mut low = vec![f32::INFINITY; INPUTS];
    let mut high = vec![f32::NEG_INFINITY; INPUTS];
    for sample in samples {
        for (i, value) in sample.input.iter().enumerate() {
            if sample.start || !is_part(i, &PLACES) {
                low[i] = low[i].min(*value);
                high[i] = high[i].max(*value);
            }
        }
    }
    for (i, (low, high)) in low.iter_mut().zip(&mut high).enumerate() {
        if is_look_or_word(i) {
            (*low, *high) = (0.0, 1.0);
        }
    }
    (low, high)
}

/// Whether an input is such a part of an object's slot.
fn is_part(input: usize, part: &core::ops::Range<usize>) -> bool {
    (PROPRIO..NEAR_AT).contains(&input) && part.contains(&((input - PROPRIO) % SLOT_WIDTH))
}

fn is_look_or_word(input: usize) -> bool {
    input >= WORDS_AT || is_part(input, &COLOURS)
}

/// The input with colours and words varied, as image and text augmentation do it.
pub(crate) fn varied(input: &[f32; INPUTS], rng: &mut impl Rng) -> [f32; INPUTS] {
    let mut varied = *input;
    for slot in varied[PROPRIO..NEAR_AT].chunks_exact_mut(SLOT_WIDTH) {
        if rng.random_bool(RECOLOURED) {
            slot[COLOURS].iter_mut().for_each(|c| *c = rng.random());
        }
    }
    if rng.random_bool(GARBLED) {
        let replaced: f64 = rng.random();
        for word in &mut varied[WORDS_AT..] {
            if rng.random_bool(replaced) {
                *word = f32::from(u8::from(rng.random_bool(FILLED)));
            }
        }
    }
    varied
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn only_colours_and_words_vary() {
        let input = [0.25; INPUTS];
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut changed = [false; INPUTS];
        for _ in 0..200 {
            let other = varied(&input, &mut rng);
            changed
                .iter_mut()
                .zip(other)
                .for_each(|(c, v)| *c |= v != 0.25);
        }
        assert!((0..INPUTS).all(|i| changed[i] == is_look_or_word(i)));
    }

    #[test]
    fn bounds_are_those_of_the_samples() {
        let sample = |v: f32, start| Sample {
            input: [v; INPUTS],
            output: [0.0; OUTPUTS],
            start,
        };
        let samples = [sample(0.5, true), sample(-2.0, false), sample(0.25, true)];
        let (low, high) = bounds(&samples);
        assert_eq!((low[0], high[0]), (-2.0, 0.5));
        assert_eq!((low[INPUTS - 1], high[INPUTS - 1]), (0.0, 1.0));
        let place = PROPRIO + PLACES.start;
        assert_eq!((low[place], high[place]), (0.25, 0.5));
    }
}
