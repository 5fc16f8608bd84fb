//! Convolution of planar images by im2col and products of our own, and its gradient.
//!
//! An image is channels x rows x columns, one after the other. A band of output rows at a time is unfolded (each output
//! pixel's inputs become a column) and multiplied, so that what is unfolded stays in the cache. Padding is with zeros,
//! half the kernel, so that stride 1 keeps the size and stride 2 halves it.

use super::product::{Target, View, add_product, add_product_transposed};

/// A convolution's sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conv {
    /// Channels in.
    pub inputs: usize,
    /// Channels out.
    pub outputs: usize,
    /// Side of the kernel, 1 or 3.
    pub kernel: usize,
    /// Stride, 1 or 2.
    pub stride: usize,
}

/// Output pixels that are unfolded at a time.
const BAND: usize = 1024;

impl Conv {
    /// Number of weights: outputs x inputs x kernel x kernel, in this order (as PyTorch and ONNX have them).
    pub fn weights(&self) -> usize {
        self.outputs * self.unfolded()
    }

    /// Rows of what is unfolded.
    fn unfolded(&self) -> usize {
        self.inputs * self.kernel * self.kernel
    }

    /// Multiplications and additions of one pass over an input of `rows` x `columns`.
    pub fn operations(&self, rows: usize, columns: usize) -> usize {
        2 * self.weights() * (rows / self.stride) * (columns / self.stride)
    }

    /// `output = weight * input + bias`; rows and columns are the input's, even where the stride is 2.
    ///
    /// # Panics
    /// When a slice has not the length that the sizes ask for.
    #[allow(clippy::too_many_arguments)]
    pub fn forward(
        &self,
        weight: &[f32],
        bias: &[f32],
        input: &[f32],
        [rows, columns]: [usize; 2],
        output: &mut [f32],
        unfolded: &mut Vec<f32>,
    ) {
        let (out_rows, out_columns) = (rows / self.stride, columns / self.stride);
        let pixels = out_rows * out_columns;
        assert_eq!(weight.len(), self.weights(), "weights");
        assert_eq!(input.len(), self.inputs * rows * columns, "input");
        assert_eq!(output.len(), self.outputs * pixels, "output");
        for (plane, b) in output.chunks_exact_mut(pixels).zip(bias) {
            plane.fill(*b);
        }
        let depth = self.unfolded();
        for (from, to) in self.bands(out_rows, out_columns) {
            let count = (to - from) * out_columns;
            let (matrix, stride, offset) = self.unfold(input, [rows, columns], from, to, unfolded);
            add_product(
                [self.outputs, depth, count],
                View { values: weight, offset: 0, row: depth, column: 1 },
                View { values: matrix, offset, row: stride, column: 1 },
                &mut Target { values: output, offset: from * out_columns, row: pixels },
            );
        }
    }

    /// Adds to `to_weight` and `to_bias` the gradient, and writes that of the input to `to_input` where it is asked for.
    ///
    /// # Panics
    /// As [`Self::forward`].
    #[allow(clippy::too_many_arguments)]
    pub fn backward(
        &self,
        weight: &[f32],
        input: &[f32],
        [rows, columns]: [usize; 2],
        slope: &[f32],
        to_weight: &mut [f32],
        to_bias: &mut [f32],
        mut to_input: Option<&mut [f32]>,
        unfolded: &mut Vec<f32>,
        back: &mut Vec<f32>,
    ) {
        let (out_rows, out_columns) = (rows / self.stride, columns / self.stride);
        let pixels = out_rows * out_columns;
        assert_eq!(slope.len(), self.outputs * pixels, "slope");
        for (b, plane) in to_bias.iter_mut().zip(slope.chunks_exact(pixels)) {
            *b += plane.iter().sum::<f32>();
        }
        if let Some(to) = to_input.as_deref_mut() {
            to.fill(0.0);
        }
        let depth = self.unfolded();
        for (from, to) in self.bands(out_rows, out_columns) {
            let count = (to - from) * out_columns;
            let first = from * out_columns;
            let (matrix, stride, offset) = self.unfold(input, [rows, columns], from, to, unfolded);
            add_product_transposed(
                [self.outputs, count, depth],
                View { values: slope, offset: first, row: pixels, column: 1 },
                View { values: matrix, offset, row: stride, column: 1 },
                &mut Target { values: to_weight, offset: 0, row: depth },
            );
            if let Some(to_input) = to_input.as_deref_mut() {
                back.clear();
                back.resize(depth * count, 0.0);
                add_product(
                    [depth, self.outputs, count],
                    View { values: weight, offset: 0, row: 1, column: depth },
                    View { values: slope, offset: first, row: pixels, column: 1 },
                    &mut Target { values: back, offset: 0, row: count },
                );
                self.fold(back, [rows, columns], from, to, to_input);
            }
        }
    }

