//! A multi-layer perceptron over batches, with its gradient: y = W x + b, an activation between the layers, none after the
//! last. Samples are columns. All parameters lie in one flat vector, layer by layer: W (out x in, column-major), then b.
//!
//! The products are matrixmultiply's, on which nalgebra stands: 97 % of the speed of the fastest crate measured
//! (facts/learning-stack.md) and no further dependency. nalgebra's own `gemm` is not used: 0.35 reads and writes out of
//! bounds where a transposed view meets a side of five or less.

use instep_kick::policy::{Activation, Layer};
use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A batch: one sample a column.
pub type Batch = DMatrix<f32>;

/// The shape of a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Mlp {
    sizes: Vec<usize>,
    activation: Activation,
}

/// The layers' outputs of one forward pass.
#[derive(Debug, Clone, Default)]
pub struct Tape {
    outputs: Vec<Batch>,
}

impl Tape {
    /// The network's output.
    #[must_use]
    pub fn output(&self) -> &Batch {
        &self.outputs[self.outputs.len() - 1]
    }
}

impl Mlp {
    /// From `inputs` through `hidden` to `outputs`.
    #[must_use]
    pub fn new(inputs: usize, hidden: &[usize], outputs: usize, activation: Activation) -> Self {
        let sizes = [&[inputs], hidden, &[outputs]].concat();
        Self { sizes, activation }
    }

