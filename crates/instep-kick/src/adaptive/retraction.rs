//! The retraction point (paper 3, section 2.2): the reachable cell that maximises
//!
//! f(p) = (1 - delta) |p - p_f| + delta (1 + g(p))   (2),   g(p) = (p_f - p) . v / |p_f - p|   (1),
//!
//! and the forecast g at it. Distances in (2) are in mm, as the paper's grid, so that its delta of 1 - 10^-3 keeps its
//! meaning. The paper writes the hitting spot p_h where p_f stands here; the foot moves to p_f, and on the line through
//! both, where g is 1, it is the same.
//!
//! The search is exact: it gives what a look at all cells gives, but leaves out blocks of 4 x 4 x 4 cells in which f
//! cannot exceed the best value found (branch and bound; Land and Doig 1960). Allocates nothing.

use nalgebra::Vector3;

use crate::adaptive::grid::{CELL, Cell, Grid};

/// What is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Where the foot meets the ball, m.
    pub target: Vector3<f64>,
    /// Direction in which the foot should move there: a unit vector.
    pub direction: Vector3<f64>,
    /// Weight of the direction.
    pub delta: f64,
    /// Least and largest distance of the retraction point, m.
    pub range: [f64; 2],
    /// Least height of the retraction point, m.
    pub floor: f64,
}

/// A retraction point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Retraction {
    /// Its cell.
    pub cell: Cell,
    /// The point, m.
    pub point: Vector3<f64>,
    /// The forecast g: cosine of the angle between the foot's way and the wanted direction.
    pub forecast: f64,
    /// f.
    pub value: f64,
}

/// Equation (1).
#[must_use]
pub fn forecast(point: &Vector3<f64>, target: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    let way = target - point;
    let length = way.norm();
    if length > 0.0 { way.dot(direction) / length } else { 0.0 }
}

impl Wanted {
    /// Equation (2); `None` where the point is too near, too far or too low.
    #[must_use]
    pub fn value(&self, point: &Vector3<f64>) -> Option<f64> {
        let way = self.target - point;
        let length = way.norm();
        if length < self.range[0] || length > self.range[1] || point.z < self.floor {
            return None;
        }
        Some((1.0 - self.delta) * 1e3 * length + self.delta * (1.0 + way.dot(&self.direction) / length))
    }

    /// No cell of a block has a larger f than this.
    fn bound(&self, first: Cell) -> f64 {
        // The centres of the cells lie in a sphere about the block's middle.
        const RADIUS: f64 = 0.5 * 3.0 * CELL * 1.732_050_807_568_877_3;
        let middle = Grid::centre(first).add_scalar(1.5 * CELL);
        let way = self.target - middle;
        let apart = way.norm();
        if apart - RADIUS > self.range[1] || apart + RADIUS < self.range[0] {
            return f64::NEG_INFINITY;
        }
        let length = (apart + RADIUS).min(self.range[1]);
        // Cosine of the least angle to any point of the sphere: that to its middle less the half angle that it fills.
        let (middle, sine) = (way.dot(&self.direction) / apart, RADIUS / apart);
        let half = (1.0 - sine * sine).max(0.0).sqrt();
        let cosine = if sine < 1.0 && middle < half {
            middle * half + (1.0 - middle * middle).max(0.0).sqrt() * sine
        } else {
            1.0
        };
        // Rounding may not turn a bound into less than the value that it bounds.
        (1.0 - self.delta) * 1e3 * length + self.delta * (1.0 + cosine) + 1e-9
    }

