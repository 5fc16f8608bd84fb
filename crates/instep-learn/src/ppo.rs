//! Proximal policy optimisation (Schulman et al., 2017, equation 7) with a Gaussian policy whose deviations do not depend on
//! the state, and a step size that follows the KL divergence (as rsl_rl does it).
//!
//! Knows no robot: it takes samples and gives weights. Policy, deviations and value lie in one flat vector, so does their
//! gradient: a learner on another machine needs nothing else.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::adam::Adam;
use crate::mlp::{Batch, Mlp, Tape};
use crate::settings::{NetworkSettings, PpoSettings};

/// Samples of a gradient that are computed together; the order of the sums, and so every byte, follows from it.
const CHUNK: usize = 512;
/// Entries of a gradient that are summed together.
const SUM: usize = 1 << 13;

/// What environments bring: one column or entry a sample.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// Normalised observations, one after the other.
    pub observations: Vec<f32>,
    /// Actions, one after the other.
    pub actions: Vec<f32>,
    /// Means of the policy that drew the actions, one after the other.
    pub means: Vec<f32>,
    /// Generalised advantages.
    pub advantages: Vec<f32>,
    /// What the value should have been.
    pub returns: Vec<f32>,
}

impl Samples {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.returns.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.returns.is_empty()
    }

    /// Room for `count` samples with observations and actions of these lengths.
    #[must_use]
    pub fn with_capacity(count: usize, observations: usize, actions: usize) -> Self {
        Self {
            observations: Vec::with_capacity(count * observations),
            actions: Vec::with_capacity(count * actions),
            means: Vec::with_capacity(count * actions),
            advantages: Vec::with_capacity(count),
            returns: Vec::with_capacity(count),
        }
    }

    /// Adds other samples behind these.
    pub fn append(&mut self, other: &mut Self) {
        self.observations.append(&mut other.observations);
        self.actions.append(&mut other.actions);
        self.means.append(&mut other.means);
        self.advantages.append(&mut other.advantages);
        self.returns.append(&mut other.returns);
    }
}

/// What an update did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Update {
    /// Mean loss of the policy.
    pub policy_loss: f64,
    /// Mean loss of the value.
    pub value_loss: f64,
    /// Mean KL divergence of a gradient step from the policy that drew the samples.
    pub kl: f64,
    /// Share of samples whose ratio was clipped.
    pub clipped: f64,
    /// Step size at the end.
    pub rate: f64,
    /// Mean deviation of the policy.
    pub sigma: f64,
}

/// The seam between those who collect samples and whoever learns from them.
pub trait Learner: Send {
    /// Policy, logarithms of its deviations, value: what environments need.
    fn weights(&self) -> &Weights;

    /// Learns from `samples`; `seed` decides their order. On a value that is not finite nothing is changed and it is
    /// returned.
    ///
    /// # Errors
    /// The name and value of what was not finite.
    fn update(&mut self, samples: &Samples, seed: u64) -> Result<Update, (String, f64)>;
}

/// Policy and value with their parameters.
#[derive(Debug, Clone)]
pub struct Weights {
    /// From observation to mean action.
    pub actor: Mlp,
    /// From observation to value.
    pub critic: Mlp,
    /// Parameters of the actor, logarithms of the deviations, parameters of the critic.
    pub flat: Vec<f32>,
    /// Number of actions.
    pub actions: usize,
}

impl Weights {
    /// Random weights.
    #[must_use]
    pub fn new(observations: usize, actions: usize, networks: &NetworkSettings, sigma: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let actor = Mlp::new(observations, &networks.actor, actions, networks.activation);
        let critic = Mlp::new(observations, &networks.critic, 1, networks.activation);
        let mut flat = actor.initial(&mut rng);
        flat.extend(std::iter::repeat_n(sigma.ln() as f32, actions));
        flat.extend(critic.initial(&mut rng));
        Self { actor, critic, flat, actions }
    }

    /// The actor's part of the flat vector.
    #[must_use]
    pub fn actor_part(&self) -> std::ops::Range<usize> {
        0..self.actor.parameters()
    }

