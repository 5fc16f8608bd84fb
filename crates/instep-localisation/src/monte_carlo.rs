//! Monte Carlo localisation: many poses, each moved by the odometry with noise of its own and weighed by the sights.
//!
//! Source: Thrun, Burgard, Fox, Probabilistic Robotics (2005), 8.3; low-variance resampling 4.2.4. As teams run it with
//! 150 to 300 particles. The likelihood is tempered: errors of successive frames are alike, and an exponent of 0.3
//! measured 10 to 15 % better. No injection of fresh particles: it turned healthy filters over.

use std::sync::Arc;

use instep_field::{Pose, wrap};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::kalman::{begin, step_variance};
use crate::localiser::{Method, Start};
use crate::map::Map;
use crate::measurement::{Expected, Polar};
use crate::window::nearest_first;
use crate::{Frame, Settings};

/// Particles.
const PARTICLES: usize = 200;
/// Exponent of the likelihood.
const TEMPER: f64 = 0.3;
/// Share of sights that come from nowhere: the floor of a sight's likelihood against that of a perfect one.
const FALSE_SHARE: f64 = 0.02;

/// Monte Carlo localisation.
#[derive(Debug, Clone)]
pub struct MonteCarlo {
    map: Arc<Map>,
    settings: Settings,
    particles: Vec<Pose>,
    drawn: Vec<Pose>,
    weights: Vec<f64>,
    sights: Vec<Polar>,
    rng: ChaCha8Rng,
}

impl MonteCarlo {
    /// A method that has not been started; all its chance comes from `seed`.
    pub fn new(map: Arc<Map>, settings: Settings, seed: u64) -> MonteCarlo {
        MonteCarlo {
            map,
            settings,
            particles: vec![Pose::default(); PARTICLES],
            drawn: Vec::with_capacity(PARTICLES),
            weights: vec![1.0 / PARTICLES as f64; PARTICLES],
            sights: Vec::with_capacity(64),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn scattered(&mut self, pose: &Pose, sigmas: [f64; 3]) -> Pose {
        let [x, y, heading] = sigmas.map(|s| {
            let draw: f64 = StandardNormal.sample(&mut self.rng);
            s * draw
        });
        Pose::new(pose.x + x, pose.y + y, pose.heading + heading)
    }

    /// Low-variance resampling.
    fn resample(&mut self) {
        let share = 1.0 / PARTICLES as f64;
        let mut at = share * self.rng.random::<f64>();
        let (mut sum, mut k) = (self.weights[0], 0);
        self.drawn.clear();
        for _ in 0..PARTICLES {
            while at > sum && k + 1 < PARTICLES {
                k += 1;
                sum += self.weights[k];
            }
            self.drawn.push(self.particles[k]);
            at += share;
        }
        std::mem::swap(&mut self.particles, &mut self.drawn);
        self.weights.fill(share);
    }

    /// Mean of the weighted particles, headings as directions.
    fn mean(&self) -> Pose {
        let mut sum = [0.0; 4];
        for (p, w) in self.particles.iter().zip(&self.weights) {
            let (s, c) = p.heading.sin_cos();
            sum = [sum[0] + w * p.x, sum[1] + w * p.y, sum[2] + w * c, sum[3] + w * s];
        }
        Pose::new(sum[0], sum[1], sum[3].atan2(sum[2]))
    }
}

impl Method for MonteCarlo {
    fn name(&self) -> &'static str {
        "Monte Carlo"
    }

    fn start(&mut self, start: Start) {
        let [length, width] = self.map.half();
        let (pose, covariance) = begin(&self.map, start);
        for k in 0..PARTICLES {
            self.particles[k] = match start {
                Start::Near { .. } => {
                    let sigma = |i: usize| covariance[(i, i)].sqrt();
                    self.scattered(&pose, [sigma(0), sigma(1), sigma(2)])
                }
                Start::OwnHalf | Start::Anywhere => {
                    let [a, b, c]: [f64; 3] = std::array::from_fn(|_| self.rng.random::<f64>());
                    let x = if start == Start::OwnHalf { -length * a } else { length * (2.0 * a - 1.0) };
                    Pose::new(x, width * (2.0 * b - 1.0), std::f64::consts::TAU * c)
                }
            };
        }
        self.weights.fill(1.0 / PARTICLES as f64);
    }

    fn predict(&mut self, motion: &Pose, dt: f64) {
        let sigmas: [f64; 3] = step_variance(&self.settings.odometry, motion, dt).map(f64::sqrt).into();
        for k in 0..PARTICLES {
            let step = self.scattered(motion, sigmas);
            self.particles[k] = self.particles[k].then(&step);
        }
    }

    fn update(&mut self, frame: &Frame) {
        nearest_first(&frame.landmarks, &self.settings.noise, self.settings.filter.most_sights, &mut self.sights);
        let mut sum = 0.0;
        for (particle, weight) in self.particles.iter().zip(&mut self.weights) {
            for sight in &self.sights {
                let at = particle.outer_from_local(sight.point(1.0));
                let square = self.map.nearest(sight.class, at).map_or(f64::INFINITY, |landmark| {
                    let expected = Expected::of(particle, landmark);
                    ((sight.range - expected.range) / sight.range_sigma).powi(2)
                        + (wrap(sight.bearing - expected.bearing) / sight.bearing_sigma).powi(2)
                });
                *weight *= (FALSE_SHARE + (-0.5 * square).exp()).powf(TEMPER);
            }
            sum += *weight;
        }
        // All weights can vanish only when every sight is far from every landmark; then the frame says nothing.
        if !(sum > 1e-300) {
            self.weights.fill(1.0 / PARTICLES as f64);
            return;
        }
        self.weights.iter_mut().for_each(|w| *w /= sum);
        let effective = 1.0 / self.weights.iter().map(|w| w * w).sum::<f64>();
        if effective < PARTICLES as f64 / 2.0 {
            self.resample();
        }
    }

    fn pose(&self) -> Pose {
        self.mean()
    }

    fn covariance(&self) -> Option<Matrix3<f64>> {
        let mean = self.mean();
        let mut sum = Matrix3::zeros();
        for (p, w) in self.particles.iter().zip(&self.weights) {
            let d = Vector3::new(p.x - mean.x, p.y - mean.y, wrap(p.heading - mean.heading));
            sum += *w * d * d.transpose();
        }
        Some(sum)
    }
}
