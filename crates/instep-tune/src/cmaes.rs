//! CMA-ES: minimises a function of a few real numbers that is not smooth and not exact, from samples alone.
//!
//! Source: Hansen, The CMA evolution strategy: a tutorial (arXiv 1604.00772), its summary of section A and table 1, with
//! active (negative) recombination weights; equation numbers stand beside the lines. The search has one length scale for
//! all coordinates: the caller scales them alike. It has no bounds (see [`crate::space`]), no restarts, and does not
//! average noise: the caller evaluates a sample often enough.
//!
//! State and samples are plain values: the samples of a generation depend on the state, the seed and the generation's
//! number only, so a run goes on from a stored state as if it had never been stopped.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// The search distribution and its paths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cma {
    /// Mean m.
    pub mean: DVector<f64>,
    /// Step size sigma.
    pub sigma: f64,
    /// Covariance C.
    pub covariance: DMatrix<f64>,
    /// Evolution path p_c.
    path: DVector<f64>,
    /// Conjugate evolution path p_sigma.
    conjugate: DVector<f64>,
    /// Generations so far.
    pub generation: usize,
    /// Samples in a generation, lambda.
    pub population: usize,
    seed: u64,
}

/// The constants of table 1.
struct Constants {
    /// All lambda weights, (53).
    weights: Vec<f64>,
    /// How many of them recombine into the mean.
    mu: usize,
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// Expectation of the length of a standard normal vector.
    chi: f64,
}

/// The population that table 1 recommends for `n` coordinates, (48).
#[must_use]
pub fn default_population(n: usize) -> usize {
    4 + (3.0 * (n as f64).ln()).floor() as usize
}

