//! Fits the network with Adam: mean absolute error of the increments, cross entropy of the gripper.

use indicatif::ProgressBar;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, Axis, Zip};
use rand::{RngExt as _, SeedableRng as _, seq::SliceRandom as _};
use rand_chacha::ChaCha8Rng;
use sim_harness::backbone::bc::{INPUTS, Layer, Network, OUTPUTS};

use crate::dataset::{Sample, bounds, varied};

/// Neurons of the hidden layers.
const HIDDEN: [usize; 3] = [256, 256, 256];
/// Samples of a step.
const BATCH: usize = 128;
/// Learning rate; at the end of a cosine a hundredth of it.
const RATE: f32 = 1e-3;
/// First weights of the last layer, as a share of what they would be otherwise.
const LAST_SHARE: f32 = 0.1;
/// Adam's decay of the mean, of the square, and its floor (Kingma and Ba 2015).
const DECAY: (f32, f32, f32) = (0.9, 0.999, 1e-8);
/// Numbers of an action; the last is the gripper.
const ACTION: usize = 7;

/// How the learning rate goes over the steps of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pace {
    /// It stays: there will be more to learn.
    Steady,
    /// It falls along a cosine.
    Falling,
}

/// A dense layer with what Adam remembers of its gradients.
#[derive(Clone)]
struct Dense {
    weights: Tensor<Array2<f32>>,
    biases: Tensor<Array1<f32>>,
}

#[derive(Clone)]
struct Tensor<A> {
    value: A,
    mean: A,
    square: A,
}

/// The slopes of the loss by a layer's weights and biases.
type Gradient = (Array2<f32>, Array1<f32>);

/// The layers while they learn.
#[derive(Clone)]
struct Learner {
    layers: Vec<Dense>,
    step: i32,
}

/// A network in training.
pub(crate) struct Training {
    learner: Learner,
    scale: Network,
    rng: ChaCha8Rng,
}

impl Training {
    /// First weights drawn from `seed`; inputs are scaled over what occurs in `samples`.
    pub(crate) fn new(samples: &[Sample], seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (low, high) = bounds(samples);
        let mut sizes = vec![INPUTS];
        sizes.extend(HIDDEN);
        sizes.push(OUTPUTS);
        Self {
            learner: Learner::new(&sizes, &mut rng),
            scale: Network {
                low,
                high,
                layers: Vec::new(),
            },
            rng,
        }
    }

    /// Learns for so many steps; the mean loss over the last tenth of them.
    pub(crate) fn fit(
        &mut self,
        samples: &[Sample],
        steps: u32,
        pace: Pace,
        bar: &ProgressBar,
    ) -> f32 {
        let mut order: Vec<usize> = (0..samples.len()).collect();
        let mut next = order.len();
        let mut x = Array2::zeros((BATCH, INPUTS));
        let mut y = Array2::zeros((BATCH, OUTPUTS));
        let (mut sum, mut count) = (0.0, 0.0);
        for step in 0..steps {
            for row in 0..BATCH.min(BATCH * order.len()) {
                if next >= order.len() {
                    order.shuffle(&mut self.rng);
                    next = 0;
                }
                let sample = &samples[order[next]];
                next += 1;
                let input = self.scale.scaled(&varied(&sample.input, &mut self.rng));
                x.row_mut(row).assign(&ArrayView1::from(&input));
                y.row_mut(row).assign(&ArrayView1::from(&sample.output));
            }
            let done = step as f32 / steps as f32;
            let loss = self.learner.learn(x.view(), y.view(), rate(pace, done));
            if step >= steps - steps.div_ceil(10) {
                sum += loss;
                count += 1.0;
            }
            bar.inc(1);
        }
        sum / count
    }

    /// The network as it stands.
    pub(crate) fn network(&self) -> Network {
        Network {
            layers: self.learner.layers.iter().map(Dense::plain).collect(),
            ..self.scale.clone()
        }
    }
}

fn rate(pace: Pace, done: f32) -> f32 {
    match pace {
        Pace::Steady => RATE,
        Pace::Falling => RATE * (0.01 + 0.99 * 0.5 * (1.0 + (core::f32::consts::PI * done).cos())),
    }
}

