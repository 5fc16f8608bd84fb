//! Cholesky factorisation of a symmetric positive definite banded matrix, and the solution of one system with it.
//!
//! A problem whose neighbours in time are coupled has such a matrix; a general sparse solver would spend its time on
//! finding that out. Source: Golub and Van Loan, Matrix Computations (2013), algorithm 4.3.5, in the outer-product
//! form, four columns at a time: its inner loop adds multiples of columns to another, entry by entry in a fixed order,
//! so the compiler may vectorise it and the bytes are the same however wide the machine's vectors are.

/// How many columns are taken out at a time.
const BLOCK: usize = 4;

/// A symmetric banded matrix of which the lower half is stored.
#[derive(Debug, Clone)]
pub struct Banded {
    size: usize,
    /// Rows of a stored column: the diagonal and the half-bandwidth below it.
    rows: usize,
    /// Column by column: entry (i, j), i >= j, at j * rows + (i - j).
    entries: Vec<f64>,
}

impl Banded {
    /// A zero matrix of `size` rows with `below` diagonals below the main one.
    #[must_use]
    pub fn zeros(size: usize, below: usize) -> Self {
        Self { size, rows: below + 1, entries: vec![0.0; size * (below + 1)] }
    }

    /// Adds `value` to entry (`row`, `column`), of which the row must not be above the diagonal nor out of the band.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        debug_assert!(row >= column && row - column < self.rows, "inside the lower band");
        self.entries[column * self.rows + row - column] += value;
    }

    /// The stored part of a column: the diagonal entry and those below it.
    pub fn column_mut(&mut self, column: usize) -> &mut [f64] {
        &mut self.entries[column * self.rows..(column + 1) * self.rows]
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.entries.fill(0.0);
    }

    /// Becomes a zero matrix of `size` rows with the same band, keeping its memory.
    pub fn resize(&mut self, size: usize) {
        self.size = size;
        self.entries.clear();
        self.entries.resize(size * self.rows, 0.0);
    }

    /// Becomes a copy of `other`, keeping its memory.
    pub fn copy_from(&mut self, other: &Self) {
        (self.size, self.rows) = (other.size, other.rows);
        self.entries.clone_from(&other.entries);
    }

    /// Takes variable `index` out of the system: its row and column become those of the identity.
    pub fn fix(&mut self, index: usize) {
        let below = self.rows - 1;
        self.column_mut(index).fill(0.0);
        self.entries[index * self.rows] = 1.0;
        for column in index.saturating_sub(below)..index {
            self.entries[column * self.rows + index - column] = 0.0;
        }
    }

    /// Factors the matrix in place and solves for `b`, which becomes the solution. Returns false when the matrix is
    /// not positive definite.
    #[must_use]
    pub fn factor_and_solve(&mut self, b: &mut [f64]) -> bool {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has the instructions, as just asked.
            return unsafe { self.factor_and_solve_avx512(b) };
        }
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { self.factor_and_solve_avx2(b) };
        }
        self.factor_and_solve_plain(b)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn factor_and_solve_avx512(&mut self, b: &mut [f64]) -> bool {
        self.factor_and_solve_plain(b)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn factor_and_solve_avx2(&mut self, b: &mut [f64]) -> bool {
        self.factor_and_solve_plain(b)
    }

    /// The work itself, compiled for each kind of processor above. Without fused multiply-add, and with sums in a
    /// fixed order: the bytes are those of any other machine.
    #[inline(always)]
    fn factor_and_solve_plain(&mut self, b: &mut [f64]) -> bool {
        let mut first = 0;
        while first < self.size {
            let width = BLOCK.min(self.size - first);
            if !self.factor_block(first, width) {
                return false;
            }
            self.update_after(first, width);
            first += width;
        }
        for j in 0..self.size {
            let column = &self.entries[j * self.rows..j * self.rows + self.below(j) + 1];
            b[j] /= column[0];
            let known = b[j];
            for (rest, value) in b[j + 1..].iter_mut().zip(&column[1..]) {
                *rest -= known * value;
            }
        }
        for j in (0..self.size).rev() {
            let column = &self.entries[j * self.rows..j * self.rows + self.below(j) + 1];
            b[j] = (b[j] - dot(&column[1..], &b[j + 1..])) / column[0];
        }
        true
    }

    /// How many entries column `j` has below its diagonal.
    #[inline(always)]
    fn below(&self, j: usize) -> usize {
        (self.rows - 1).min(self.size - 1 - j)
    }

    /// Factors the columns `first..first + width` among themselves.
    #[inline(always)]
    fn factor_block(&mut self, first: usize, width: usize) -> bool {
        for j in first..first + width {
            let below = self.below(j);
            let (left, right) = self.entries.split_at_mut((j + 1) * self.rows);
            let column = &mut left[j * self.rows..];
            let pivot = column[0];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            let root = pivot.sqrt();
            column[0] = root;
            column[1..=below].iter_mut().for_each(|entry| *entry /= root);
            for k in 1..=below.min(first + width - 1 - j) {
                let factor = column[k];
                let target = &mut right[(k - 1) * self.rows..(k - 1) * self.rows + below - k + 1];
                for (entry, value) in target.iter_mut().zip(&column[k..=below]) {
                    *entry -= factor * value;
                }
            }
        }
        true
    }

    /// Takes the factored columns `first..first + width` out of all columns behind them: several at a time, so that
    /// each entry is read and written once for all of them.
    #[inline(always)]
    fn update_after(&mut self, first: usize, width: usize) {
        let end = first + width;
        let reach = end - 1 + self.below(end - 1);
        let (left, right) = self.entries.split_at_mut(end * self.rows);
        let block = &left[first * self.rows..];
        for column in end..=reach {
            let target = &mut right[(column - end) * self.rows..(column - end + 1) * self.rows];
            // What each factored column holds from row `column` on; the first reach least far.
            let mut parts: [&[f64]; BLOCK] = [&[]; BLOCK];
            for (i, part) in parts.iter_mut().enumerate().take(width) {
                let stored = self.rows.min(self.size - first - i);
                let from = column - first - i;
                if from < stored {
                    *part = &block[i * self.rows + from..i * self.rows + stored];
                }
            }
            let common = parts[0].len().min(parts[BLOCK - 1].len());
            if common > 0 {
                let [f0, f1, f2, f3] = parts.map(|part| part[0]);
                let [p0, p1, p2, p3] = parts.map(|part| &part[..common]);
                for ((((entry, a), b), c), d) in target[..common].iter_mut().zip(p0).zip(p1).zip(p2).zip(p3) {
                    *entry -= f0 * a + f1 * b + f2 * c + f3 * d;
                }
            }
            for part in parts.iter().filter(|part| part.len() > common) {
                let factor = part[0];
                for (entry, value) in target[common..].iter_mut().zip(&part[common..]) {
                    *entry -= factor * value;
                }
            }
        }
    }
}

