//! The reachability grid (paper 3, section 2.1): the set of places that the kicking foot can reach while the robot stands
//! on the other, as 64 x 64 x 64 cells of 10 mm.
//!
//! It is measured by moving a robot through its cells; this file only keeps it. Places are the sole's centre of the right
//! foot in the frame of the left sole (x forward, y left, z up); for the other foot y changes its sign. The foot's rotation is not
//! in the grid, as in the paper. A block of 4 x 4 x 4 cells is one word, so that a search can leave out
//! empty or hopeless blocks at once. A grid knows the hash of the robot and stance that it was measured with.

use std::collections::{BinaryHeap, HashMap};

use nalgebra::Vector3;

use crate::KickError;

/// Cells along each axis.
pub const CELLS: usize = 64;
/// Edge of a cell, m.
pub const CELL: f64 = 0.01;
/// Corner of the first cell, m: the kicking foot is on the right of the support foot.
pub const CORNER: [f64; 3] = [-0.32, -0.5, 0.0];
/// Blocks along each axis.
pub(crate) const BLOCKS: usize = CELLS / 4;
/// First bytes of a file.
const MAGIC: &[u8; 8] = b"ireach01";

/// One cell: indices along x, y, z.
pub type Cell = [usize; 3];

/// The set of reachable cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    /// Of the robot and the stance.
    hash: u64,
    /// Blocks, x fastest, then y, then z; the same order of cells within a block.
    blocks: Vec<u64>,
}

impl Grid {
    /// No cell is reachable yet.
    #[must_use]
    pub fn new(hash: u64) -> Self {
        Self { hash, blocks: vec![0; BLOCKS * BLOCKS * BLOCKS] }
    }

    /// Hash of the robot and stance that it belongs to.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }

    fn place([x, y, z]: Cell) -> (usize, u32) {
        let block = (z / 4 * BLOCKS + y / 4) * BLOCKS + x / 4;
        (block, (((z % 4) * 4 + y % 4) * 4 + x % 4) as u32)
    }

    /// The cell that holds `point` (m); `None` outside.
    #[must_use]
    pub fn cell(point: &Vector3<f64>) -> Option<Cell> {
        let mut cell = [0; 3];
        for (k, index) in cell.iter_mut().enumerate() {
            let steps = ((point[k] - CORNER[k]) / CELL).floor();
            // Written so that a NaN is outside.
            if !(0.0..CELLS as f64).contains(&steps) {
                return None;
            }
            *index = steps as usize;
        }
        Some(cell)
    }

    /// The middle of a cell, m.
    #[must_use]
    pub fn centre(cell: Cell) -> Vector3<f64> {
        Vector3::from_fn(|k, _| CORNER[k] + (cell[k] as f64 + 0.5) * CELL)
    }

    /// Whether a cell is reachable.
    #[must_use]
    pub fn has(&self, cell: Cell) -> bool {
        let (block, bit) = Self::place(cell);
        self.blocks.get(block).is_some_and(|word| word >> bit & 1 == 1)
    }

