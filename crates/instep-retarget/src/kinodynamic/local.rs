//! The Gauss-Newton matrix of one node in terms of the three spline coefficients that it sees and its forces.
//!
//! Rows that depend on positions only, and most do, are summed in a matrix of nv rows and spread over the three
//! coefficients once; the others take part with all of theirs.

use nalgebra::DMatrix;

use super::terms::Row;

/// How a node's position, speed and acceleration follow from three neighbouring coefficients of a uniform cubic
/// B-spline: (21)-(24) hold exactly, by construction. C. de Boor, A Practical Guide to Splines, 2001, chapter IX.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stencil {
    pub q: [f64; 3],
    pub v: [f64; 3],
    pub a: [f64; 3],
}

impl Stencil {
    /// For nodes `step` s apart.
    pub(crate) fn new(step: f64) -> Self {
        let (v, a) = (0.5 / step, 1.0 / (step * step));
        Self { q: [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], v: [-v, 0.0, v], a: [a, -2.0 * a, a] }
    }
}

/// Sums of one node.
#[derive(Debug, Clone)]
pub(crate) struct Local {
    nv: usize,
    stencil: Stencil,
    /// Of positions alone, lower half used.
    position: Vec<f64>,
    position_gradient: Vec<f64>,
    /// Coefficients (3 nv), then forces; lower half used.
    pub matrix: DMatrix<f64>,
    pub gradient: Vec<f64>,
    row: Row,
    dense: Vec<f64>,
    used: Vec<usize>,
}

impl Local {
    pub(crate) fn new(nv: usize, forces: usize, stencil: Stencil) -> Self {
        let size = 3 * nv + forces;
        Self {
            nv,
            stencil,
            position: vec![0.0; nv * nv],
            position_gradient: vec![0.0; nv],
            matrix: DMatrix::zeros(size, size),
            gradient: vec![0.0; size],
            row: Row::new(nv, forces),
            dense: vec![0.0; size],
            used: Vec::with_capacity(nv),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.position.fill(0.0);
        self.position_gradient.fill(0.0);
        self.matrix.fill(0.0);
        self.gradient.fill(0.0);
    }

    /// Adds weight residual^2 / 2 for a row.
    pub(crate) fn add(&mut self, weight: f64, residual: f64, fill: impl FnOnce(&mut Row)) {
        self.row.clear(self.gradient.len() - 3 * self.nv);
        fill(&mut self.row);
        let row = &self.row;
        let zero = |values: &[f64]| values.iter().all(|g| *g == 0.0);
        if zero(&row.v) && zero(&row.a) && zero(&row.f) {
            self.used.clear();
            self.used.extend((0..self.nv).filter(|&i| row.q[i] != 0.0));
            for &i in &self.used {
                let scaled = weight * row.q[i];
                self.position_gradient[i] += scaled * residual;
                for &j in self.used.iter().take_while(|&&j| j <= i) {
                    self.position[i * self.nv + j] += scaled * row.q[j];
                }
            }
            return;
        }
        self.spread();
        let size = self.gradient.len();
        for (j, column) in self.matrix.as_mut_slice().chunks_exact_mut(size).enumerate() {
            let scaled = weight * self.dense[j];
            if scaled != 0.0 {
                self.gradient[j] += scaled * residual;
                for (entry, g) in column[j..].iter_mut().zip(&self.dense[j..]) {
                    *entry += scaled * g;
                }
            }
        }
    }

    /// Adds a gradient without curvature.
    pub(crate) fn gradient_only(&mut self, fill: impl FnOnce(&mut Row)) {
        self.row.clear(self.gradient.len() - 3 * self.nv);
        fill(&mut self.row);
        self.spread();
        for (sum, g) in self.gradient.iter_mut().zip(&self.dense) {
            *sum += g;
        }
    }

    /// The row in terms of coefficients and forces.
    fn spread(&mut self) {
        let (row, nv, s) = (&self.row, self.nv, &self.stencil);
        for b in 0..3 {
            for (i, entry) in self.dense[b * nv..(b + 1) * nv].iter_mut().enumerate() {
                *entry = s.q[b] * row.q[i] + s.v[b] * row.v[i] + s.a[b] * row.a[i];
            }
        }
        self.dense[3 * nv..].copy_from_slice(&row.f);
    }

    /// Spreads what was summed for positions alone over the coefficients.
    pub(crate) fn finish(&mut self) {
        let nv = self.nv;
        let w = self.stencil.q;
        for b in 0..3 {
            for i in 0..nv {
                self.gradient[b * nv + i] += w[b] * self.position_gradient[i];
            }
            for c in 0..=b {
                let share = w[b] * w[c];
                for j in 0..nv {
                    for i in 0..nv {
                        // Entry (i, j) of a symmetric matrix of which the lower half is stored.
                        let value = self.position[i.max(j) * nv + i.min(j)];
                        if value != 0.0 && (b != c || i >= j) {
                            self.matrix[(b * nv + i, c * nv + j)] += share * value;
                        }
                    }
                }
            }
        }
    }
}
