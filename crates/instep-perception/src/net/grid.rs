//! How images lie in memory: planes with a border of zeros, so that a shifted image is a shifted slice.
//!
//! Rows follow each other with one zero between them (a row's right border and the next one's left), with a row of zeros
//! above and below. A convolution of stride 1 is then a sum of products of whole shifted planes, with no case for borders
//! and nothing unfolded. What falls on the borders is garbage and is cleared ([`Grid::clear`]). For stride 2 the image is
//! first parted into its four phases ([`Grid::part`]): even and odd rows and columns.

/// Before the first row, and behind the last, so that whole vectors can be read and written.
const LEAD: usize = 16;
const TAIL: usize = 48;

/// Rows and columns of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
}

impl Grid {
    /// From one row to the next.
    pub fn stride(&self) -> usize {
        self.columns + 1
    }

    /// Where the first pixel lies.
    pub fn first(&self) -> usize {
        LEAD + self.stride()
    }

    /// From the first pixel to the last border.
    pub fn count(&self) -> usize {
        self.rows * self.stride()
    }

    /// Length of a plane.
    pub fn len(&self) -> usize {
        LEAD + (self.rows + 2) * self.stride() + TAIL
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.rows * self.columns == 0
    }

    /// Half as many rows and columns.
    #[must_use]
    pub fn half(&self) -> Grid {
        Grid { rows: self.rows / 2, columns: self.columns / 2 }
    }

    /// The pixels of a row.
    pub fn row(&self, row: usize) -> std::ops::Range<usize> {
        let from = self.first() + row * self.stride();
        from..from + self.columns
    }

    /// Sets the borders of all planes to zero, as far as a convolution writes there.
    pub fn clear(&self, planes: &mut [f32]) {
        for plane in planes.chunks_exact_mut(self.len()) {
            for row in 0..self.rows {
                plane[self.row(row).end] = 0.0;
            }
            let behind = self.first() + self.count();
            plane[behind..behind + 32].fill(0.0);
        }
    }

    /// Planes without borders, one pixel after the other.
    pub fn plain(&self, planes: &[f32], to: &mut [f32]) {
        let pairs = planes.chunks_exact(self.len()).zip(to.chunks_exact_mut(self.rows * self.columns));
        for (plane, to) in pairs {
            for (row, to) in to.chunks_exact_mut(self.columns).enumerate() {
                to.copy_from_slice(&plane[self.row(row)]);
            }
        }
    }

    /// The other way; the borders are left as they are.
    pub fn bordered(&self, plain: &[f32], planes: &mut [f32]) {
        let pairs = planes.chunks_exact_mut(self.len()).zip(plain.chunks_exact(self.rows * self.columns));
        for (plane, from) in pairs {
            for (row, from) in from.chunks_exact(self.columns).enumerate() {
                plane[self.row(row)].copy_from_slice(from);
            }
        }
    }

    /// Parts each plane of this grid into four of half of it: rows 2 r + i and columns 2 c + j are phase 2 i + j.
    pub fn part(&self, planes: &[f32], phases: &mut [f32]) {
        let half = self.half();
        for (plane, four) in planes.chunks_exact(self.len()).zip(phases.chunks_exact_mut(4 * half.len())) {
            for row in 0..2 * half.rows {
                let line = &plane[self.row(row)];
                let start = (row % 2) * 2 * half.len();
                let (even, odd) = four[start..start + 2 * half.len()].split_at_mut(half.len());
                let pixels = half.row(row / 2);
                for ((e, o), pair) in even[pixels.clone()].iter_mut().zip(&mut odd[pixels]).zip(line.chunks_exact(2)) {
                    (*e, *o) = (pair[0], pair[1]);
                }
            }
        }
    }

    /// Adds four phases back to where they came from.
    pub fn join(&self, phases: &[f32], planes: &mut [f32]) {
        let half = self.half();
        for (plane, four) in planes.chunks_exact_mut(self.len()).zip(phases.chunks_exact(4 * half.len())) {
            for row in 0..2 * half.rows {
                let line = &mut plane[self.row(row)];
                let start = (row % 2) * 2 * half.len();
                let (even, odd) = four[start..start + 2 * half.len()].split_at(half.len());
                let pixels = half.row(row / 2);
                for ((e, o), pair) in even[pixels.clone()].iter().zip(&odd[pixels]).zip(line.chunks_exact_mut(2)) {
                    pair[0] += e;
                    pair[1] += o;
                }
            }
        }
    }
}