    /// The part of the deviations.
    #[must_use]
    pub fn sigma_part(&self) -> std::ops::Range<usize> {
        let start = self.actor.parameters();
        start..start + self.actions
    }

    /// The critic's part.
    #[must_use]
    pub fn critic_part(&self) -> std::ops::Range<usize> {
        self.sigma_part().end..self.flat.len()
    }

    /// Standard deviations of the actions.
    #[must_use]
    pub fn sigmas(&self) -> Vec<f32> {
        self.flat[self.sigma_part()].iter().map(|log| log.exp()).collect()
    }
}

/// The learner of this crate.
#[derive(Debug, Clone)]
pub struct Ppo {
    settings: PpoSettings,
    /// What it learned.
    pub weights: Weights,
    /// Optimiser of the policy, with its deviations.
    pub actor_adam: Adam,
    /// Optimiser of the value. The two share nothing: the value learns as fast as it can, whatever the policy may.
    pub critic_adam: Adam,
    /// Step size of the policy.
    pub rate: f64,
    /// Updates still to come in which only the value learns.
    pub warm_up: u64,
}

impl Ppo {
    /// With the weights to start from.
    #[must_use]
    pub fn new(settings: PpoSettings, weights: Weights) -> Self {
        let (actor_adam, critic_adam) = (Adam::new(weights.sigma_part().end), Adam::new(weights.critic_part().len()));
        Self { rate: settings.learning_rate, warm_up: settings.warm_up, settings, weights, actor_adam, critic_adam }
    }

    /// Gradient of the loss over `chosen` samples, and the sums of what an [`Update`] tells.
    fn gradient(&self, samples: &Samples, chosen: &[usize], old_sigmas: &[f32]) -> (Vec<f32>, Sums) {
        let chunks: Vec<_> =
            chosen.par_chunks(CHUNK).map(|chunk| self.chunk_gradient(samples, chunk, old_sigmas)).collect();
        let mut gradient = vec![0.0; self.weights.flat.len()];
        let mut sums = Sums::default();
        chunks.iter().for_each(|(_, told)| sums.add(told));
        let scale = 1.0 / chosen.len() as f32;
        gradient.par_chunks_mut(SUM).enumerate().for_each(|(k, totals)| {
            for (part, _) in &chunks {
                totals.iter_mut().zip(&part[k * SUM..]).for_each(|(total, g)| *total += g);
            }
            totals.iter_mut().for_each(|g| *g *= scale);
        });
        let entropy = self.settings.entropy as f32;
        gradient[self.weights.sigma_part()].iter_mut().for_each(|g| *g -= entropy);
        (gradient, sums)
    }