    /// The bands of output rows, [from, to).
    fn bands(&self, out_rows: usize, out_columns: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let band = (BAND / out_columns).clamp(1, out_rows);
        (0..out_rows).step_by(band).map(move |from| (from, (from + band).min(out_rows)))
    }

    /// What the output pixels of a band take, one row of the result for each weight; also the distance between its rows and
    /// where it begins. A kernel of 1 takes the image as it is.
    fn unfold<'a>(
        &self,
        input: &'a [f32],
        [rows, columns]: [usize; 2],
        from: usize,
        to: usize,
        buffer: &'a mut Vec<f32>,
    ) -> (&'a [f32], usize, usize) {
        if self.kernel == 1 && self.stride == 1 {
            return (input, rows * columns, from * columns);
        }
        let out_columns = columns / self.stride;
        let count = (to - from) * out_columns;
        buffer.resize(self.unfolded() * count, 0.0);
        let mut lines = buffer.chunks_exact_mut(count);
        for plane in input.chunks_exact(rows * columns) {
            for ky in 0..self.kernel {
                for kx in 0..self.kernel {
                    let Some(line) = lines.next() else { break };
                    for (row, out) in (from..to).zip(line.chunks_exact_mut(out_columns)) {
                        match self.source(row, ky, rows) {
                            Some(y) => self.gather(&plane[y * columns..(y + 1) * columns], kx, out),
                            None => out.fill(0.0),
                        }
                    }
                }
            }
        }
        (buffer, count, 0)
    }

    /// The input row under kernel row `ky` of an output row.
    fn source(&self, row: usize, ky: usize, rows: usize) -> Option<usize> {
        (row * self.stride + ky).checked_sub(self.kernel / 2).filter(|&y| y < rows)
    }

    fn gather(&self, line: &[f32], kx: usize, out: &mut [f32]) {
        let (columns, pad) = (line.len(), self.kernel / 2);
        if self.stride == 1 {
            match kx.cmp(&pad) {
                std::cmp::Ordering::Less => {
                    out[0] = 0.0;
                    out[1..].copy_from_slice(&line[..columns - 1]);
                }
                std::cmp::Ordering::Equal => out.copy_from_slice(line),
                std::cmp::Ordering::Greater => {
                    out[..columns - 1].copy_from_slice(&line[1..]);
                    out[columns - 1] = 0.0;
                }
            }
        } else {
            // Columns 2 o + kx - pad.
            let (skip, start) = if kx < pad { (1, 1) } else { (0, kx - pad) };
            if skip == 1 {
                out[0] = 0.0;
            }
            for (o, pair) in out[skip..].iter_mut().zip(line[start..].chunks(2)) {
                *o = pair[0];
            }
        }
    }

    /// The other way: adds each column's parts to the input pixels that they came from.
    fn fold(&self, matrix: &[f32], [rows, columns]: [usize; 2], from: usize, to: usize, input: &mut [f32]) {
        let out_columns = columns / self.stride;
        let count = (to - from) * out_columns;
        let mut lines = matrix.chunks_exact(count);
        let pad = self.kernel / 2;
        for plane in input.chunks_exact_mut(rows * columns) {
            for ky in 0..self.kernel {
                for kx in 0..self.kernel {
                    let Some(line) = lines.next() else { break };
                    for (row, values) in (from..to).zip(line.chunks_exact(out_columns)) {
                        let Some(y) = self.source(row, ky, rows) else { continue };
                        let target = &mut plane[y * columns..(y + 1) * columns];
                        let skip = usize::from(kx < pad);
                        let start = (skip * self.stride + kx) - pad;
                        if self.stride == 1 {
                            for (t, v) in target[start..].iter_mut().zip(&values[skip..]) {
                                *t += v;
                            }
                        } else {
                            for (t, v) in target[start..].chunks_mut(2).zip(&values[skip..]) {
                                t[0] += v;
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Straight from the definition.
    fn plain(conv: &Conv, weight: &[f32], bias: &[f32], input: &[f32], [rows, columns]: [usize; 2]) -> Vec<f32> {
        let (h, w, k) = (rows / conv.stride, columns / conv.stride, conv.kernel);
        let mut output = vec![0.0; conv.outputs * h * w];
        for o in 0..conv.outputs {
            for y in 0..h {
                for x in 0..w {
                    let mut sum = bias[o];
                    for i in 0..conv.inputs {
                        for ky in 0..k {
                            for kx in 0..k {
                                let (sy, sx) = (
                                    (y * conv.stride + ky) as isize - (k / 2) as isize,
                                    (x * conv.stride + kx) as isize - (k / 2) as isize,
                                );
                                if sy >= 0 && sx >= 0 && (sy as usize) < rows && (sx as usize) < columns {
                                    sum += weight[((o * conv.inputs + i) * k + ky) * k + kx]
                                        * input[(i * rows + sy as usize) * columns + sx as usize];
                                }
                            }
                        }
                    }
                    output[(o * h + y) * w + x] = sum;
                }
            }
        }
        output
    }

    #[test]
    fn forward_is_the_definition_and_backward_its_transpose() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (kernel, stride, size) in [(3, 1, [6, 10]), (3, 2, [8, 6]), (1, 1, [4, 6]), (3, 1, [40, 64])] {
            let conv = Conv { inputs: 3, outputs: 5, kernel, stride };
            let mut draw = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0f32)).collect::<Vec<_>>();
            let (weight, bias, input) = (draw(conv.weights()), draw(5), draw(3 * size[0] * size[1]));
            let n = 5 * (size[0] / stride) * (size[1] / stride);
            let (slope, mut output) = (draw(n), vec![0.0; n]);
            let (mut u, mut b) = (Vec::new(), Vec::new());
            conv.forward(&weight, &bias, &input, size, &mut output, &mut u);
            let expected = plain(&conv, &weight, &bias, &input, size);
            assert!(output.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-4), "{kernel} {stride}");
            let (mut dw, mut db, mut dx) = (vec![0.0; weight.len()], vec![0.0; 5], vec![0.0; input.len()]);
            conv.backward(&weight, &input, size, &slope, &mut dw, &mut db, Some(&mut dx), &mut u, &mut b);
            // <slope, conv(v, x)> is linear in weight, bias and input: its derivative along a direction is exact.
            let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
            let (vw, vb, vx) = (draw(weight.len()), draw(5), draw(input.len()));
            let zero = vec![0.0; 5];
            let along_weight = dot(&slope, &plain(&conv, &vw, &vb, &input, size));
            assert!((along_weight - dot(&dw, &vw) - dot(&db, &vb)).abs() < 1e-2, "{kernel} {stride}");
            let along_input = dot(&slope, &plain(&conv, &weight, &zero, &vx, size));
            assert!((along_input - dot(&dx, &vx)).abs() < 1e-2, "{kernel} {stride}");
        }
    }
}
