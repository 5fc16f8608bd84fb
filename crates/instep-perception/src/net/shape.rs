//! The network: a small encoder to a thirty-second of the image and back to a quarter, with a head of heat maps.
//!
//! Source of the head: Zhou et al., Objects as Points (2019): a heat map for each class whose peaks are objects' middles,
//! and at each peak the middle's rest and the size. Ball, post and robot share one pair of rest and size, L, T and X
//! another: a ball often lies on a line. Source of the way back up: Lin et al., Feature Pyramid Networks (2017), with the
//! sums but without side outputs. No normalisation: nothing to fold, the same numbers in training and in use.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::conv::{After, Conv};
use super::grid::Grid;
use crate::class::Class;

/// The network's image: columns, rows.
pub const INPUT: [usize; 2] = [384, 224];
/// Pixels of the image on one cell of the output.
pub const CELL: usize = 4;
/// Channels of the output: six heat maps, rest x, y and log width, log height of things, the same of intersections.
pub const OUTPUTS: usize = Class::ALL.len() + 8;
/// Slope of the activation below zero.
pub const LEAK: f32 = 0.1;
/// Size of a box whose logarithm is 0, pixels.
pub const UNIT: f32 = 16.0;

/// One layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layer {
    /// The convolution.
    pub conv: Conv,
    /// The output that it takes, doubled in size, added to what it takes from the layer before.
    pub lateral: Option<usize>,
    /// Whether its input is added to its output before the activation.
    pub residual: bool,
}

const fn layer(inputs: usize, outputs: usize, stride: usize) -> Layer {
    Layer {
        conv: Conv { inputs, outputs, kernel: 3, stride },
        lateral: None,
        residual: stride == 1 && inputs == outputs,
    }
}

const fn upward(inputs: usize, outputs: usize, lateral: usize) -> Layer {
    Layer { lateral: Some(lateral), residual: false, ..layer(inputs, outputs, 1) }
}

/// The layers. Each takes what the one before gave; one with a `lateral` doubles that and adds the output of that layer.
pub const LAYERS: [Layer; 13] = [
    layer(3, 16, 2),
    layer(16, 24, 2),
    layer(24, 24, 1),
    layer(24, 40, 2),
    layer(40, 40, 1),
    layer(40, 64, 2),
    layer(64, 64, 1),
    layer(64, 64, 2),
    layer(64, 64, 1),
    upward(64, 40, 6),
    upward(40, 24, 4),
    upward(24, 32, 2),
    Layer { conv: Conv { inputs: 32, outputs: OUTPUTS, kernel: 1, stride: 1 }, lateral: None, residual: false },
];

/// Number of parameters: each layer's weights, then its bias, layer by layer.
pub fn parameters() -> usize {
    LAYERS.iter().map(|l| l.conv.weights() + l.conv.outputs).sum()
}

/// Each layer's part of the flat parameters: weights, bias.
pub fn parts() -> [(std::ops::Range<usize>, std::ops::Range<usize>); LAYERS.len()] {
    let mut at = 0;
    LAYERS.map(|l| {
        let weights = at..at + l.conv.weights();
        at = weights.end + l.conv.outputs;
        (weights.clone(), weights.end..at)
    })
}

/// The grid of each layer's input (after doubling).
fn grids() -> [Grid; LAYERS.len()] {
    let mut grid = Grid { rows: INPUT[1], columns: INPUT[0] };
    LAYERS.map(|l| {
        if l.lateral.is_some() {
            grid = Grid { rows: 2 * grid.rows, columns: 2 * grid.columns };
        }
        let input = grid;
        grid = l.output(grid);
        input
    })
}

impl Layer {
    /// The grid of its output.
    fn output(&self, input: Grid) -> Grid {
        if self.conv.stride == 2 { input.half() } else { input }
    }

    /// What follows its sums.
    fn after<'a>(&self, input: &'a [f32]) -> After<'a> {
        let last = self.conv.kernel == 1;
        After { add: self.residual.then_some(input), leak: if last { 1.0 } else { LEAK } }
    }
}

/// Multiplications and additions of one frame.
pub fn operations() -> usize {
    LAYERS.iter().zip(grids()).map(|(l, grid)| l.conv.operations(grid.rows, grid.columns)).sum()
}

