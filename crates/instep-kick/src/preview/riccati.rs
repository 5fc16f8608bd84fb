//! The discrete algebraic Riccati equation, by the structure-preserving doubling algorithm.
//!
//! Problem: the stabilising P of P = A^T P A + Q - A^T P B (R + B^T P B)^-1 B^T P A, the equation of paper 5, section 3.2.
//! Source: Chu, Fan, Lin, Wang, Structure-preserving algorithms for periodic discrete-time algebraic Riccati equations
//! (2004), section 2: with G = B R^-1 B^T and H = Q, each round replaces
//!
//! A <- A W A,  G <- G + A W G A^T,  H <- H + A^T H W A,  W = (I + G H)^-1,
//!
//! and H goes to P, the number of right digits doubling in each round. Nothing here knows what the matrices mean: the
//! same call gives a regulator's gains and, of the transposed system, a Kalman filter's.

use nalgebra::SMatrix;

/// Most rounds: sixty double any error that a number can hold away.
const ROUNDS: usize = 60;

/// The stabilising solution for A (N x N), B (N x M), Q (N x N) and R (M x M); `None` where the doubling does not settle,
/// as for a system that cannot be stabilised, or an R that cannot be inverted.
#[must_use]
pub fn solve<const N: usize, const M: usize>(
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, M>,
    q: &SMatrix<f64, N, N>,
    r: &SMatrix<f64, M, M>,
) -> Option<SMatrix<f64, N, N>> {
    let mut a = *a;
    let mut g = b * r.try_inverse()? * b.transpose();
    let mut h = *q;
    for _ in 0..ROUNDS {
        let w = (SMatrix::<f64, N, N>::identity() + g * h).try_inverse()?;
        let aw = a * w;
        let change = a.transpose() * h * w * a;
        g += aw * g * a.transpose();
        h += change;
        // Rounding must not break the symmetry that the equation has.
        g = (g + g.transpose()) * 0.5;
        h = (h + h.transpose()) * 0.5;
        a = aw * a;
        let (size, moved) = (h.norm(), change.norm());
        if !size.is_finite() {
            return None;
        }
        if moved <= 1e-15 * size {
            return Some(h);
        }
    }
    None
}
