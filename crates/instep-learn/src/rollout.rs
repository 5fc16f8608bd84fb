//! Environments stepped side by side with frozen weights: each thread runs groups of them, so that the networks work on
//! batches and no thread waits for another within an iteration.

use std::sync::Arc;

use instep_kick::policy::Normalizer;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

use crate::LearnError;
use crate::environment::{Environment, Scene};
use crate::mlp::{Batch, Tape};
use crate::ppo::{Samples, Weights};
use crate::termination::{End, EndTable};

/// Environments of a group.
const GROUP: usize = 32;
/// Policy steps of a bin of [`Starts`].
const BIN: usize = 5;

/// Running mean and variance of the observations, by sums.
#[derive(Debug, Clone, PartialEq)]
pub struct Moments {
    /// Number of observations.
    pub count: f64,
    /// Their sums.
    pub sum: Vec<f64>,
    /// Sums of their squares.
    pub square: Vec<f64>,
}

impl Moments {
    /// Of observations of `len` numbers: as if one of zeros and deviation one had been seen.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self { count: 1.0, sum: vec![0.0; len], square: vec![1.0; len] }
    }

    fn empty(len: usize) -> Self {
        Self { count: 0.0, sum: vec![0.0; len], square: vec![0.0; len] }
    }

    fn add(&mut self, observation: &[f32]) {
        self.count += 1.0;
        for ((sum, square), &x) in self.sum.iter_mut().zip(&mut self.square).zip(observation) {
            *sum += f64::from(x);
            *square += f64::from(x) * f64::from(x);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum.iter_mut().zip(&other.sum).for_each(|(a, b)| *a += b);
        self.square.iter_mut().zip(&other.square).for_each(|(a, b)| *a += b);
    }

    /// As if a million observations had had the mean and the deviation of `normalizer`.
    pub fn restore(&mut self, normalizer: &Normalizer) {
        self.count = 1e6;
        for (i, (&mean, &deviation)) in normalizer.mean.iter().zip(&normalizer.deviation).enumerate() {
            let (mean, deviation) = (f64::from(mean), f64::from(deviation));
            self.sum[i] = mean * self.count;
            self.square[i] = (deviation * deviation + mean * mean) * self.count;
        }
    }

    /// Mean and deviation; a deviation is at least 0.01.
    #[must_use]
    pub fn normalizer(&self) -> Normalizer {
        let mean: Vec<f32> = self.sum.iter().map(|sum| (sum / self.count) as f32).collect();
        let deviation = self
            .sum
            .iter()
            .zip(&self.square)
            .map(|(sum, square)| {
                let mean = sum / self.count;
                (square / self.count - mean * mean).max(1e-4).sqrt() as f32
            })
            .collect();
        Normalizer { mean, deviation }
    }
}

/// Where episodes start: evenly, at the clip's first state, and where they fail.
#[derive(Debug, Clone, PartialEq)]
pub struct Starts {
    /// For each bin of the clip, how often lately an episode failed in it or in the next ones.
    pub failures: Vec<f64>,
    ticks: usize,
    uniform: f64,
    first: f64,
}

impl Starts {
    /// For a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let start = &scene.settings.start;
        let ticks = scene.clip_ticks();
        Self { failures: vec![1.0; ticks.div_ceil(BIN)], ticks, uniform: start.uniform, first: start.first }
    }

    fn draw(&self, rng: &mut ChaCha8Rng) -> usize {
        let which: f64 = rng.random();
        if which < self.first {
            return 0;
        }
        if which < self.first + self.uniform {
            return rng.random_range(0..self.ticks);
        }
        let mut left = rng.random::<f64>() * self.failures.iter().sum::<f64>();
        let bin = self
            .failures
            .iter()
            .position(|failures| {
                left -= failures;
                left <= 0.0
            })
            .unwrap_or(0);
        (bin * BIN + rng.random_range(0..BIN)).min(self.ticks - 1)
    }

    /// Takes in an iteration's failures, by the bin in which they happened; older ones fade. A failure asks for starts up to half
    /// a second before it.
    fn learn(&mut self, failed: &[f64]) {
        let spread = 5;
        let total: f64 = failed.iter().sum::<f64>().max(1.0);
        let mut seen = vec![0.0; self.failures.len()];
        for (bin, count) in failed.iter().enumerate() {
            for back in 0..spread {
                if let Some(place) = bin.checked_sub(back).and_then(|at| seen.get_mut(at)) {
                    *place += count / total;
                }
            }
        }
        for (kept, new) in self.failures.iter_mut().zip(seen) {
            *kept = 0.97 * *kept + 0.03 * new + 1e-4;
        }
    }
}

/// What an iteration's episodes were like.
#[derive(Debug, Clone, Default)]
pub struct Told {
    /// Sum of the rewards of the steps.
    pub reward: f64,
    /// Sum of the mean link errors of the steps, m.
    pub link_error: f64,
    /// Number of steps.
    pub steps: u64,
    /// Sum of the returns (undiscounted) of the episodes that ended.
    pub returns: f64,
    /// Sum of their lengths, in steps.
    pub lengths: u64,
    /// Why they ended.
    pub ends: EndTable,
    failed: Vec<f64>,
}

