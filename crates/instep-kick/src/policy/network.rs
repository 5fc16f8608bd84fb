//! A multi-layer perceptron that is only run, one observation at a time: no learner, no allocation.
//!
//! y = W x + b layer by layer with an activation between them, after the observation has been brought to zero mean and
//! unit deviation and clipped. Weights are in PyTorch's layout (out x in, row-major), f32.

use serde::{Deserialize, Serialize};

/// What stands between the layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// max(0, x): paper 1's.
    Relu,
    /// x above zero, exp(x) - 1 below.
    Elu,
}

impl Activation {
    /// Its value.
    #[must_use]
    pub fn apply(self, x: f32) -> f32 {
        match self {
            Self::Relu => x.max(0.0),
            Self::Elu => {
                if x > 0.0 {
                    x
                } else {
                    x.exp_m1()
                }
            }
        }
    }
}

/// One layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// out x in, row-major.
    pub weight: Vec<f32>,
    /// out.
    pub bias: Vec<f32>,
}

/// Mean and deviation of the observations that a network was trained on.
#[derive(Debug, Clone, PartialEq)]
pub struct Normalizer {
    /// Means.
    pub mean: Vec<f32>,
    /// Standard deviations, above zero.
    pub deviation: Vec<f32>,
}

impl Normalizer {
    /// Normalised observations are clipped to this many deviations.
    pub const CLIP: f32 = 10.0;

    /// Normalises `x` in place.
    pub fn apply(&self, x: &mut [f32]) {
        for ((x, mean), deviation) in x.iter_mut().zip(&self.mean).zip(&self.deviation) {
            *x = ((*x - mean) / deviation).clamp(-Self::CLIP, Self::CLIP);
        }
    }
}

/// A network with its scratch space.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Of its inputs.
    pub normalizer: Normalizer,
    /// From input to output.
    pub layers: Vec<Layer>,
    /// Between the layers.
    pub activation: Activation,
    scratch: [Vec<f32>; 2],
}

impl Network {
    /// A network of `layers`, whose sizes must fit each other and the normalizer.
    #[must_use]
    pub fn new(normalizer: Normalizer, layers: Vec<Layer>, activation: Activation) -> Self {
        let widest = layers.iter().map(|layer| layer.bias.len()).chain([normalizer.mean.len()]).max().unwrap_or(0);
        let scratch = [vec![0.0; widest], vec![0.0; widest]];
        Self { normalizer, layers, activation, scratch }
    }

    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.normalizer.mean.len()
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.bias.len())
    }

    /// The outputs for `observation`.
    ///
    /// # Panics
    /// When `observation` is longer than the network is wide.
    pub fn run(&mut self, observation: &[f32]) -> &[f32] {
        let [mut from, mut to] = std::mem::take(&mut self.scratch);
        from[..observation.len()].copy_from_slice(observation);
        self.normalizer.apply(&mut from[..observation.len()]);
        let last = self.layers.len().saturating_sub(1);
        let mut width = observation.len();
        for (l, layer) in self.layers.iter().enumerate() {
            for ((y, row), bias) in to.iter_mut().zip(layer.weight.chunks_exact(width)).zip(&layer.bias) {
                let sum = dot(row, &from[..width]) + bias;
                *y = if l == last { sum } else { self.activation.apply(sum) };
            }
            width = layer.bias.len();
            std::mem::swap(&mut from, &mut to);
        }
        self.scratch = [from, to];
        &self.scratch[0][..width]
    }
}

/// Eight sums side by side, so that it can be compiled to vector instructions; the order is fixed.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f32 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for i in 0..8 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f32>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_network_gives_what_is_computed_by_hand() {
        let normalizer = Normalizer { mean: vec![1.0, 0.0], deviation: vec![2.0, 1.0] };
        let first = Layer { weight: vec![1.0, 2.0, -1.0, 0.5, 0.0, -3.0], bias: vec![0.0, 0.5, 1.0] };
        let second = Layer { weight: vec![1.0, 1.0, 1.0], bias: vec![-0.25] };
        let mut network = Network::new(normalizer, vec![first, second], Activation::Relu);
        // (3 - 1) / 2 = 1 and 1: first layer 3, 0 (from -1 + 0.5 + 0.5), 0 (from -2).
        assert_eq!(network.run(&[3.0, 1.0]), &[2.75]);
        network.activation = Activation::Elu;
        let expected = 3.0 + 0.0 + (-2.0f32).exp_m1() - 0.25;
        assert!((network.run(&[3.0, 1.0])[0] - expected).abs() < 1e-6);
    }

    #[test]
    fn far_observations_are_clipped() {
        let normalizer = Normalizer { mean: vec![0.0], deviation: vec![0.1] };
        let layer = Layer { weight: vec![1.0], bias: vec![0.0] };
        let mut network = Network::new(normalizer, vec![layer], Activation::Elu);
        assert_eq!(network.run(&[1e9]), &[Normalizer::CLIP]);
    }
}