    /// Whether the cell that holds `point` (m) is reachable.
    #[must_use]
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        Self::cell(point).is_some_and(|cell| self.has(cell))
    }

    /// Whether every cell that the straight way between two points (m) passes is reachable.
    #[must_use]
    pub fn clear(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
        let steps = ((to - from).norm() / (0.25 * CELL)).ceil().max(1.0) as usize;
        (0..=steps).all(|i| self.contains(&from.lerp(to, i as f64 / steps as f64)))
    }

    /// Marks a cell as reachable.
    pub fn insert(&mut self, cell: Cell) {
        let (block, bit) = Self::place(cell);
        if let Some(word) = self.blocks.get_mut(block) {
            *word |= 1 << bit;
        }
    }

    /// Takes over all cells of another grid.
    pub fn merge(&mut self, other: &Self) {
        self.blocks.iter_mut().zip(&other.blocks).for_each(|(word, other)| *word |= other);
    }

    /// Number of reachable cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether no cell is reachable.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Reachable volume, l.
    #[must_use]
    pub fn litres(&self) -> f64 {
        self.len() as f64 * CELL * CELL * CELL * 1e3
    }

    /// The blocks that are not empty: the first cell and the word of each.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (Cell, u64)> {
        self.blocks_in([[0, BLOCKS - 1]; 3])
    }

    /// The blocks that are not empty and hold a place within `reach` (m) of `point` on every axis.
    pub(crate) fn blocks_near(&self, point: &Vector3<f64>, reach: f64) -> impl Iterator<Item = (Cell, u64)> {
        // A cast takes what is outside, and a NaN, to the nearest end.
        let block = |k: usize, at: f64| (((at - CORNER[k]) / (4.0 * CELL)) as usize).min(BLOCKS - 1);
        self.blocks_in([0, 1, 2].map(|k| [block(k, point[k] - reach), block(k, point[k] + reach)]))
    }

    /// The blocks that are not empty between the first and the last on each axis, x fastest, then y, then z.
    fn blocks_in(&self, [x, y, z]: [[usize; 2]; 3]) -> impl Iterator<Item = (Cell, u64)> {
        let rows = (z[0]..=z[1]).flat_map(move |k| (y[0]..=y[1]).map(move |j| (k, j)));
        rows.flat_map(move |(k, j)| {
            let start = (k * BLOCKS + j) * BLOCKS;
            let row = self.blocks[start + x[0]..=start + x[1]].iter().zip(x[0]..);
            row.filter(|(word, _)| **word != 0).map(move |(word, i)| ([4 * i, 4 * j, 4 * k], *word))
        })
    }

    /// The cell of a bit of the block whose first cell is `first`.
    pub(crate) fn cell_of(first: Cell, bit: u32) -> Cell {
        let bit = bit as usize;
        [first[0] + bit % 4, first[1] + bit / 4 % 4, first[2] + bit / 16]
    }

    /// All reachable cells.
    pub fn cells(&self) -> impl Iterator<Item = Cell> {
        self.blocks().flat_map(|(first, word)| {
            (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| Self::cell_of(first, bit))
        })
    }

    /// The shortest way through reachable cells between two points (m), as points: the two ends and the corners between
    /// them where the straight way is blocked. `None` when an end is not reachable or there is no way.
    ///
    /// Dijkstra's algorithm (A note on two problems in connexion with graphs, 1959) with the straight distance as lower
    /// bound over the 26 neighbours, then corners that can be cut are left out. Allocates: for plans, not for ticks.
    #[must_use]
    pub fn way(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<Vec<Vector3<f64>>> {
        if self.clear(from, to) {
            return Some(vec![*from, *to]);
        }
        let (start, goal) = (Self::cell(from).filter(|c| self.has(*c))?, Self::cell(to).filter(|c| self.has(*c))?);
        let apart = |a: Cell, b: Cell| (Self::centre(a) - Self::centre(b)).norm();
        // Length of the best way to each cell that was seen, and the cell before it: a small part of the grid.
        let mut best = HashMap::from([(start, (0.0, start))]);
        let mut open = BinaryHeap::new();
        open.push((std::cmp::Reverse(micro(apart(start, goal))), start));
        while let Some((_, cell)) = open.pop() {
            if cell == goal {
                break;
            }
            let (length, _) = *best.get(&cell)?;
            for step in 0..27 {
                let next: [usize; 3] = [0, 1, 2].map(|k| (cell[k] + step / 3_usize.pow(k as u32) % 3).wrapping_sub(1));
                if next.iter().any(|i| *i >= CELLS) || !self.has(next) {
                    continue;
                }
                let new = length + apart(cell, next);
                if best.get(&next).is_none_or(|(known, _)| new + 1e-12 < *known) {
                    best.insert(next, (new, cell));
                    open.push((std::cmp::Reverse(micro(new + apart(next, goal))), next));
                }
            }
        }
        let mut way = vec![*to];
        let mut cell = goal;
        while cell != start {
            cell = best.get(&cell)?.1;
            way.push(if cell == start { *from } else { Self::centre(cell) });
        }
        way.reverse();
        // Corners that can be cut are.
        let mut short = vec![*from];
        let mut at = 0;
        while at + 1 < way.len() {
            let next = (at + 1..way.len()).rev().find(|j| self.clear(&way[at], &way[*j])).unwrap_or(at + 1);
            short.push(way[next]);
            at = next;
        }
        Some(short)
    }

    /// The grid as bytes: magic, hash, then the lengths of runs of unreachable and reachable cells in turn, x fastest,
    /// each as base-128 number with the lowest part first.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(self.hash.to_le_bytes());
        let mut put = |mut run: usize| loop {
            let low = (run & 0x7f) as u8;
            run >>= 7;
            bytes.push(if run == 0 { low } else { low | 0x80 });
            if run == 0 {
                break;
            }
        };
        let (mut run, mut kind) = (0, false);
        for i in 0..CELLS * CELLS * CELLS {
            let here = self.has([i % CELLS, i / CELLS % CELLS, i / (CELLS * CELLS)]);
            if here != kind {
                put(run);
                (run, kind) = (0, here);
            }
            run += 1;
        }
        put(run);
        bytes
    }

    /// A grid from [`Grid::to_bytes`]; `name` stands in errors.
    ///
    /// # Errors
    /// When the bytes are not those of a grid.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, KickError> {
        let wrong = |detail: &str| KickError::Parse {
            file: name.to_owned(),
            detail: format!("{detail}; expected a reachability grid, as `instep robot reach` writes it"),
        };
        let (Some(head), Some(hash)) = (bytes.get(..8), bytes.get(8..16).and_then(|b| b.try_into().ok())) else {
            return Err(wrong("too short"));
        };
        if head != MAGIC {
            return Err(wrong("not of this format"));
        }
        let mut grid = Self::new(u64::from_le_bytes(hash));
        let total = CELLS * CELLS * CELLS;
        let (mut cell, mut run, mut shift, mut kind) = (0, 0_usize, 0, false);
        for byte in &bytes[16..] {
            if shift > 21 {
                return Err(wrong("a run of cells is too long"));
            }
            run |= usize::from(byte & 0x7f) << shift;
            shift += 7;
            if byte & 0x80 != 0 {
                continue;
            }
            if run > total - cell {
                return Err(wrong("more cells than a grid has"));
            }
            for i in cell..cell + if kind { run } else { 0 } {
                grid.insert([i % CELLS, i / CELLS % CELLS, i / (CELLS * CELLS)]);
            }
            cell += run;
            (run, shift, kind) = (0, 0, !kind);
        }
        if cell == total && shift == 0 { Ok(grid) } else { Err(wrong("cut short")) }
    }
}