/// Sum of products over the shorter length, in eight interleaved sums.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let (a, b) = (&a[..length], &b[..length]);
    let mut sums = [0.0; 8];
    let whole = length - length % 8;
    for (a, b) in a[..whole].chunks_exact(8).zip(b[..whole].chunks_exact(8)) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a[whole..].iter().zip(&b[whole..]).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        /// Dense Cholesky of nalgebra as the independent oracle.
        #[test]
        fn agrees_with_a_dense_solver(
            size in 1_usize..40,
            below in 0_usize..9,
            values in prop::collection::vec(-1.0..1.0f64, 40 * 10),
            right in prop::collection::vec(-1.0..1.0f64, 40),
        ) {
            let mut banded = Banded::zeros(size, below);
            let mut dense = DMatrix::zeros(size, size);
            for j in 0..size {
                for i in j..size.min(j + below + 1) {
                    let value = if i == j { 20.0 } else { values[j * 10 + i - j] };
                    banded.add(i, j, value);
                    dense[(i, j)] = value;
                    dense[(j, i)] = value;
                }
            }
            let mut x = right[..size].to_vec();
            prop_assert!(banded.factor_and_solve(&mut x));
            let expected = dense.cholesky().unwrap().solve(&DVector::from_column_slice(&right[..size]));
            for (a, b) in x.iter().zip(expected.iter()) {
                prop_assert!((a - b).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut banded = Banded::zeros(2, 1);
        banded.add(0, 0, 1.0);
        banded.add(1, 0, 2.0);
        banded.add(1, 1, 1.0);
        assert!(!banded.factor_and_solve(&mut [1.0, 1.0]));
    }
}
