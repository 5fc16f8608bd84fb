//! Convolution of bordered planes ([`super::grid`]) and its gradient, with nothing unfolded.
//!
//! On bordered planes each tap of a kernel is the whole image shifted, so a convolution is a product of a small matrix with
//! shifted slices. Eight output channels by 32 pixels are summed in registers over all channels and taps. The gradient by
//! the input is such a convolution too, with the taps turned round; that by the weights are dot products of shifted slices,
//! four output channels by six weights at a time.

use super::grid::Grid;
use super::lanes::{LANES, Lanes, for_the_processor};

/// A convolution's sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conv {
    /// Channels in.
    pub inputs: usize,
    /// Channels out.
    pub outputs: usize,
    /// Side of the kernel, 1 or 3.
    pub kernel: usize,
    /// Stride, 1 or 2. With 2 the input is given in its four phases.
    pub stride: usize,
}

/// What is done with a sum of products.
#[derive(Debug, Clone, Copy)]
pub struct After<'a> {
    /// Planes that are added: a residual layer's input.
    pub add: Option<&'a [f32]>,
    /// Slope of the activation below zero; 1 for none.
    pub leak: f32,
}

/// One of a kernel's taps: how far its pixel is from the output's in memory, and which weight it has.
#[derive(Debug, Clone, Copy, Default)]
struct Tap {
    offset: isize,
    index: usize,
}

impl Conv {
    /// Number of weights: outputs x inputs x kernel x kernel, in this order (as PyTorch and ONNX have them).
    pub fn weights(&self) -> usize {
        self.outputs * self.inputs * self.area()
    }

    fn area(&self) -> usize {
        self.kernel * self.kernel
    }

    /// Planes of the input: its phases count.
    fn planes(&self) -> usize {
        self.inputs * self.stride * self.stride
    }

    /// Multiplications and additions of one pass over an input of `rows` x `columns`.
    pub fn operations(&self, rows: usize, columns: usize) -> usize {
        2 * self.weights() * (rows / self.stride) * (columns / self.stride)
    }

    /// The taps, with the phase that each reads.
    fn taps(&self, grid: Grid) -> [(Tap, usize); 9] {
        let stride = grid.stride() as isize;
        std::array::from_fn(|k| {
            if self.kernel == 1 {
                return (Tap::default(), 0);
            }
            let (y, x) = (k / 3, k % 3);
            if self.stride == 1 {
                return (Tap { offset: (y as isize - 1) * stride + x as isize - 1, index: k }, 0);
            }
            // Row 2 r + y - 1 is row r - 1 of the odd ones, row r of the even ones, row r of the odd ones.
            let back = |k: usize| if k == 0 { -1 } else { 0 };
            let phase = 2 * usize::from(y != 1) + usize::from(x != 1);
            (Tap { offset: back(y) * stride + back(x), index: k }, phase)
        })
    }

    /// `output = activation(weight * input + bias + what is added)` on the output's grid; borders are cleared.
    ///
    /// # Panics
    /// When a slice has not the length that the sizes ask for.
    pub fn forward(
        &self,
        weight: &[f32],
        bias: &[f32],
        input: &[f32],
        grid: Grid,
        after: After<'_>,
        output: &mut [f32],
    ) {
        assert_eq!(weight.len(), self.weights(), "weights");
        assert_eq!(bias.len(), self.outputs, "bias");
        assert_eq!(input.len(), self.planes() * grid.len(), "input");
        assert_eq!(output.len(), self.outputs * grid.len(), "output");
        assert!(after.add.is_none_or(|add| add.len() == output.len()), "added planes");
        let taps =
            self.taps(grid).map(|(tap, phase)| Tap { offset: tap.offset + (phase * grid.len()) as isize, ..tap });
        sum_of_products(Job {
            weight,
            row: self.inputs * self.area(),
            channel: self.area(),
            taps: &taps[..self.area()],
            input,
            apart: self.stride * self.stride * grid.len(),
            channels: self.inputs,
            bias: Some(bias),
            after,
            grid,
            outputs: self.outputs,
            output: &mut *output,
            first: 0,
            output_apart: grid.len(),
        });
        grid.clear(output);
    }

