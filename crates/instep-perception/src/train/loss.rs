//! The loss of one frame: focal loss on the heat maps, absolute errors of rest and logarithm of size.
//!
//! Source: Zhou et al., Objects as Points (2019), equations (1) to (3): alpha 2, beta 4. A label's hill is as wide as its
//! box and not round; rest and size are also learnt around the middle, weighted by the hill. Under an ignored label
//! nothing is learnt.

use crate::class::Class;
use crate::label::Label;
use crate::net::shape::{CELL, INPUT, OUTPUTS, UNIT};

/// Cells in a row and in a column.
pub const GRID: [usize; 2] = [INPUT[0] / CELL, INPUT[1] / CELL];
/// Weights of rest and of size against the heat.
const REST: f32 = 1.0;
const SIZE: f32 = 1.0;
/// What a frame's loss is divided by: a usual number of labels, so that no frame counts more than another.
const USUAL: f32 = 5.0;
/// Cells with more of a hill than this learn rest and size: the peak's and its neighbours, where a peak may be found too.
const NEAR: f32 = 0.3;

/// Errors below this are squared, cells and units of logarithm.
const SMOOTH: f32 = 0.05;
/// What the cells of one label count together at most for rest and size, in peaks.
const MOST: f32 = 3.0;

/// Deviation of a label's hill along an axis of a box of `side` pixels, cells.
fn deviation(side: f32) -> f32 {
    (0.1 * side / CELL as f32).clamp(0.65, 4.0)
}

/// The loss, and its slope by the network's output into `slope`.
pub fn loss(output: &[f32], labels: &[Label], slope: &mut Vec<f32>) -> f64 {
    let [columns, rows] = GRID;
    let cells = columns * rows;
    slope.clear();
    slope.resize(OUTPUTS * cells, 0.0);
    let mut total = 0.0;
    let mut hill = vec![0.0f32; cells];
    let mut ignored = vec![false; cells];
    for class in Class::ALL {
        hill.fill(0.0);
        ignored.fill(false);
        let base = regression(class) * cells;
        for label in labels.iter().filter(|l| l.class == class) {
            let [x, y] = label.rect.middle().map(|v| v / CELL as f32 - 0.5);
            let (w, h) = (label.rect.width(), label.rect.height());
            let (cx, cy) = (x.round().clamp(0.0, columns as f32 - 1.0), y.round().clamp(0.0, rows as f32 - 1.0));
            let (sx, sy) = (deviation(w), deviation(h));
            let reach =
                |c: f32, s: f32, most: usize| ((c - 3.0 * s).max(0.0) as usize)..((c + 3.0 * s) as usize + 1).min(most);
            let height = |row: usize, column: usize| {
                let (dx, dy) = ((column as f32 - cx) / sx, (row as f32 - cy) / sy);
                (-0.5 * (dx * dx + dy * dy)).exp()
            };
            let cells_near = reach(cy, sy, rows).flat_map(|r| reach(cx, sx, columns).map(move |c| (r, c)));
            let all: f32 = cells_near.map(|(r, c)| height(r, c)).filter(|h| *h > NEAR).sum();
            // A robot's hill is many times a ball's; its box shall not count as many times.
            let share = (MOST / all).min(1.0);
            for row in reach(cy, sy, rows) {
                for column in reach(cx, sx, columns) {
                    let height = height(row, column);
                    let cell = row * columns + column;
                    if label.ignored {
                        ignored[cell] |= height > 0.1;
                        continue;
                    }
                    if height > hill[cell] {
                        hill[cell] = height;
                        if height > NEAR {
                            let wanted = [
                                (x - column as f32, REST),
                                (y - row as f32, REST),
                                ((w / UNIT).ln(), SIZE),
                                ((h / UNIT).ln(), SIZE),
                            ];
                            for (k, (value, weight)) in wanted.into_iter().enumerate() {
                                let at = base + k * cells + cell;
                                let error = output[at] - value;
                                // Smooth near zero (Huber).
                                let pull = (error / SMOOTH).clamp(-1.0, 1.0);
                                let value = pull * (error - 0.5 * SMOOTH * pull);
                                let weight = weight * share * height / USUAL;
                                slope[at] = weight * pull;
                                total += f64::from(weight * value);
                            }
                        }
                    }
                }
            }
        }
        for cell in 0..cells {
            let at = class.index() * cells + cell;
            let z = output[at];
            let y = hill[cell];
            // Far below the hill the slope is nothing: spare the exponential.
            if (ignored[cell] && y < 1.0) || (y == 0.0 && z < -9.0) {
                continue;
            }
            let p = (1.0 / (1.0 + (-z).exp())).clamp(1e-6, 1.0 - 1e-6);
            let (value, pull) = if y == 1.0 {
                let q = 1.0 - p;
                (-q * q * p.ln(), 2.0 * p * q * q * p.ln() - q * q * q)
            } else {
                let weight = (1.0 - y).powi(4);
                let log = (1.0 - p).ln();
                (-weight * p * p * log, weight * (p * p * p - 2.0 * p * p * (1.0 - p) * log))
            };
            total += f64::from(value / USUAL);
            slope[at] = pull / USUAL;
        }
    }
    total
}

/// The first of the four channels of a class's rest and size.
pub fn regression(class: Class) -> usize {
    Class::ALL.len() + if class.is_intersection() { 4 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::Rect;
    use rand::{RngExt as _, SeedableRng as _};

    #[test]
    fn the_slope_is_that_of_a_difference() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let label = |class, x: f32, y: f32, w: f32, h: f32, ignored| Label {
            class,
            rect: Rect::around([x, y], w, h),
            team: None,
            ignored,
            place: [f32::NAN; 3],
        };
        let labels = [
            label(Class::Ball, 101.0, 57.0, 22.0, 22.0, false),
            label(Class::Robot, 200.0, 110.0, 60.0, 150.0, false),
            label(Class::T, 300.0, 99.0, 30.0, 18.0, false),
            label(Class::L, 60.0, 99.0, 30.0, 18.0, true),
        ];
        let cells = GRID[0] * GRID[1];
        let mut output: Vec<f32> = (0..OUTPUTS * cells).map(|_| rng.random_range(-2.0..2.0)).collect();
        let (mut slope, mut spare) = (Vec::new(), Vec::new());
        loss(&output, &labels, &mut slope);
        let mut checked = 0;
        for at in (0..output.len()).step_by(37).chain([24 * 96 + 15, 8 * cells + 14 * 96 + 25]) {
            let (value, h) = (output[at], 1e-2);
            let mut moved = |x: f32| {
                output[at] = x;
                loss(&output, &labels, &mut spare)
            };
            let difference = (moved(value + h) - moved(value - h)) / (2.0 * f64::from(h));
            output[at] = value;
            let error = (difference - f64::from(slope[at])).abs();
            assert!(error < 3e-3 + 0.02 * difference.abs(), "{at}: {difference} {}", slope[at]);
            checked += usize::from(slope[at] != 0.0);
        }
        assert!(checked > 100);
    }
}