/// Random parameters (He et al., 2015); heat starts at one in fifty.
pub fn initial(rng: &mut ChaCha8Rng) -> Vec<f32> {
    let mut all = vec![0.0; parameters()];
    for (i, (layer, (weights, bias))) in LAYERS.iter().zip(parts()).enumerate() {
        let last = i + 1 == LAYERS.len();
        let scale = if last {
            0.1
        } else if layer.residual {
            0.5
        } else {
            1.0
        };
        // Uniform of deviation sqrt(2 / in).
        let reach = scale * (6.0 / (layer.conv.inputs * layer.conv.kernel * layer.conv.kernel) as f32).sqrt();
        all[weights].iter_mut().for_each(|w| *w = rng.random_range(-reach..reach));
        if last {
            all[bias][..Class::ALL.len()].fill(-4.0);
        }
    }
    all
}

/// Buffers of one pass, kept between frames; images lie in them as [`Grid`] says.
#[derive(Debug, Clone, Default)]
pub struct Tape {
    /// What each layer took, where it is not the output before: the doubled sum, or the phases of a stride of 2.
    inputs: Vec<Vec<f32>>,
    /// What each layer gave.
    outputs: Vec<Vec<f32>>,
    slopes: Vec<Vec<f32>>,
    /// The gradient by a layer's input where it is not the output before.
    back: Vec<f32>,
    /// The image, and the last output without borders.
    image: Vec<f32>,
    output: Vec<f32>,
}

impl Tape {
    /// Buffers.
    pub fn new() -> Self {
        let pairs = || LAYERS.iter().zip(grids());
        let outputs: Vec<Vec<f32>> =
            pairs().map(|(l, grid)| vec![0.0; l.conv.outputs * l.output(grid).len()]).collect();
        let inputs = pairs()
            .map(|(l, grid)| {
                let planes = if l.conv.stride == 2 { 4 * grid.half().len() } else { grid.len() };
                let own = l.lateral.is_some() || l.conv.stride == 2;
                vec![0.0; if own { l.conv.inputs * planes } else { 0 }]
            })
            .collect();
        let image = vec![0.0; 3 * grids()[0].len()];
        let output = vec![0.0; OUTPUTS * (INPUT[0] / CELL) * (INPUT[1] / CELL)];
        Tape { inputs, slopes: outputs.clone(), outputs, back: Vec::new(), image, output }
    }

    /// The last layer's output: [`OUTPUTS`] planes of 56 x 96 cells.
    pub fn output(&self) -> &[f32] {
        &self.output
    }
}

/// Runs the network on an image of three planes, values about [-1, 1].
pub fn forward(parameters: &[f32], image: &[f32], tape: &mut Tape) {
    let (parts, grids) = (parts(), grids());
    grids[0].bordered(image, &mut tape.image);
    for (i, layer) in LAYERS.iter().enumerate() {
        let (weights, bias) = (&parameters[parts[i].0.clone()], &parameters[parts[i].1.clone()]);
        let (before, rest) = tape.outputs.split_at_mut(i);
        let previous = before.last().map_or(tape.image.as_slice(), Vec::as_slice);
        let own = &mut tape.inputs[i];
        let input = if let Some(lateral) = layer.lateral {
            double_and_add(previous, grids[i], &before[lateral], own);
            own.as_slice()
        } else if layer.conv.stride == 2 {
            grids[i].part(previous, own);
            own.as_slice()
        } else {
            previous
        };
        layer.conv.forward(weights, bias, input, layer.output(grids[i]), layer.after(input), &mut rest[0]);
    }
    let last = LAYERS.len() - 1;
    grids[last].plain(&tape.outputs[last], &mut tape.output);
}

/// Adds to `gradient` that of a loss whose slope by the output is `slope`, after [`forward`].
pub fn backward(parameters: &[f32], tape: &mut Tape, slope: &[f32], gradient: &mut [f32]) {
    let (parts, grids) = (parts(), grids());
    let last = LAYERS.len() - 1;
    tape.slopes[..last].iter_mut().for_each(|s| s.fill(0.0));
    grids[last].bordered(slope, &mut tape.slopes[last]);
    for (i, layer) in LAYERS.iter().enumerate().rev() {
        let (before, rest) = tape.slopes.split_at_mut(i);
        let slope = &mut rest[0];
        if i < last {
            // The activation keeps the sign.
            slope.iter_mut().zip(&tape.outputs[i]).for_each(|(s, &o)| *s *= if o > 0.0 { 1.0 } else { LEAK });
        }
        let own = layer.lateral.is_some() || layer.conv.stride == 2;
        let input = if own { &tape.inputs[i] } else { &tape.outputs[i - 1] };
        let (weights, bias) = (&parts[i].0, &parts[i].1);
        let (to_weight, to_bias) = gradient[weights.start..bias.end].split_at_mut(weights.len());
        let grid = layer.output(grids[i]);
        layer.conv.to_weights(input, grid, slope, to_weight, to_bias);
        let Some((previous, before)) = before.split_last_mut() else { continue };
        let weights = &parameters[weights.clone()];
        if own {
            tape.back.clear();
            tape.back.resize(input.len(), 0.0);
            layer.conv.to_input(weights, grid, slope, &mut tape.back);
        }
        if let Some(lateral) = layer.lateral {
            before[lateral].iter_mut().zip(&tape.back).for_each(|(b, t)| *b += t);
            halve_and_add(&tape.back, grid, previous);
        } else if own {
            grids[i].join(&tape.back, previous);
        } else {
            layer.conv.to_input(weights, grid, slope, previous);
            if layer.residual {
                previous.iter_mut().zip(slope.iter()).for_each(|(p, s)| *p += s);
            }
        }
    }
}