impl Told {
    fn merge(&mut self, other: &Self) {
        self.reward += other.reward;
        self.link_error += other.link_error;
        self.steps += other.steps;
        self.returns += other.returns;
        self.lengths += other.lengths;
        self.ends.merge(&other.ends);
        self.failed.resize(self.failed.len().max(other.failed.len()), 0.0);
        self.failed.iter_mut().zip(&other.failed).for_each(|(a, b)| *a += b);
    }
}

/// A group of environments with the scratch space of their networks.
#[derive(Debug)]
struct Group {
    environments: Vec<Environment>,
    returns: Vec<f64>,
    running: bool,
}

/// All environments.
#[derive(Debug)]
pub struct Rollout {
    scene: Arc<Scene>,
    groups: Vec<Group>,
    /// Where episodes start.
    pub starts: Starts,
    /// Of the observations so far.
    pub moments: Moments,
}

impl Rollout {
    /// Makes the environments of `scene`; `seed` decides all of their random numbers.
    ///
    /// # Errors
    /// When a world cannot be made.
    pub fn new(scene: &Arc<Scene>, seed: u64) -> Result<Self, LearnError> {
        let count = scene.settings.ppo.environments;
        let environments = (0..count)
            .into_par_iter()
            .map(|index| Environment::new(Arc::clone(scene), seed, index))
            .collect::<Result<Vec<_>, _>>()?;
        let mut groups = Vec::new();
        let mut rest = environments.into_iter();
        loop {
            let environments: Vec<_> = rest.by_ref().take(GROUP).collect();
            if environments.is_empty() {
                break;
            }
            groups.push(Group { returns: vec![0.0; environments.len()], environments, running: false });
        }
        let moments = Moments::new(scene.follower().observation_len());
        Ok(Self { starts: Starts::new(scene), scene: Arc::clone(scene), groups, moments })
    }

    /// One iteration's samples with `weights`, (39) at `threshold` (m).
    ///
    /// # Errors
    /// When a world refuses a start.
    pub fn collect(&mut self, weights: &Weights, threshold: f64) -> Result<(Samples, Told), LearnError> {
        let normalizer = self.moments.normalizer();
        let (scene, starts) = (&self.scene, &self.starts);
        let parts = self
            .groups
            .par_iter_mut()
            .map(|group| group.collect(scene, starts, weights, &normalizer, threshold))
            .collect::<Result<Vec<_>, _>>()?;
        let count = parts.iter().map(|(part, _, _)| part.len()).sum();
        let mut samples = Samples::with_capacity(count, normalizer.mean.len(), weights.actions);
        let mut told = Told::default();
        for (mut part, part_told, part_moments) in parts {
            samples.append(&mut part);
            told.merge(&part_told);
            self.moments.merge(&part_moments);
        }
        self.starts.learn(&told.failed);
        let count = samples.len().max(1) as f32;
        let mean = samples.advantages.iter().sum::<f32>() / count;
        let variance = samples.advantages.iter().map(|a| (a - mean) * (a - mean)).sum::<f32>() / count;
        let deviation = variance.sqrt().max(1e-6);
        samples.advantages.iter_mut().for_each(|a| *a = (*a - mean) / deviation);
        Ok((samples, told))
    }
}

/// One environment's steps of an iteration.
#[derive(Debug, Clone, Default)]
struct Line {
    rewards: Vec<f64>,
    values: Vec<f64>,
    /// Value of the state after an episode's end or after the last step; zero where a fall or (39) ended it.
    after: Vec<Option<f64>>,
}