impl Constants {
    fn new(n: usize, lambda: usize) -> Self {
        let dim = n as f64;
        let mu = lambda / 2;
        // (49)
        let raw: Vec<f64> = (1..=lambda).map(|i| ((lambda as f64 + 1.0) / 2.0).ln() - (i as f64).ln()).collect();
        let effective = |w: &[f64]| w.iter().sum::<f64>().powi(2) / w.iter().map(|w| w * w).sum::<f64>();
        let mu_eff = effective(&raw[..mu]);
        let mu_eff_negative = effective(&raw[mu..]);
        // (55) to (58), with alpha_cov = 2 and c_m = 1.
        let c_sigma = (mu_eff + 2.0) / (dim + mu_eff + 5.0);
        let d_sigma = 1.0 + 2.0 * (((mu_eff - 1.0) / (dim + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_c = (4.0 + mu_eff / dim) / (dim + 4.0 + 2.0 * mu_eff / dim);
        let c_1 = 2.0 / ((dim + 1.3).powi(2) + mu_eff);
        let c_mu = (2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((dim + 2.0).powi(2) + mu_eff)).min(1.0 - c_1);
        // (50) to (53)
        let alpha = (1.0 + c_1 / c_mu)
            .min(1.0 + 2.0 * mu_eff_negative / (mu_eff + 2.0))
            .min((1.0 - c_1 - c_mu) / (dim * c_mu))
            .max(0.0);
        let positive: f64 = raw.iter().filter(|w| **w > 0.0).sum();
        let negative: f64 = -raw.iter().filter(|w| **w < 0.0).sum::<f64>();
        let weights = raw.iter().map(|w| if *w >= 0.0 { w / positive } else { alpha * w / negative }).collect();
        let chi = dim.sqrt() * (1.0 - 1.0 / (4.0 * dim) + 1.0 / (21.0 * dim * dim));
        Self { weights, mu, mu_eff, c_sigma, d_sigma, c_c, c_1, c_mu, chi }
    }
}

impl Cma {
    /// Starts at `mean` with the step `sigma` and `population` samples in a generation (at least 4).
    #[must_use]
    pub fn new(mean: Vec<f64>, sigma: f64, population: usize, seed: u64) -> Self {
        let n = mean.len();
        Self {
            mean: DVector::from_vec(mean),
            sigma,
            covariance: DMatrix::identity(n, n),
            path: DVector::zeros(n),
            conjugate: DVector::zeros(n),
            generation: 0,
            population: population.max(4),
            seed,
        }
    }

    /// B and the diagonal of D of C = B D^2 B^T.
    fn eigen(&self) -> (DMatrix<f64>, DVector<f64>) {
        let eigen = SymmetricEigen::new(self.covariance.clone());
        // Rounding can leave a small value below zero.
        (eigen.eigenvectors, eigen.eigenvalues.map(|value| value.max(1e-20).sqrt()))
    }

    /// The samples of this generation, (38) to (40).
    #[must_use]
    pub fn ask(&self) -> Vec<DVector<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.generation as u64);
        let (b, d) = self.eigen();
        (0..self.population)
            .map(|_| {
                let z = DVector::from_fn(self.mean.len(), |_, _| StandardNormal.sample(&mut rng));
                &self.mean + &b * d.component_mul(&z) * self.sigma
            })
            .collect()
    }

    /// Takes the cost of each of the samples of [`Cma::ask`], in their order; lower is better, and what is not a number is
    /// worst.
    pub fn tell(&mut self, samples: &[DVector<f64>], costs: &[f64]) {
        let n = self.mean.len();
        let k = Constants::new(n, self.population);
        let (b, d) = self.eigen();
        let inverse_root = &b * DMatrix::from_diagonal(&d.map(|d| 1.0 / d)) * b.transpose();
        let rank = |i: &usize| if costs[*i].is_nan() { f64::INFINITY } else { costs[*i] };
        let mut order: Vec<usize> = (0..samples.len()).collect();
        order.sort_by(|i, j| rank(i).total_cmp(&rank(j)));
        let steps: Vec<DVector<f64>> = order.iter().map(|&i| (&samples[i] - &self.mean) / self.sigma).collect();

        // (41) and (42)
        let mean_step: DVector<f64> =
            steps.iter().zip(&k.weights).take(k.mu).map(|(y, w)| y * *w).fold(DVector::zeros(n), |sum, y| sum + y);
        self.mean += &mean_step * self.sigma;
        // (43) and (44)
        self.conjugate = &self.conjugate * (1.0 - k.c_sigma)
            + &inverse_root * &mean_step * (k.c_sigma * (2.0 - k.c_sigma) * k.mu_eff).sqrt();
        let length = self.conjugate.norm();
        self.sigma *= ((k.c_sigma / k.d_sigma) * (length / k.chi - 1.0)).exp();
        // (45), with the stall of the path while the step size grows fast.
        let settled = (1.0 - (1.0 - k.c_sigma).powi(2 * (self.generation as i32 + 1))).sqrt();
        let goes = if length / settled < (1.4 + 2.0 / (n as f64 + 1.0)) * k.chi { 1.0 } else { 0.0 };
        self.path = &self.path * (1.0 - k.c_c) + &mean_step * (goes * (k.c_c * (2.0 - k.c_c) * k.mu_eff).sqrt());
        // (46) and (47)
        let stalled = (1.0 - goes) * k.c_c * (2.0 - k.c_c);
        let total: f64 = k.weights.iter().sum();
        self.covariance *= 1.0 + k.c_1 * stalled - k.c_1 - k.c_mu * total;
        self.covariance += &self.path * self.path.transpose() * k.c_1;
        for (y, w) in steps.iter().zip(&k.weights) {
            let w = if *w >= 0.0 { *w } else { w * n as f64 / (&inverse_root * y).norm_squared().max(1e-300) };
            self.covariance += y * y.transpose() * (k.c_mu * w);
        }
        self.covariance = (&self.covariance + self.covariance.transpose()) * 0.5;
        self.generation += 1;
    }

    /// Standard deviation of each coordinate.
    #[must_use]
    pub fn spread(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|c| self.sigma * c.max(0.0).sqrt()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn minimise(f: impl Fn(&DVector<f64>) -> f64, mut cma: Cma, goal: f64, most: usize) -> usize {
        for evaluated in 1..=most / cma.population {
            let samples = cma.ask();
            let costs: Vec<f64> = samples.iter().map(&f).collect();
            cma.tell(&samples, &costs);
            if f(&cma.mean) < goal {
                return evaluated * cma.population;
            }
        }
        panic!("{} after {most} evaluations", f(&cma.mean));
    }

    fn rosenbrock(x: &DVector<f64>) -> f64 {
        (1..x.len()).map(|i| 100.0 * (x[i] - x[i - 1].powi(2)).powi(2) + (1.0 - x[i - 1]).powi(2)).sum()
    }

    #[test]
    fn rosenbrock_in_ten_dimensions() {
        let used = minimise(rosenbrock, Cma::new(vec![0.0; 10], 0.5, default_population(10), 1), 1e-10, 12_000);
        // An independent implementation needed 5.1 to 6.1 thousand (facts/solvers.md).
        assert!(used < 9_000, "{used}");
    }

    #[test]
    fn a_rotated_ellipsoid_with_a_million_to_one() {
        // Rotated by Householder's reflection, so that no axis is an eigenvector.
        let n = 6;
        let v = DVector::from_fn(n, |i, _| 1.0 + i as f64).normalize();
        let turn = DMatrix::identity(n, n) - &v * v.transpose() * 2.0;
        let f = |x: &DVector<f64>| {
            let y = &turn * x;
            (0..n).map(|i| 1e6_f64.powf(i as f64 / (n as f64 - 1.0)) * y[i] * y[i]).sum()
        };
        minimise(f, Cma::new(vec![1.0; n], 0.5, default_population(n), 3), 1e-9, 8_000);
    }

    #[test]
    fn what_is_not_a_number_is_worst() {
        let f = |x: &DVector<f64>| if x[0] < 0.0 { f64::NAN } else { x.norm_squared() };
        let mut cma = Cma::new(vec![1.0, 1.0], 0.3, 8, 5);
        for _ in 0..60 {
            let samples = cma.ask();
            let costs: Vec<f64> = samples.iter().map(f).collect();
            cma.tell(&samples, &costs);
        }
        assert!(cma.mean.norm() < 0.05 && cma.mean.iter().all(|x| x.is_finite()), "{}", cma.mean);
    }

    #[test]
    fn a_stored_state_goes_on_as_if_never_stopped() {
        let mut cma = Cma::new(vec![0.5; 3], 0.3, 7, 11);
        for generation in 0..12 {
            let samples = cma.ask();
            let costs: Vec<f64> = samples.iter().map(rosenbrock).collect();
            cma.tell(&samples, &costs);
            if generation == 5 {
                let text = serde_json::to_string(&cma).unwrap();
                let again: Cma = serde_json::from_str(&text).unwrap();
                assert_eq!(again, cma);
                assert_eq!(again.ask(), cma.ask());
            }
        }
    }
}