    /// Adds to `to_weight` and `to_bias` the gradient of a loss by them, `slope` being that by the output (borders zero).
    ///
    /// # Panics
    /// As [`Self::forward`].
    pub fn to_weights(&self, input: &[f32], grid: Grid, slope: &[f32], to_weight: &mut [f32], to_bias: &mut [f32]) {
        assert_eq!(to_weight.len(), self.weights(), "weights");
        assert_eq!(input.len(), self.planes() * grid.len(), "input");
        assert_eq!(slope.len(), self.outputs * grid.len(), "slope");
        for (b, plane) in to_bias.iter_mut().zip(slope.chunks_exact(grid.len())) {
            *b += plane.chunks(64).map(|part| part.iter().sum::<f32>()).sum::<f32>();
        }
        let taps = self.taps(grid);
        let starts = (0..self.inputs).flat_map(|channel| {
            taps[..self.area()].iter().map(move |(tap, phase)| {
                let plane = channel * self.stride * self.stride + phase;
                (plane * grid.len() + grid.first()).wrapping_add_signed(tap.offset)
            })
        });
        let starts: Vec<usize> = starts.collect();
        dot_products(Dots { slope, input, grid, outputs: self.outputs, starts: &starts, to: to_weight });
    }

    /// Adds to `to_input` the gradient by the input; borders are cleared. With stride 2 it is that of the phases.
    ///
    /// # Panics
    /// As [`Self::forward`].
    pub fn to_input(&self, weight: &[f32], grid: Grid, slope: &[f32], to_input: &mut [f32]) {
        assert_eq!(weight.len(), self.weights(), "weights");
        assert_eq!(to_input.len(), self.planes() * grid.len(), "input");
        assert_eq!(slope.len(), self.outputs * grid.len(), "slope");
        let taps = self.taps(grid);
        let phases = self.stride * self.stride;
        for phase in 0..phases {
            let (mut chosen, mut count) = ([Tap::default(); 9], 0);
            for (tap, _) in taps[..self.area()].iter().filter(|(_, p)| *p == phase) {
                chosen[count] = Tap { offset: -tap.offset, index: tap.index };
                count += 1;
            }
            sum_of_products(Job {
                weight,
                row: self.area(),
                channel: self.inputs * self.area(),
                taps: &chosen[..count],
                input: slope,
                apart: grid.len(),
                channels: self.outputs,
                bias: None,
                after: After { add: None, leak: 1.0 },
                grid,
                outputs: self.inputs,
                output: &mut *to_input,
                first: phase * grid.len(),
                output_apart: phases * grid.len(),
            });
        }
        grid.clear(to_input);
    }
}

/// A sum of products of shifted planes.
struct Job<'a> {
    weight: &'a [f32],
    /// Between the weights of one output and the next, and of one input channel and the next.
    row: usize,
    channel: usize,
    taps: &'a [Tap],
    input: &'a [f32],
    /// Between the input's channels.
    apart: usize,
    channels: usize,
    /// What sums begin with; where there is none, with what is in the output.
    bias: Option<&'a [f32]>,
    after: After<'a>,
    grid: Grid,
    outputs: usize,
    output: &'a mut [f32],
    /// Where the output's first plane begins, and how far the next one is.
    first: usize,
    output_apart: usize,
}

/// Vectors of a tile.
const PAIR: usize = 2;

for_the_processor!(sum_of_products, all_tiles, Job<'_>);

/// # Safety
/// The processor has what `V` needs.
#[inline(always)]
unsafe fn all_tiles<V: Lanes>(mut job: Job<'_>) {
    let (from, count) = (job.grid.first(), job.grid.count());
    // Taps reach one row and one pixel beyond what is written.
    let reach = job.grid.stride() + 1;
    assert!(from >= reach && from + count.next_multiple_of(PAIR * LANES) + reach <= job.grid.len(), "borders");
    for p in (from..from + count).step_by(PAIR * LANES) {
        let mut o = 0;
        // SAFETY: the slices' lengths were compared with the grid's by the callers; a tile ends at most 31 pixels behind
        // the last row's border, within the plane's tail.
        unsafe {
            while o + 8 <= job.outputs {
                tile::<V, 8>(&mut job, o, p);
                o += 8;
            }
            while o + 2 <= job.outputs {
                tile::<V, 2>(&mut job, o, p);
                o += 2;
            }
            if o < job.outputs {
                tile::<V, 1>(&mut job, o, p);
            }
        }
    }
}

/// # Safety
/// Outputs o to o + R - 1 and pixels p to p + 31 with all their taps lie within the job's slices.
#[inline(always)]
unsafe fn tile<V: Lanes, const R: usize>(job: &mut Job<'_>, o: usize, p: usize) {
    // SAFETY: the caller's.
    unsafe {
        let to = job.output.as_mut_ptr().add(job.first + o * job.output_apart + p);
        let mut sums: [[V; PAIR]; R] = match job.bias {
            Some(bias) => std::array::from_fn(|r| [V::splat(bias[o + r]); PAIR]),
            None => std::array::from_fn(|r| {
                let at = to.add(r * job.output_apart);
                [V::load(at), V::load(at.add(LANES))]
            }),
        };
        let mut input = job.input.as_ptr().add(p);
        let mut weight = job.weight.as_ptr().add(o * job.row);
        for _ in 0..job.channels {
            for tap in job.taps {
                let from = input.offset(tap.offset);
                let (x, y) = (V::load(from), V::load(from.add(LANES)));
                let factor = weight.add(tap.index);
                for (r, sum) in sums.iter_mut().enumerate() {
                    let w = V::splat(*factor.add(r * job.row));
                    sum[0] = w.times_plus(x, sum[0]);
                    sum[1] = w.times_plus(y, sum[1]);
                }
            }
            input = input.wrapping_add(job.apart);
            weight = weight.wrapping_add(job.channel);
        }
        for (r, sum) in sums.into_iter().enumerate() {
            let at = to.add(r * job.output_apart);
            for (k, mut value) in sum.into_iter().enumerate() {
                if let Some(add) = job.after.add {
                    value = value.plus(V::load(add.as_ptr().add((o + r) * job.grid.len() + p + k * LANES)));
                }
                if job.after.leak != 1.0 {
                    value = value.leaky(job.after.leak);
                }
                value.store(at.add(k * LANES));
            }
        }
    }
}

/// Dot products of each output's slope with each shifted input.
struct Dots<'a> {
    slope: &'a [f32],
    input: &'a [f32],
    grid: Grid,
    outputs: usize,
    /// Where each weight's pixel of the first output pixel lies in the input.
    starts: &'a [usize],
    /// outputs x starts, added to.
    to: &'a mut [f32],
}