    fn chunk_gradient(&self, samples: &Samples, chunk: &[usize], old_sigmas: &[f32]) -> (Vec<f32>, Sums) {
        let weights = &self.weights;
        let (n, count) = (weights.actions, chunk.len());
        let width = samples.observations.len() / samples.len();
        let row = |values: &[f32], width: usize, i: usize, k: usize| values[chunk[i] * width + k];
        let mut input = Batch::zeros(width, count);
        for (column, &sample) in input.as_mut_slice().chunks_exact_mut(width).zip(chunk) {
            column.copy_from_slice(&samples.observations[sample * width..][..width]);
        }
        let (mut actor, mut critic) = (Tape::default(), Tape::default());
        weights.actor.forward(&weights.flat[weights.actor_part()], &input, &mut actor);
        weights.critic.forward(&weights.flat[weights.critic_part()], &input, &mut critic);

        let log_sigmas = &weights.flat[weights.sigma_part()];
        let mut gradient = vec![0.0; weights.flat.len()];
        let mut sums = Sums::default();
        let mut mean_slope = Batch::zeros(n, count);
        let mut value_slope = Batch::zeros(1, count);
        let clip = self.settings.clip;
        for i in 0..count {
            let (mut log_ratio, mut kl) = (0.0f64, 0.0f64);
            for k in 0..n {
                let (action, old) = (row(&samples.actions, n, i, k), row(&samples.means, n, i, k));
                let (mean, log, old_sigma) = (actor.output()[(k, i)], log_sigmas[k], old_sigmas[k]);
                let sigma = log.exp();
                let (z, old_z) = ((action - mean) / sigma, (action - old) / old_sigma);
                let log_change = log - old_sigma.ln();
                log_ratio += f64::from(0.5 * (old_z * old_z - z * z) - log_change);
                let shift = mean - old;
                kl += f64::from(log_change + (old_sigma * old_sigma + shift * shift) / (2.0 * sigma * sigma) - 0.5);
            }
            let advantage = f64::from(samples.advantages[chunk[i]]);
            let ratio = log_ratio.exp();
            let (plain, clipped) = (ratio * advantage, ratio.clamp(1.0 - clip, 1.0 + clip) * advantage);
            sums.policy_loss -= plain.min(clipped);
            sums.kl += kl;
            sums.clipped += f64::from((ratio - 1.0).abs() > clip);
            if plain <= clipped {
                let slope = -plain as f32;
                for k in 0..n {
                    let sigma = log_sigmas[k].exp();
                    let z = (row(&samples.actions, n, i, k) - actor.output()[(k, i)]) / sigma;
                    mean_slope[(k, i)] = slope * z / sigma;
                    gradient[weights.sigma_part().start + k] += slope * (z * z - 1.0);
                }
            }
            let error = critic.output()[(0, i)] - samples.returns[chunk[i]];
            sums.value_loss += 0.5 * f64::from(error * error);
            value_slope[(0, i)] = error;
        }
        weights.actor.backward(
            &weights.flat[weights.actor_part()],
            &input,
            &actor,
            &mean_slope,
            &mut gradient[weights.actor_part()],
        );
        weights.critic.backward(
            &weights.flat[weights.critic_part()],
            &input,
            &critic,
            &value_slope,
            &mut gradient[weights.critic_part()],
        );
        (gradient, sums)
    }

    /// Steps along `gradient`, shortened where it is too long; policy and value each on their own, the policy only once
    /// it is warm: a moment that had gathered zeros would make its first steps too long.
    fn step(&mut self, gradient: &mut [f32]) {
        let most = self.settings.gradient as f32;
        let split = self.weights.sigma_part().end;
        let (actor, critic) = self.weights.flat.split_at_mut(split);
        let (actor_gradient, critic_gradient) = gradient.split_at_mut(split);
        for part in [&mut *actor_gradient, &mut *critic_gradient] {
            let length = part.iter().map(|g| g * g).sum::<f32>().sqrt();
            if length > most {
                part.iter_mut().for_each(|g| *g *= most / length);
            }
        }
        self.critic_adam.step(critic, critic_gradient, self.settings.critic_rate as f32);
        if self.warm_up == 0 {
            self.actor_adam.step(actor, actor_gradient, self.rate as f32);
        }
        let [least, greatest] = self.settings.sigma_range.map(|sigma| sigma.ln() as f32);
        let part = self.weights.sigma_part();
        self.weights.flat[part].iter_mut().for_each(|log| *log = log.clamp(least, greatest));
    }

    fn adapt(&mut self, kl: f64) {
        let [least, most] = self.settings.learning_rate_range;
        if kl > 2.0 * self.settings.kl {
            self.rate = (self.rate / 1.5).max(least);
        } else if kl < 0.5 * self.settings.kl && kl > 0.0 {
            self.rate = (self.rate * 1.5).min(most);
        }
    }
}

impl Learner for Ppo {
    fn weights(&self) -> &Weights {
        &self.weights
    }