/// The loss of one number of an answer and its slope: cross entropy with the logistic function of
/// the gripper's, which is meant to be -1 or 1, and the absolute error of all others.
fn loss(column: usize, answer: f32, meant: f32) -> (f32, f32) {
    if column % ACTION == ACTION - 1 {
        let wanted = f32::from(u8::from(meant > 0.0));
        let entropy = answer.max(0.0) - answer * wanted + (-answer.abs()).exp().ln_1p();
        (entropy, 1.0 / (1.0 + (-answer).exp()) - wanted)
    } else {
        let error = answer - meant;
        (error.abs(), if error == 0.0 { 0.0 } else { error.signum() })
    }
}

impl Learner {
    /// First weights: uniform, scaled by the number of inputs (He et al. 2015); those of the last
    /// layer are smaller, so that the first answers are.
    fn new(sizes: &[usize], rng: &mut ChaCha8Rng) -> Self {
        let last = sizes.len().saturating_sub(2);
        let layers = sizes
            .windows(2)
            .enumerate()
            .map(|(layer, pair)| {
                let share = if layer == last { LAST_SHARE } else { 1.0 };
                let limit = share * (6.0 / pair[0] as f32).sqrt();
                let weights = Array2::from_shape_simple_fn((pair[1], pair[0]), || {
                    limit * (2.0 * rng.random::<f32>() - 1.0)
                });
                Dense {
                    biases: Tensor::new(Array1::zeros(pair[1])),
                    weights: Tensor::new(weights),
                }
            })
            .collect();
        Self { layers, step: 0 }
    }

    /// What each layer takes in, and the answer.
    fn forward(&self, x: ArrayView2<'_, f32>) -> (Vec<Array2<f32>>, Array2<f32>) {
        let mut inputs = Vec::with_capacity(self.layers.len());
        let mut values = x.to_owned();
        for (i, layer) in self.layers.iter().enumerate() {
            if i > 0 {
                values.mapv_inplace(|v| v.max(0.0));
            }
            let next = values.dot(&layer.weights.value.t()) + &layer.biases.value;
            inputs.push(std::mem::replace(&mut values, next));
        }
        (inputs, values)
    }

    /// The loss, and its gradient by each layer's weights and biases.
    fn gradients(&self, x: ArrayView2<'_, f32>, y: ArrayView2<'_, f32>) -> (f32, Vec<Gradient>) {
        let (inputs, answer) = self.forward(x);
        let count = answer.len().max(1) as f32;
        let mut sum = 0.0;
        let mut slope = answer;
        for (mut answers, meant) in slope.rows_mut().into_iter().zip(y.rows()) {
            for (column, (value, meant)) in answers.iter_mut().zip(meant).enumerate() {
                let (loss, by_value) = loss(column, *value, *meant);
                sum += loss;
                *value = by_value / count;
            }
        }
        let loss = sum / count;
        let mut gradients = Vec::with_capacity(self.layers.len());
        for (layer, input) in self.layers.iter().zip(&inputs).rev() {
            gradients.push((slope.t().dot(input), slope.sum_axis(Axis(0))));
            slope = slope.dot(&layer.weights.value);
            // The rectifier before this layer; the first layer's input is not asked for.
            Zip::from(&mut slope).and(input).for_each(|s, v| {
                if *v <= 0.0 {
                    *s = 0.0;
                }
            });
        }
        gradients.reverse();
        (loss, gradients)
    }

    fn learn(&mut self, x: ArrayView2<'_, f32>, y: ArrayView2<'_, f32>, rate: f32) -> f32 {
        let (loss, gradients) = self.gradients(x, y);
        self.step += 1;
        for (layer, (weights, biases)) in self.layers.iter_mut().zip(&gradients) {
            adam(&mut layer.weights, weights, rate, self.step);
            adam(&mut layer.biases, biases, rate, self.step);
        }
        loss
    }
}

impl<D: ndarray::Dimension> Tensor<ndarray::Array<f32, D>> {
    fn new(value: ndarray::Array<f32, D>) -> Self {
        let zeros = ndarray::Array::zeros(value.raw_dim());
        Self {
            value,
            mean: zeros.clone(),
            square: zeros,
        }
    }
}