    /// Number of parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.sizes.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
    }

    /// Random parameters: deviation sqrt(2 / in) (He et al., 2015), the last layer's a hundredth of it, no bias.
    #[must_use]
    pub fn initial(&self, rng: &mut ChaCha8Rng) -> Vec<f32> {
        let mut parameters = Vec::with_capacity(self.parameters());
        let last = self.sizes.len() - 2;
        for (l, pair) in self.sizes.windows(2).enumerate() {
            let deviation = (2.0 / pair[0] as f32).sqrt() * if l == last { 0.01 } else { 1.0 };
            parameters.extend((0..pair[0] * pair[1]).map(|_| deviation * rng.sample::<f32, _>(StandardNormal)));
            parameters.extend(std::iter::repeat_n(0.0, pair[1]));
        }
        parameters
    }

    /// Runs the network on a batch.
    pub fn forward(&self, parameters: &[f32], input: &Batch, tape: &mut Tape) {
        let samples = input.ncols();
        tape.outputs.resize(self.sizes.len() - 1, Batch::zeros(0, 0));
        for (l, (weight, bias)) in self.layers(parameters).enumerate() {
            let (before, rest) = tape.outputs.split_at_mut(l);
            let from = before.last().unwrap_or(input);
            let to = &mut rest[0];
            if to.shape() != (weight.rows, samples) {
                *to = Batch::zeros(weight.rows, samples);
            }
            multiply(weight.plain(), Matrix::of(from), to.as_mut_slice(), 0.0);
            let last = l + 2 == self.sizes.len();
            for column in to.as_mut_slice().chunks_exact_mut(bias.len()) {
                column.iter_mut().zip(bias).for_each(|(y, b)| *y += b);
            }
            if !last {
                self.activate(to.as_mut_slice());
            }
        }
    }

    /// Adds to `gradient` that of a loss whose slope by the output is `slope`, after [`Self::forward`] on `input`.
    pub fn backward(&self, parameters: &[f32], input: &Batch, tape: &Tape, slope: &Batch, gradient: &mut [f32]) {
        let mut slope = slope.clone();
        let mut end = self.parameters();
        let layers: Vec<_> = self.layers(parameters).collect();
        for (l, (weight, bias)) in layers.iter().enumerate().rev() {
            let from = if l == 0 { input } else { &tape.outputs[l - 1] };
            let start = end - weight.values.len() - bias.len();
            let (to_weight, to_bias) = gradient[start..end].split_at_mut(weight.values.len());
            end = start;
            multiply(Matrix::of(&slope), Matrix::of(from).transposed(), to_weight, 1.0);
            for column in slope.as_slice().chunks_exact(to_bias.len()) {
                to_bias.iter_mut().zip(column).for_each(|(b, s)| *b += s);
            }
            if l > 0 {
                let mut before = Batch::zeros(weight.columns, slope.ncols());
                multiply(weight.plain().transposed(), Matrix::of(&slope), before.as_mut_slice(), 0.0);
                let slopes = before.as_mut_slice().iter_mut().zip(from.as_slice());
                match self.activation {
                    Activation::Relu => slopes.for_each(|(s, &y)| *s *= f32::from(u8::from(y > 0.0))),
                    Activation::Elu => slopes.for_each(|(s, &y)| *s *= 1.0 + y.min(0.0)),
                }
                slope = before;
            }
        }
    }

    /// The activation of every number, the choice of it taken out of the loop.
    fn activate(&self, values: &mut [f32]) {
        match self.activation {
            Activation::Relu => values.iter_mut().for_each(|y| *y = y.max(0.0)),
            Activation::Elu => values.iter_mut().for_each(|y| *y = Activation::Elu.apply(*y)),
        }
    }

    /// The layers as an engine runs them.
    #[must_use]
    pub fn export(&self, parameters: &[f32]) -> Vec<Layer> {
        self.layers(parameters)
            .map(|(weight, bias)| Layer { weight: weight.row_major(), bias: bias.to_vec() })
            .collect()
    }

    /// The parameters of layers that fit this shape.
    #[must_use]
    pub fn import(&self, layers: &[Layer]) -> Option<Vec<f32>> {
        let pairs: Vec<_> = self.sizes.windows(2).collect();
        let fits = layers.len() == pairs.len()
            && layers
                .iter()
                .zip(&pairs)
                .all(|(layer, pair)| layer.bias.len() == pair[1] && layer.weight.len() == pair[0] * pair[1]);
        fits.then(|| {
            layers
                .iter()
                .zip(&pairs)
                .flat_map(|(layer, pair)| {
                    let weight = DMatrix::from_row_slice(pair[1], pair[0], &layer.weight);
                    [weight.as_slice(), &layer.bias].concat()
                })
                .collect()
        })
    }

    /// Each layer's weights and bias.
    fn layers<'a>(&'a self, parameters: &'a [f32]) -> impl Iterator<Item = (Weight<'a>, &'a [f32])> {
        let mut rest = parameters;
        self.sizes.windows(2).map(move |pair| {
            let (weight, after) = rest.split_at(pair[0] * pair[1]);
            let (bias, after) = after.split_at(pair[1]);
            rest = after;
            (Weight { values: weight, rows: pair[1], columns: pair[0] }, bias)
        })
    }
}

/// A matrix inside the flat vector.
#[derive(Debug, Clone, Copy)]
struct Weight<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
}

impl<'a> Weight<'a> {
    fn plain(&self) -> Matrix<'a> {
        Matrix { values: self.values, rows: self.rows, columns: self.columns, transposed: false }
    }

    fn row_major(&self) -> Vec<f32> {
        DMatrix::from_column_slice(self.rows, self.columns, self.values).transpose().as_slice().to_vec()
    }
}

/// A matrix for a product: `rows` x `columns` numbers, column-major, or row-major when transposed.
#[derive(Debug, Clone, Copy)]
struct Matrix<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    transposed: bool,
}

impl<'a> Matrix<'a> {
    fn of(batch: &'a Batch) -> Self {
        Self { values: batch.as_slice(), rows: batch.nrows(), columns: batch.ncols(), transposed: false }
    }

    fn transposed(self) -> Self {
        Self { rows: self.columns, columns: self.rows, transposed: !self.transposed, ..self }
    }

    /// Distances between neighbours in a column and in a row.
    fn strides(&self) -> (isize, isize) {
        // A slice is never longer than isize::MAX bytes.
        if self.transposed { (self.columns as isize, 1) } else { (1, self.rows as isize) }
    }
}