/// Pixels that are gone through at a time, so that a few planes of them stay in the nearest cache.
const STRETCH: usize = 1024;

for_the_processor!(dot_products, all_dots, Dots<'_>);

/// # Safety
/// The processor has what `V` needs.
#[inline(always)]
unsafe fn all_dots<V: Lanes>(mut job: Dots<'_>) {
    let count = job.grid.count();
    for from in (0..count).step_by(STRETCH) {
        // Behind the last pixel slopes are zero.
        let vectors = (count - from).min(STRETCH).div_ceil(LANES);
        let mut o = 0;
        // SAFETY: as for the sums of products.
        unsafe {
            while o + 4 <= job.outputs {
                line::<V, 4>(&mut job, o, from, vectors);
                o += 4;
            }
            while o < job.outputs {
                line::<V, 1>(&mut job, o, from, vectors);
                o += 1;
            }
        }
    }
}

/// # Safety
/// As [`dots`].
#[inline(always)]
unsafe fn line<V: Lanes, const R: usize>(job: &mut Dots<'_>, o: usize, from: usize, vectors: usize) {
    let mut s = 0;
    // SAFETY: the caller's.
    unsafe {
        while s + 6 <= job.starts.len() {
            dots::<V, R, 6>(job, o, s, from, vectors);
            s += 6;
        }
        while s < job.starts.len() {
            dots::<V, R, 1>(job, o, s, from, vectors);
            s += 1;
        }
    }
}

/// # Safety
/// Outputs o to o + R - 1, starts s to s + S - 1, and `vectors` vectors from `from` on lie within the job's slices.
#[inline(always)]
unsafe fn dots<V: Lanes, const R: usize, const S: usize>(
    job: &mut Dots<'_>,
    o: usize,
    s: usize,
    from: usize,
    vectors: usize,
) {
    // SAFETY: the caller's.
    unsafe {
        let mut slope = job.slope.as_ptr().add(o * job.grid.len() + job.grid.first() + from);
        let inputs: [*const f32; S] = std::array::from_fn(|k| job.input.as_ptr().add(job.starts[s + k] + from));
        let mut sums = [[V::splat(0.0); S]; R];
        for step in 0..vectors {
            let left: [V; R] = std::array::from_fn(|r| V::load(slope.add(r * job.grid.len())));
            for k in 0..S {
                let right = V::load(inputs[k].add(step * LANES));
                for r in 0..R {
                    sums[r][k] = left[r].times_plus(right, sums[r][k]);
                }
            }
            slope = slope.wrapping_add(LANES);
        }
        for (r, sums) in sums.into_iter().enumerate() {
            for (k, sum) in sums.into_iter().enumerate() {
                job.to[(o + r) * job.starts.len() + s + k] += sum.sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Straight from the definition, on plain planes.
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
        for (kernel, stride, size) in
            [(3, 1, [6, 10]), (3, 2, [8, 6]), (1, 1, [4, 6]), (3, 1, [40, 64]), (3, 2, [14, 24]), (3, 1, [1, 1])]
        {
            let conv = Conv { inputs: 3, outputs: 13, kernel, stride };
            let mut draw = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0f32)).collect::<Vec<_>>();
            let (weight, bias, input) = (draw(conv.weights()), draw(13), draw(3 * size[0] * size[1]));
            let whole = Grid { rows: size[0], columns: size[1] };
            let grid = if stride == 2 { whole.half() } else { whole };
            let n = 13 * grid.rows * grid.columns;
            let slope = draw(n);
            let bordered = |grid: Grid, plain: &[f32]| {
                let mut planes = vec![0.0; plain.len() / (grid.rows * grid.columns) * grid.len()];
                grid.bordered(plain, &mut planes);
                planes
            };
            let given = |plain: &[f32]| {
                let planes = bordered(whole, plain);
                if stride == 1 {
                    return planes;
                }
                let mut phases = vec![0.0; 4 * 3 * grid.len()];
                whole.part(&planes, &mut phases);
                phases
            };
            let x = given(&input);
            let mut y = vec![0.0; 13 * grid.len()];
            conv.forward(&weight, &bias, &x, grid, After { add: None, leak: 1.0 }, &mut y);
            let mut output = vec![0.0; n];
            grid.plain(&y, &mut output);
            let expected = plain(&conv, &weight, &bias, &input, size);
            assert!(output.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-4), "{kernel} {stride}");
            assert_eq!(bordered(grid, &output), y, "borders are zero");

            let (mut dw, mut db, mut dx) = (vec![0.0; weight.len()], vec![0.0; 13], vec![0.0; x.len()]);
            let s = bordered(grid, &slope);
            conv.to_weights(&x, grid, &s, &mut dw, &mut db);
            conv.to_input(&weight, grid, &s, &mut dx);
            let mut joined = vec![0.0; 3 * whole.len()];
            if stride == 2 {
                whole.join(&dx, &mut joined);
            } else {
                joined.copy_from_slice(&dx);
            }
            let mut to_input = vec![0.0; input.len()];
            whole.plain(&joined, &mut to_input);
            // <slope, conv(v, x)> is linear in weight, bias and input: its derivative along a direction is exact.
            let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
            let (vw, vb, vx) = (draw(weight.len()), draw(13), draw(input.len()));
            let zero = vec![0.0; 13];
            let along_weight = dot(&slope, &plain(&conv, &vw, &vb, &input, size));
            assert!((along_weight - dot(&dw, &vw) - dot(&db, &vb)).abs() < 1e-2, "{kernel} {stride}");
            let along_input = dot(&slope, &plain(&conv, &weight, &zero, &vx, size));
            assert!((along_input - dot(&to_input, &vx)).abs() < 1e-2, "{kernel} {stride}");
        }
    }

    /// The residual's sum and the activation, and that the vectors of every processor give the same.
    #[test]
    fn what_follows_the_sum_and_plain_arrays_agree() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let conv = Conv { inputs: 8, outputs: 8, kernel: 3, stride: 1 };
        let grid = Grid { rows: 9, columns: 21 };
        let mut draw = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0f32)).collect::<Vec<_>>();
        let (weight, bias, image) = (draw(conv.weights()), draw(8), draw(8 * 9 * 21));
        let mut x = vec![0.0; 8 * grid.len()];
        grid.bordered(&image, &mut x);
        let mut y = vec![0.0; 8 * grid.len()];
        conv.forward(&weight, &bias, &x, grid, After { add: Some(&x), leak: 0.1 }, &mut y);
        let mut found = vec![0.0; image.len()];
        grid.plain(&y, &mut found);
        for ((sum, x), y) in plain(&conv, &weight, &bias, &image, [9, 21]).iter().zip(&image).zip(&found) {
            let value = sum + x;
            assert!((value.max(0.1 * value) - y).abs() < 1e-4);
        }
        let taps = conv.taps(grid).map(|(tap, _)| tap);
        let mut again = vec![0.0; y.len()];
        let job = Job {
            weight: &weight,
            row: 72,
            channel: 9,
            taps: &taps,
            input: &x,
            apart: grid.len(),
            channels: 8,
            bias: Some(&bias),
            after: After { add: Some(&x), leak: 0.1 },
            grid,
            outputs: 8,
            output: &mut again,
            first: 0,
            output_apart: grid.len(),
        };
        // SAFETY: arrays need nothing of the processor.
        unsafe { all_tiles::<super::super::lanes::Plain<false>>(job) };
        grid.clear(&mut again);
        assert!(again.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
