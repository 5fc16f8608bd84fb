//! The training loop: collect, learn, tighten the threshold, tell; and the policy that comes out.

use std::sync::Arc;

use instep_kick::policy::{Network, Policy, PolicyHeader};
use instep_motion::reference::Reference;
use instep_robot::Robot;
use serde::{Deserialize, Serialize};

use crate::LearnError;
use crate::environment::Scene;
use crate::ppo::{Learner, Ppo, Update, Weights};
use crate::rollout::{Rollout, Told};
use crate::settings::LearnSettings;
use crate::termination::{EndTable, threshold};

/// How fast the survival that the threshold waits for follows the episodes.
const SURVIVAL_GAIN: f64 = 0.1;

/// One line of the training's curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Iterations so far.
    pub iteration: u64,
    /// Control steps so far.
    pub steps: u64,
    /// Mean reward of a step.
    pub reward: f64,
    /// Mean return of the episodes that ended, undiscounted; `None` when none did.
    pub episode_return: Option<f64>,
    /// Their mean length, s.
    pub episode_length: Option<f64>,
    /// Mean link error of the steps, m.
    pub link_error: f64,
    /// Share of the episodes that reached their end, smoothed.
    pub survival: f64,
    /// d of (39), m.
    pub threshold: f64,
    /// KL divergence of the update.
    pub kl: f64,
    /// Step size.
    pub rate: f64,
    /// Mean deviation of the actions.
    pub sigma: f64,
    /// Loss of the value.
    pub value_loss: f64,
}

/// What a training remembers beside its weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// File name of the reference.
    pub reference: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Control steps to take.
    pub budget: u64,
    /// Control steps taken.
    pub steps: u64,
    /// Iterations done.
    pub iteration: u64,
    /// t of (40) as a share of the budget.
    pub clock: f64,
    /// Smoothed share of episodes that reach their end.
    pub survival: f64,
    /// The curve.
    pub curve: Vec<Progress>,
}

/// A training under way.
#[derive(Debug)]
pub struct Training {
    /// What is trained on.
    pub scene: Arc<Scene>,
    /// The learner.
    pub ppo: Ppo,
    /// The environments.
    pub rollout: Rollout,
    /// All the rest.
    pub state: State,
    /// Why episodes ended since the last time somebody asked.
    pub ends: EndTable,
    reference: Arc<Reference>,
}

impl Training {
    /// A new training of `robot` on `reference` (called `name`) for `budget` control steps; from `policy`, where there is one.
    ///
    /// # Errors
    /// When a setting cannot be, or robot, reference and policy do not fit.
    pub fn new(
        robot: Arc<Robot>,
        reference: Arc<Reference>,
        name: &str,
        settings: LearnSettings,
        seed: u64,
        budget: u64,
        policy: Option<&Policy>,
    ) -> Result<Self, LearnError> {
        let scene = Arc::new(Scene::new(robot, Arc::clone(&reference), settings)?);
        let settings = &scene.settings;
        let (inputs, outputs) = (scene.follower().observation_len(), scene.follower().action_len());
        let mut weights = Weights::new(inputs, outputs, &settings.network, settings.ppo.sigma, seed);
        let mut rollout = Rollout::new(&scene, seed)?;
        if let Some(policy) = policy {
            let fits = policy.network.inputs() == inputs && policy.network.activation == settings.network.activation;
            let Some(actor) = weights.actor.import(&policy.network.layers).filter(|_| fits) else {
                return Err(LearnError::Setting {
                    field: "network.actor".into(),
                    found: format!("{:?} for {inputs} inputs", settings.network.actor),
                    expected: "the layers of the policy to go on from".into(),
                });
            };
            let part = weights.actor_part();
            weights.flat[part].copy_from_slice(&actor);
            rollout.moments.restore(&policy.network.normalizer);
        }
        let ppo = Ppo::new(settings.ppo.clone(), weights);
        let state = State {
            reference: name.into(),
            seed,
            budget,
            steps: 0,
            iteration: 0,
            clock: 0.0,
            survival: 0.0,
            curve: Vec::new(),
        };
        Ok(Self { scene, ppo, rollout, state, ends: EndTable::default(), reference })
    }

    /// Whether the budget is used up.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.state.steps >= self.state.budget
    }

    /// d of (39) now, m.
    #[must_use]
    pub fn threshold(&self) -> f64 {
        threshold(&self.scene.settings.termination, self.state.clock)
    }

    /// One iteration.
    ///
    /// # Errors
    /// [`LearnError::NotFinite`] when something is no number: the training is then as it was before the iteration.
    pub fn iterate(&mut self) -> Result<Progress, LearnError> {
        let threshold = self.threshold();
        let (samples, told) = self.rollout.collect(self.ppo.weights(), threshold)?;
        let order = self.state.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(self.state.iteration);
        let update = self.ppo.update(&samples, order).map_err(|(what, value)| LearnError::NotFinite {
            what,
            value,
            steps: self.state.steps,
        })?;
        Ok(self.note(&told, &update, threshold))
    }

    fn note(&mut self, told: &Told, update: &Update, threshold: f64) -> Progress {
        let state = &mut self.state;
        let termination = &self.scene.settings.termination;
        state.steps += told.steps;
        state.iteration += 1;
        if told.ends.total() > 0 {
            state.survival += SURVIVAL_GAIN * (told.ends.survival() - state.survival);
        }
        if state.survival >= termination.survival || state.clock < termination.t_start {
            state.clock += told.steps as f64 / state.budget as f64;
        }
        self.ends.merge(&told.ends);
        let episodes = told.ends.total() as f64;
        let per_episode = |sum: f64| (episodes > 0.0).then(|| sum / episodes);
        let progress = Progress {
            iteration: state.iteration,
            steps: state.steps,
            reward: told.reward / told.steps.max(1) as f64,
            episode_return: per_episode(told.returns),
            episode_length: per_episode(told.lengths as f64 * self.scene.settings.follower.period),
            link_error: told.link_error / told.steps.max(1) as f64,
            survival: state.survival,
            threshold,
            kl: update.kl,
            rate: update.rate,
            sigma: update.sigma,
            value_loss: update.value_loss,
        };
        state.curve.push(progress);
        progress
    }

    /// The policy as it is now.
    #[must_use]
    pub fn policy(&self) -> Policy {
        let weights = &self.ppo.weights;
        let follower = self.scene.follower();
        // Nobody who runs the policy asks for the ground's forces: they would be a quarter of its file.
        let mut reference = (*self.reference).clone();
        reference.knots.iter_mut().for_each(|knot| knot.forces.clear());
        let layers = weights.actor.export(&weights.flat[weights.actor_part()]);
        let activation = self.scene.settings.network.activation;
        Policy {
            header: PolicyHeader {
                format: PolicyHeader::FORMAT,
                robot: self.scene.robot.name.clone(),
                reference: self.state.reference.clone(),
                window: follower.track().window(),
                follower: follower.settings().clone(),
                activation,
                steps: self.state.steps,
            },
            reference: Arc::new(reference),
            network: Network::new(self.rollout.moments.normalizer(), layers, activation),
        }
    }
}