/// `c = a b + beta c`, with `c` column-major.
///
/// # Panics
/// When the sizes do not fit.
fn multiply(a: Matrix<'_>, b: Matrix<'_>, c: &mut [f32], beta: f32) {
    assert_eq!(a.columns, b.rows, "sides that meet");
    for matrix in [&a, &b] {
        assert_eq!(matrix.values.len(), matrix.rows * matrix.columns, "a full matrix");
    }
    assert_eq!(c.len(), a.rows * b.columns, "room for the product");
    let ((a_row, a_column), (b_row, b_column)) = (a.strides(), b.strides());
    // SAFETY: with these strides every index lies inside the slice it belongs to, whose lengths were just compared with the
    // sizes; `c` is borrowed mutably, so it overlaps neither.
    unsafe {
        matrixmultiply::sgemm(
            a.rows,
            a.columns,
            b.columns,
            1.0,
            a.values.as_ptr(),
            a_row,
            a_column,
            b.values.as_ptr(),
            b_row,
            b_column,
            beta,
            c.as_mut_ptr(),
            1,
            a.rows as isize,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn loss(mlp: &Mlp, parameters: &[f32], input: &Batch) -> f64 {
        let mut tape = Tape::default();
        mlp.forward(parameters, input, &mut tape);
        tape.output().iter().map(|&y| 0.5 * f64::from(y) * f64::from(y)).sum()
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        for activation in [Activation::Elu, Activation::Relu] {
            let mlp = Mlp::new(5, &[7, 6], 3, activation);
            let mut rng = ChaCha8Rng::seed_from_u64(7);
            let mut parameters = mlp.initial(&mut rng);
            // Away from the tiny last layer and the kink at zero.
            parameters.iter_mut().for_each(|p| *p += 0.3 * rng.sample::<f32, _>(StandardNormal));
            let input = Batch::from_fn(5, 4, |_, _| rng.sample(StandardNormal));
            let mut tape = Tape::default();
            mlp.forward(&parameters, &input, &mut tape);
            let mut gradient = vec![0.0; mlp.parameters()];
            let slope = tape.output().clone();
            mlp.backward(&parameters, &input, &tape, &slope, &mut gradient);
            for i in 0..parameters.len() {
                let h = 1e-2;
                let at = |d: f32| {
                    let mut moved = parameters.clone();
                    moved[i] += d;
                    loss(&mlp, &moved, &input)
                };
                let difference = (at(h) - at(-h)) / (2.0 * f64::from(h));
                let error = (difference - f64::from(gradient[i])).abs();
                assert!(error < 0.03 * (1.0 + difference.abs()), "{activation:?} {i}: {difference} {}", gradient[i]);
            }
        }
    }

    #[test]
    fn an_engine_runs_the_same_network() {
        use instep_kick::policy::{Network, Normalizer};
        let mlp = Mlp::new(12, &[9, 17], 4, Activation::Elu);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut parameters = mlp.initial(&mut rng);
        parameters.iter_mut().for_each(|p| *p += 0.1 * rng.sample::<f32, _>(StandardNormal));
        let input = Batch::from_fn(12, 3, |_, _| rng.sample(StandardNormal));
        let mut tape = Tape::default();
        mlp.forward(&parameters, &input, &mut tape);
        let layers = mlp.export(&parameters);
        assert_eq!(mlp.import(&layers).as_deref(), Some(&parameters[..]));
        let normalizer = Normalizer { mean: vec![0.0; 12], deviation: vec![1.0; 12] };
        let mut network = Network::new(normalizer, layers, Activation::Elu);
        for sample in 0..3 {
            let output = network.run(input.column(sample).as_slice());
            for (a, b) in output.iter().zip(tape.output().column(sample).iter()) {
                assert!((a - b).abs() < 1e-5, "{a} {b}");
            }
        }
    }
}
