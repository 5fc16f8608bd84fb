//! Cholesky factorisation of a symmetric positive definite banded matrix, and the solution of one system with it.
//!
//! A problem whose neighbours in time are coupled has such a matrix; a general sparse solver would spend its time on
//! finding that out. Source: Golub and Van Loan, Matrix Computations (2013), algorithm 4.3.5, in the outer-product
//! form: its inner loop adds a multiple of one column to another, without a sum whose order would matter, so the
//! compiler may vectorise it and the bytes are the same on every machine.

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

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.entries.fill(0.0);
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
        for j in 0..self.size {
            let below = (self.rows - 1).min(self.size - 1 - j);
            let (left, right) = self.entries.split_at_mut((j + 1) * self.rows);
            let column = &mut left[j * self.rows..];
            let pivot = column[0];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            let root = pivot.sqrt();
            column[0] = root;
            let inverse = 1.0 / root;
            column[1..=below].iter_mut().for_each(|entry| *entry *= inverse);
            for k in 1..=below {
                let factor = column[k];
                if factor == 0.0 {
                    continue;
                }
                let target = &mut right[(k - 1) * self.rows..(k - 1) * self.rows + below - k + 1];
                for (entry, value) in target.iter_mut().zip(&column[k..=below]) {
                    *entry -= factor * value;
                }
            }
            // Forward substitution goes along.
            b[j] *= inverse;
            let known = b[j];
            for (rest, value) in b[j + 1..=j + below].iter_mut().zip(&column[1..=below]) {
                *rest -= known * value;
            }
        }
        for j in (0..self.size).rev() {
            let below = (self.rows - 1).min(self.size - 1 - j);
            let column = &self.entries[j * self.rows..j * self.rows + below + 1];
            let sum: f64 = column[1..].iter().zip(&b[j + 1..=j + below]).map(|(l, x)| l * x).sum();
            b[j] = (b[j] - sum) / column[0];
        }
        true
    }
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