/// `to` = each pixel of `small` four times + `lateral`, on the grid of `to`.
fn double_and_add(small: &[f32], grid: Grid, lateral: &[f32], to: &mut [f32]) {
    let half = grid.half();
    let planes = to.chunks_exact_mut(grid.len()).zip(lateral.chunks_exact(grid.len()));
    for ((to, lateral), small) in planes.zip(small.chunks_exact(half.len())) {
        for row in 0..grid.rows {
            let line = to[grid.row(row)].chunks_exact_mut(2).zip(lateral[grid.row(row)].chunks_exact(2));
            for ((pair, add), &value) in line.zip(&small[half.row(row / 2)]) {
                (pair[0], pair[1]) = (value + add[0], value + add[1]);
            }
        }
    }
}

/// The other way: each pixel of `small` gets the sum of its four in `from`, on the grid of `from`.
fn halve_and_add(from: &[f32], grid: Grid, small: &mut [f32]) {
    let half = grid.half();
    for (from, small) in from.chunks_exact(grid.len()).zip(small.chunks_exact_mut(half.len())) {
        for row in 0..grid.rows {
            for (value, pair) in small[half.row(row / 2)].iter_mut().zip(from[grid.row(row)].chunks_exact(2)) {
                *value += pair[0] + pair[1];
            }
        }
    }
}

/// The network's image of a frame of its size: planes of red, green, blue from -1 to 1.
pub fn image(rgb: &[u8], planes: &mut Vec<f32>) {
    let pixels = rgb.len() / 3;
    planes.resize(3 * pixels, 0.0);
    for (c, plane) in planes.chunks_exact_mut(pixels).enumerate() {
        for (value, pixel) in plane.iter_mut().zip(rgb.chunks_exact(3)) {
            *value = f32::from(pixel[c]) * (2.0 / 255.0) - 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;

    /// The gradient along a random direction against a difference of the loss, through the whole network.
    #[test]
    fn the_gradient_is_that_of_a_difference() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut weights = initial(&mut rng);
        let last = parts()[LAYERS.len() - 1].1.clone();
        weights[last].fill(0.0);
        let image: Vec<f32> = (0..3 * INPUT[0] * INPUT[1]).map(|_| rng.random_range(-1.0..1.0)).collect();
        let mut tape = Tape::new();
        forward(&weights, &image, &mut tape);
        let slope: Vec<f32> = (0..tape.output().len()).map(|_| rng.random_range(-1.0..1.0)).collect();
        let mut gradient = vec![0.0; weights.len()];
        backward(&weights, &mut tape, &slope, &mut gradient);
        let mut loss = |moved: &[f32]| {
            forward(moved, &image, &mut tape);
            tape.output().iter().zip(&slope).map(|(o, s)| f64::from(o * s)).sum::<f64>()
        };
        for (i, (w, b)) in parts().iter().enumerate() {
            // Along the gradient of one layer, where the change is largest against rounding.
            let part = w.start..b.end;
            let square: f64 = gradient[part.clone()].iter().map(|g| f64::from(g * g)).sum();
            let step = (1e-2 / square.sqrt()) as f32;
            let moved = |sign: f32| {
                let mut moved = weights.clone();
                moved[part.clone()].iter_mut().zip(&gradient[part.clone()]).for_each(|(m, g)| *m += sign * step * g);
                moved
            };
            let difference = (loss(&moved(1.0)) - loss(&moved(-1.0))) / (2.0 * f64::from(step));
            assert!((difference / square - 1.0).abs() < 0.1, "layer {i}: {difference} {square}");
        }
    }

    #[test]
    fn the_network_is_as_small_as_its_card_says() {
        assert!(operations() < 450_000_000, "{}", operations());
        assert!(4 * parameters() < 1 << 20, "{}", parameters());
    }
}