/// Length in micrometres, so that it can be ordered.
fn micro(length: f64) -> u64 {
    (length * 1e6) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(cells: &[Cell]) -> Grid {
        let mut grid = Grid::new(7);
        cells.iter().for_each(|cell| grid.insert(*cell));
        grid
    }

    proptest! {
        #[test]
        fn bytes_and_cells_come_back(cells in prop::collection::vec(prop::array::uniform3(0..CELLS), 0..200)) {
            let grid = grid(&cells);
            prop_assert_eq!(&Grid::from_bytes("test", &grid.to_bytes()).unwrap(), &grid);
            let mut known: Vec<Cell> = cells.clone();
            known.sort_unstable();
            known.dedup();
            let mut found: Vec<Cell> = grid.cells().collect();
            found.sort_unstable();
            prop_assert_eq!(found, known);
            for cell in &cells {
                prop_assert_eq!(Grid::cell(&Grid::centre(*cell)), Some(*cell));
            }
        }

        #[test]
        fn no_bytes_are_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let mut with_head = MAGIC.to_vec();
            with_head.extend(&bytes);
            prop_assert!(Grid::from_bytes("test", &bytes).is_err());
            let _ = Grid::from_bytes("test", &with_head);
        }
    }

    #[test]
    fn a_file_that_is_cut_short_is_refused() {
        let bytes = grid(&[[1, 2, 3]]).to_bytes();
        for cut in 0..bytes.len() {
            assert!(Grid::from_bytes("test", &bytes[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn the_shortest_way_goes_around_what_is_missing() {
        // A slab with a wall that leaves a gap on one side.
        let mut grid = Grid::new(0);
        for x in 10..30 {
            for y in 10..30 {
                if x != 20 || y < 13 {
                    grid.insert([x, y, 5]);
                }
            }
        }
        let [from, to] = [[12, 20, 5], [28, 20, 5]].map(Grid::centre);
        let way = grid.way(&from, &to).unwrap();
        assert!(way.len() > 2 && way[0] == from && way[way.len() - 1] == to);
        assert!(way.windows(2).all(|pair| grid.clear(&pair[0], &pair[1])));
        let length: f64 = way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        // Around the corner at (20, 12): two straight lines, a little more for the cells.
        let least = 2.0 * (0.08_f64.hypot(0.08));
        assert!(length > least && length < 1.1 * least, "{length} {least}");
        assert_eq!(grid.way(&from, &Grid::centre([40, 20, 5])), None);
        assert_eq!(grid.way(&from, &Grid::centre([14, 20, 5])).unwrap().len(), 2);
    }
}