fn adam<D: ndarray::Dimension>(
    tensor: &mut Tensor<ndarray::Array<f32, D>>,
    gradient: &ndarray::Array<f32, D>,
    rate: f32,
    step: i32,
) {
    let (first, second, floor) = DECAY;
    let scale = rate * (1.0 - second.powi(step)).sqrt() / (1.0 - first.powi(step));
    Zip::from(&mut tensor.value)
        .and(&mut tensor.mean)
        .and(&mut tensor.square)
        .and(gradient)
        .for_each(|value, mean, square, g| {
            *mean = first * *mean + (1.0 - first) * g;
            *square = second * *square + (1.0 - second) * g * g;
            *value -= scale * *mean / (square.sqrt() + floor);
        });
}

impl Dense {
    fn plain(&self) -> Layer {
        Layer {
            inputs: self.weights.value.ncols(),
            weights: self.weights.value.iter().copied().collect(),
            biases: self.biases.value.to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learner(sizes: &[usize]) -> Learner {
        Learner::new(sizes, &mut ChaCha8Rng::seed_from_u64(3))
    }

    fn noise(rows: usize, columns: usize, seed: u64) -> Array2<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Array2::from_shape_simple_fn((rows, columns), || 2.0 * rng.random::<f32>() - 1.0)
    }

    #[test]
    fn gradients_are_the_slopes_of_the_loss() {
        let learner = learner(&[4, 6, 5, 8]);
        let (x, y) = (noise(8, 4, 1), noise(8, 8, 2));
        let (_, gradients) = learner.gradients(x.view(), y.view());
        let loss = |l: &Learner| f64::from(l.gradients(x.view(), y.view()).0);
        for (layer, (by_weights, by_biases)) in gradients.iter().enumerate() {
            let last = by_weights.nrows() - 1;
            for at in [(0, 0), (1, 2), (last.min(6), 3)] {
                let step = 1e-3;
                let [mut above, mut below] = [learner.clone(), learner.clone()];
                above.layers[layer].weights.value[at] += step;
                below.layers[layer].weights.value[at] -= step;
                let slope = (loss(&above) - loss(&below)) / (2.0 * f64::from(step));
                let ours = f64::from(by_weights[at]);
                assert!(
                    (slope - ours).abs() < 2e-3,
                    "layer {layer} {at:?}: {slope} {ours}"
                );
            }
            let [mut above, mut below] = [learner.clone(), learner.clone()];
            above.layers[layer].biases.value[1] += 1e-3;
            below.layers[layer].biases.value[1] -= 1e-3;
            let slope = (loss(&above) - loss(&below)) / 2e-3;
            assert!((slope - f64::from(by_biases[1])).abs() < 2e-3);
        }
    }

    #[test]
    fn a_simple_relation_is_learnt() {
        let mut learner = learner(&[2, 32, 1]);
        let x = noise(256, 2, 5);
        let y = x
            .map_axis(Axis(1), |row| (row[0] * row[1]).abs())
            .insert_axis(Axis(1));
        let first = learner.gradients(x.view(), y.view()).0;
        for _ in 0..1500 {
            learner.learn(x.view(), y.view(), 3e-3);
        }
        let last = learner.gradients(x.view(), y.view()).0;
        assert!(last < 0.1 * first, "{first} to {last}");
    }

    #[test]
    fn the_written_network_answers_as_the_learner() {
        let learner = learner(&[3, 7, 4]);
        let network = Network {
            low: vec![-1.0; 3],
            high: vec![1.0; 3],
            layers: learner.layers.iter().map(Dense::plain).collect(),
        };
        let x = noise(5, 3, 9);
        let (_, answer) = learner.forward(x.view());
        for (row, expected) in x.rows().into_iter().zip(answer.rows()) {
            let ours = network.answer(&row.to_vec());
            for (a, b) in ours.iter().zip(expected) {
                assert!((a - b).abs() < 1e-5, "{ours:?} {expected}");
            }
        }
    }
}