    /// The cell with the largest f, the first of equals in the grid's order; `None` when there is none in range.
    #[must_use]
    pub fn search(&self, grid: &Grid, mirror: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Option<Retraction> {
        let mirrored = Self { target: mirror(&self.target), direction: mirror(&self.direction), ..*self };
        let found = mirrored.search_measured(grid)?;
        Some(Retraction { point: mirror(&found.point), ..found })
    }

    fn search_measured(&self, grid: &Grid) -> Option<Retraction> {
        let mut best: Option<(f64, Cell)> = None;
        let look = |cell: Cell, best: &mut Option<(f64, Cell)>| {
            let Some(value) = self.value(&Grid::centre(cell)) else { return };
            if best.is_none_or(|(most, at)| value > most || (value == most && order(cell) < order(at))) {
                *best = Some((value, cell));
            }
        };
        // The cells along the wanted way come first: they leave out most of the blocks.
        let steps = (self.range[1] / CELL).ceil() as usize;
        let way = (0..steps).map(|i| self.target - self.direction * (self.range[1] - i as f64 * CELL));
        way.filter_map(|point| Grid::cell(&point))
            .filter(|cell| grid.has(*cell))
            .for_each(|cell| look(cell, &mut best));
        for (first, word) in grid.blocks_near(&self.target, self.range[1]) {
            if best.is_some_and(|(value, _)| self.bound(first) < value) {
                continue;
            }
            let mut bits = word;
            while bits != 0 {
                look(Grid::cell_of(first, bits.trailing_zeros()), &mut best);
                bits &= bits - 1;
            }
        }
        best.map(|(value, cell)| {
            let point = Grid::centre(cell);
            Retraction { cell, point, forecast: forecast(&point, &self.target, &self.direction), value }
        })
    }
}

fn order([x, y, z]: Cell) -> [usize; 3] {
    [z, y, x]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};

    /// The definition: every cell is looked at.
    fn brute(wanted: &Wanted, grid: &Grid) -> Option<(f64, Cell)> {
        let mut best: Option<(f64, Cell)> = None;
        let mut cells: Vec<Cell> = grid.cells().collect();
        cells.sort_by_key(|cell| order(*cell));
        for cell in cells {
            if let Some(value) = wanted.value(&Grid::centre(cell))
                && best.is_none_or(|(most, _)| value > most)
            {
                best = Some((value, cell));
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn the_search_agrees_with_a_look_at_all_cells(
            seed in 0_u64..1000, x in -0.1..0.2_f64, y in -0.3..0.0_f64, z in 0.0..0.1_f64,
            angle in -3.2..3.2_f64, delta in prop::sample::select(vec![0.0, 0.5, 0.99, 0.999, 1.0]), least in 0.01..0.1_f64,
        ) {
            // A ragged half ball of cells.
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut grid = Grid::new(0);
            for _ in 0..4000 {
                let cell: Cell = [10..50, 15..55, 0..20].map(|range: std::ops::Range<usize>| rng.random_range(range));
                if (Grid::centre(cell) - Vector3::new(0.02, -0.12, 0.0)).norm() < 0.2 {
                    grid.insert(cell);
                }
            }
            let wanted = Wanted {
                target: Vector3::new(x, y, z),
                direction: Vector3::new(angle.cos(), angle.sin(), 0.0),
                delta,
                range: [least, least + 0.15],
                floor: 0.012,
            };
            let found = wanted.search(&grid, |p| *p).map(|r| (r.value, r.cell));
            prop_assert_eq!(found, brute(&wanted, &grid));
        }
    }

    #[test]
    fn with_the_papers_delta_ten_centimetres_outweigh_twenty_degrees() {
        let wanted = Wanted {
            target: Vector3::new(0.1, -0.1, 0.025),
            direction: Vector3::x(),
            delta: 0.999,
            range: [0.0, 1.0],
            floor: 0.0,
        };
        let at = |distance: f64, angle: f64| {
            let back = Vector3::new(angle.to_radians().cos(), angle.to_radians().sin(), 0.0) * distance;
            wanted.value(&(wanted.target - back)).unwrap()
        };
        assert!(at(0.15, 20.0) > at(0.05, 0.0) && at(0.15, 30.0) < at(0.05, 0.0));
    }
}