impl Group {
    fn collect(
        &mut self,
        scene: &Scene,
        starts: &Starts,
        weights: &Weights,
        normalizer: &Normalizer,
        threshold: f64,
    ) -> Result<(Samples, Told, Moments), LearnError> {
        if !self.running {
            for environment in &mut self.environments {
                let tick = starts.draw(environment.rng());
                environment.start(tick)?;
            }
            self.running = true;
        }
        let ppo = &scene.settings.ppo;
        let (count, n) = (self.environments.len(), weights.actions);
        let width = normalizer.mean.len();
        let mut told = Told { failed: vec![0.0; starts.failures.len()], ..Told::default() };
        let mut moments = Moments::empty(width);
        let sigmas = weights.sigmas();
        let mut input = Batch::zeros(width, count);
        let (mut actor, mut critic) = (Tape::default(), Tape::default());
        let mut lines = vec![Line::default(); count];
        let mut rows: Vec<Samples> = (0..count).map(|_| Samples::with_capacity(ppo.horizon, width, n)).collect();
        let scale = 1.0 - ppo.gamma;
        for _ in 0..ppo.horizon {
            for (i, environment) in self.environments.iter().enumerate() {
                let mut column = input.column_mut(i);
                let column = column.as_mut_slice();
                column.copy_from_slice(environment.observation());
                moments.add(column);
                normalizer.apply(column);
            }
            weights.actor.forward(&weights.flat[weights.actor_part()], &input, &mut actor);
            weights.critic.forward(&weights.flat[weights.critic_part()], &input, &mut critic);
            for (i, environment) in self.environments.iter_mut().enumerate() {
                let (line, row) = (&mut lines[i], &mut rows[i]);
                line.values.push(f64::from(critic.output()[(0, i)]));
                row.observations.extend_from_slice(input.column(i).as_slice());
                let mean = actor.output().column(i);
                row.means.extend(mean.iter());
                let at = row.actions.len();
                for (mean, sigma) in mean.iter().zip(&sigmas) {
                    row.actions.push(mean + sigma * environment.rng().sample::<f32, _>(StandardNormal));
                }
                let step = environment.step(&row.actions[at..at + n], threshold);
                told.steps += 1;
                told.reward += step.reward;
                told.link_error += step.deviation.links;
                self.returns[i] += step.reward;
                line.rewards.push(step.reward * scale);
                line.after.push(None);
                let Some(end) = step.end else { continue };
                // The clip's end is an end of the time only: the stand would go on.
                let after = if end == End::Completed {
                    value(weights, normalizer, environment.observation())
                } else {
                    let tick = environment.tick().min(scene.clip_ticks() - 1);
                    told.failed[tick / BIN] += 1.0;
                    0.0
                };
                if let Some(last) = line.after.last_mut() {
                    *last = Some(after);
                }
                told.ends.add(end, scene.part(environment.tick()));
                told.returns += self.returns[i];
                told.lengths += (environment.tick() - environment.started()) as u64;
                self.returns[i] = 0.0;
                let tick = starts.draw(environment.rng());
                environment.start(tick)?;
            }
        }
        for (line, environment) in lines.iter_mut().zip(&self.environments) {
            if let Some(last) = line.after.last_mut().filter(|last| last.is_none()) {
                *last = Some(value(weights, normalizer, environment.observation()));
            }
        }
        let mut samples = Samples::with_capacity(count * ppo.horizon, width, n);
        for (mut row, line) in rows.into_iter().zip(&lines) {
            line.advantages(ppo.gamma, ppo.lambda, &mut row);
            samples.append(&mut row);
        }
        Ok((samples, told, moments))
    }
}

/// Value of one observation.
fn value(weights: &Weights, normalizer: &Normalizer, observation: &[f32]) -> f64 {
    let mut input = Batch::from_column_slice(observation.len(), 1, observation);
    normalizer.apply(input.as_mut_slice());
    let mut tape = Tape::default();
    weights.critic.forward(&weights.flat[weights.critic_part()], &input, &mut tape);
    f64::from(tape.output()[(0, 0)])
}

impl Line {
    /// Generalised advantages (Schulman et al., 2016, equation 16) and returns.
    fn advantages(&self, gamma: f64, lambda: f64, samples: &mut Samples) {
        let count = self.rewards.len();
        let mut advantages = vec![0.0; count];
        let (mut next_value, mut next_advantage) = (0.0, 0.0);
        for t in (0..count).rev() {
            if let Some(after) = self.after[t] {
                (next_value, next_advantage) = (after, 0.0);
            }
            let delta = self.rewards[t] + gamma * next_value - self.values[t];
            next_advantage = delta + gamma * lambda * next_advantage;
            advantages[t] = next_advantage;
            next_value = self.values[t];
        }
        samples.returns.extend(advantages.iter().zip(&self.values).map(|(a, v)| (a + v) as f32));
        samples.advantages.extend(advantages.iter().map(|&a| a as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advantages_are_those_of_the_definition() {
        let line = Line {
            rewards: vec![1.0, 2.0, 3.0, 4.0],
            values: vec![0.5, 0.25, -1.0, 2.0],
            after: vec![None, Some(0.0), None, Some(7.0)],
        };
        let (gamma, lambda) = (0.9, 0.8);
        let mut samples = Samples::default();
        line.advantages(gamma, lambda, &mut samples);
        let d = [1.0 + 0.9 * 0.25 - 0.5, 2.0 - 0.25, 3.0 + 0.9 * 2.0 + 1.0, 4.0 + 0.9 * 7.0 - 2.0];
        let expected = [d[0] + 0.72 * d[1], d[1], d[2] + 0.72 * d[3], d[3]];
        for (a, b) in samples.advantages.iter().zip(expected) {
            assert!((f64::from(*a) - b).abs() < 1e-5, "{a} {b}");
        }
        assert!((samples.returns[1] - 2.0).abs() < 1e-6);
    }

    #[test]
    fn moments_give_mean_and_deviation() {
        let mut moments = Moments::empty(1);
        [1.0f32, 3.0, 5.0, 7.0].iter().for_each(|&x| moments.add(&[x]));
        let normalizer = moments.normalizer();
        assert!((normalizer.mean[0] - 4.0).abs() < 1e-6);
        assert!((normalizer.deviation[0] - 5.0f32.sqrt()).abs() < 1e-5);
    }
}