    fn update(&mut self, samples: &Samples, seed: u64) -> Result<Update, (String, f64)> {
        let inputs = [
            ("an observation", &samples.observations),
            ("an action", &samples.actions),
            ("an advantage", &samples.advantages),
            ("a return", &samples.returns),
        ];
        for (name, values) in inputs {
            if let Some(bad) = values.iter().find(|x| !x.is_finite()) {
                return Err((name.into(), f64::from(*bad)));
            }
        }
        let before = self.clone();
        let old_sigmas = self.weights.sigmas();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut order: Vec<usize> = (0..samples.len()).collect();
        let mut sums = Sums::default();
        let mut taken = 0;
        for _ in 0..self.settings.epochs {
            order.shuffle(&mut rng);
            for chosen in order.chunks(self.settings.minibatch) {
                let (mut gradient, told) = self.gradient(samples, chosen, &old_sigmas);
                if let Some(bad) = gradient.iter().find(|g| !g.is_finite()) {
                    *self = before;
                    return Err(("an entry of the gradient".into(), f64::from(*bad)));
                }
                self.adapt(told.kl / chosen.len() as f64);
                self.step(&mut gradient);
                sums.add(&told);
                taken += chosen.len();
            }
        }
        self.warm_up = self.warm_up.saturating_sub(1);
        let count = taken.max(1) as f64;
        let sigmas = self.weights.sigmas();
        Ok(Update {
            policy_loss: sums.policy_loss / count,
            value_loss: sums.value_loss / count,
            kl: sums.kl / count,
            clipped: sums.clipped / count,
            rate: self.rate,
            sigma: f64::from(sigmas.iter().sum::<f32>()) / sigmas.len().max(1) as f64,
        })
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    policy_loss: f64,
    value_loss: f64,
    kl: f64,
    clipped: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.policy_loss += other.policy_loss;
        self.value_loss += other.value_loss;
        self.kl += other.kl;
        self.clipped += other.clipped;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_distr::StandardNormal;

    fn bandit(seed: u64, threads: usize) -> (Vec<f32>, f32) {
        let settings = PpoSettings { minibatch: 512, learning_rate: 1e-3, ..PpoSettings::default() };
        let networks = NetworkSettings { actor: vec![16], critic: vec![16], ..NetworkSettings::default() };
        let mut ppo = Ppo::new(settings, Weights::new(2, 1, &networks, 0.3, seed));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut tape = Tape::default();
        let mut miss = f32::INFINITY;
        for round in 0..80 {
            let mut samples = Samples::default();
            let input = Batch::from_fn(2, 1024, |_, _| rng.sample(StandardNormal));
            let weights = ppo.weights.clone();
            weights.actor.forward(&weights.flat[weights.actor_part()], &input, &mut tape);
            miss = 0.0;
            for i in 0..1024 {
                let mean = tape.output()[(0, i)];
                let action = mean + weights.sigmas()[0] * rng.sample::<f32, _>(StandardNormal);
                let wanted = input[(0, i)] - 0.5 * input[(1, i)];
                miss += (mean - wanted).abs() / 1024.0;
                samples.observations.extend(input.column(i).iter());
                samples.actions.push(action);
                samples.means.push(mean);
                samples.returns.push(0.0);
                samples.advantages.push(-(action - wanted).powi(2));
            }
            let mean = samples.advantages.iter().sum::<f32>() / 1024.0;
            samples.advantages.iter_mut().for_each(|a| *a -= mean);
            pool.install(|| ppo.update(&samples, round)).unwrap();
        }
        (ppo.weights.flat, miss)
    }

    #[test]
    fn a_policy_learns_the_action_that_pays() {
        let (_, miss) = bandit(1, 2);
        assert!(miss < 0.1, "{miss}");
    }

    #[test]
    fn threads_do_not_change_a_byte() {
        assert_eq!(bandit(5, 1).0, bandit(5, 2).0);
    }

    #[test]
    fn what_is_not_a_number_is_named_and_changes_nothing() {
        let networks = NetworkSettings { actor: vec![4], critic: vec![4], ..NetworkSettings::default() };
        let mut ppo = Ppo::new(PpoSettings::default(), Weights::new(1, 1, &networks, 0.3, 1));
        let before = ppo.weights.flat.clone();
        let samples = Samples {
            observations: vec![0.0, 1.0],
            actions: vec![0.0, 0.1],
            means: vec![0.0, 0.0],
            advantages: vec![1.0, f32::NAN],
            returns: vec![0.0, 0.0],
        };
        let (what, value) = ppo.update(&samples, 1).unwrap_err();
        assert!(what == "an advantage" && value.is_nan());
        assert_eq!(ppo.weights.flat, before);
    }
}
