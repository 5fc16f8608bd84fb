//! Every number of the training, with the paper's symbol where it has one. TOML; what is absent keeps its default;
//! `validate` refuses what cannot be.

use instep_kick::policy::{Activation, FollowerSettings};
use instep_robot::Robot;
use instep_sim::settings::Fidelity;
use instep_sim::start::StartErrors;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::LearnError;

/// All settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct LearnSettings {
    /// The part of the reference to follow.
    pub clip: ClipSettings,
    /// Observation and action.
    pub follower: FollowerSettings,
    /// Rewards.
    pub reward: RewardSettings,
    /// Early termination.
    pub termination: TerminationSettings,
    /// Where episodes start.
    pub start: StartSettings,
    /// The optimiser.
    pub ppo: PpoSettings,
    /// The networks.
    pub network: NetworkSettings,
    /// The worlds.
    pub world: WorldSettings,
}

/// The part of the reference to follow, s in the reference's time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ClipSettings {
    /// Where it starts; the reference's start when absent. The first knots of an optimised reference carry speeds that
    /// nothing before them explains.
    pub from: Option<f64>,
    /// Where it ends and the stand begins; the reference's end when absent.
    pub to: Option<f64>,
}

/// Rewards of a step, each divided by the sum of the tracking weights so that perfect tracking gives 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RewardSettings {
    /// w_k of (35): key points.
    pub w_k: f64,
    /// k_k of (35), 1/m, below zero; the distances are summed over the key points.
    pub k_k: f64,
    /// w_q of (36): joint angles.
    pub w_q: f64,
    /// k_q of (36), 1/rad, below zero.
    pub k_q: f64,
    /// w_v of (36): joint speeds.
    pub w_v: f64,
    /// k_v of (36), s/rad, below zero.
    pub k_v: f64,
    /// w_c of (37): centre of mass.
    pub w_c: f64,
    /// k_c of (37), 1/m, below zero.
    pub k_c: f64,
    /// Penalty on the mean square of the change of the action; not in the paper, zero turns it off.
    pub w_rate: f64,
    /// Penalty on the mean square of the action; not in the paper, zero turns it off.
    pub w_action: f64,
    /// Penalty on joint speeds close to their limits, which a landing can drive past what the motor gives; not in the paper,
    /// zero turns it off.
    pub w_limit: f64,
    /// Share of its limit beyond which a joint's speed is penalised.
    pub limit_from: f64,
    /// w_ball of (38), once, as the ball leaves; zero while only tracking. The paper pays it at every step after the kick: by
    /// then nothing can be done for it, no observation tells it, and it is noise in the advantage of every later step.
    pub w_ball: f64,
    /// Speed that the exponent of (38) is divided by, m/s. The paper has 1, which at 11 m/s is e^11 a step.
    pub ball_scale: f64,
    /// Ball speed from which (38) no longer grows, m/s.
    pub ball_cap: f64,
    /// What is taken off the ball's speed for each m/s across the wanted direction. The paper has 0.
    pub ball_across: f64,
}

impl Default for RewardSettings {
    fn default() -> Self {
        Self {
            w_k: 0.4,
            k_k: -1.5,
            w_q: 0.2,
            k_q: -1.0,
            w_v: 0.1,
            k_v: -0.1,
            w_c: 0.3,
            k_c: -8.0,
            w_rate: 0.02,
            w_action: 0.005,
            w_limit: 1.0,
            limit_from: 0.95,
            w_ball: 0.0,
            ball_scale: 10.0,
            ball_cap: 16.0,
            ball_across: 2.0,
        }
    }
}

/// Reference-guided early termination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TerminationSettings {
    /// Whether an episode ends early, by (39) or a fall. Without, it goes on to the clip's end whatever happens, and the
    /// reward alone must tell: what the paper compares with.
    pub ret: bool,
    /// d_max of (40), m.
    pub d_max: f64,
    /// d_min of (40), m; equal to `d_max` for a fixed threshold.
    pub d_min: f64,
    /// t_start of (40) as a share of the budget.
    pub t_start: f64,
    /// t_end of (40) as a share of the budget.
    pub t_end: f64,
    /// n of (40): number of stairs.
    pub n: usize,
    /// gamma of (40): how sharp the stairs are.
    pub gamma: f64,
    /// The threshold waits while fewer episodes than this share survive; 0 lets it fall by time alone, as in the paper.
    pub survival: f64,
}

impl Default for TerminationSettings {
    fn default() -> Self {
        Self { ret: true, d_max: 0.3, d_min: 0.15, t_start: 0.2, t_end: 0.9, n: 4, gamma: 10.0, survival: 0.8 }
    }
}

/// Where episodes start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartSettings {
    /// Share of starts that are spread evenly over the clip; the others go where episodes fail.
    pub uniform: f64,
    /// Share of starts at the clip's first state.
    pub first: f64,
    /// Standard deviation of each joint's angle at the start, rad.
    pub joint: f64,
    /// Standard deviation of each joint's speed at the start, rad/s.
    pub joint_speed: f64,
    /// Standard deviation of the base's velocity on each axis at the start, m/s.
    pub base_speed: f64,
    /// Time for which the stand after the clip is part of an episode, s.
    pub stand: f64,
}

impl Default for StartSettings {
    fn default() -> Self {
        Self { uniform: 0.3, first: 0.2, joint: 0.01, joint_speed: 0.1, base_speed: 0.03, stand: 0.8 }
    }
}

impl StartSettings {
    /// Adds random errors to a start state q (7 + n), v (6 + n) of `robot`.
    pub(crate) fn disturb(&self, robot: &Robot, q: &mut [f64], v: &mut [f64], rng: &mut ChaCha8Rng) {
        let Self { joint, joint_speed, base_speed, .. } = *self;
        StartErrors { joint, joint_speed, base_speed }.disturb(robot, q, v, rng);
    }
}

/// Proximal policy optimisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PpoSettings {
    /// Environments.
    pub environments: usize,
    /// Steps of each environment an iteration.
    pub horizon: usize,
    /// Samples of a gradient step.
    pub minibatch: usize,
    /// Passes over an iteration's samples.
    pub epochs: usize,
    /// Discount.
    pub gamma: f64,
    /// Of the generalised advantage.
    pub lambda: f64,
    /// Clip of the probability ratio.
    pub clip: f64,
    /// Step size of the policy at the start.
    pub learning_rate: f64,
    /// Step sizes that the adaptation may choose.
    pub learning_rate_range: [f64; 2],
    /// Step size of the value.
    pub critic_rate: f64,
    /// KL divergence of a gradient step that the step size is adapted to.
    pub kl: f64,
    /// Weight of the entropy.
    pub entropy: f64,
    /// Longest gradient.
    pub gradient: f64,
    /// Iterations at the start in which only the value learns; for a policy that goes on from another.
    pub warm_up: u64,
    /// Standard deviation of the actions at the start.
    pub sigma: f64,
    /// Standard deviations that are allowed.
    pub sigma_range: [f64; 2],
}

impl Default for PpoSettings {
    fn default() -> Self {
        Self {
            environments: 256,
            horizon: 32,
            minibatch: 2048,
            epochs: 4,
            gamma: 0.97,
            lambda: 0.95,
            clip: 0.2,
            learning_rate: 3e-4,
            learning_rate_range: [1e-5, 3e-3],
            critic_rate: 5e-4,
            kl: 0.01,
            entropy: 0.0,
            gradient: 1.0,
            warm_up: 0,
            sigma: 0.3,
            sigma_range: [0.03, 1.0],
        }
    }
}

/// The networks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NetworkSettings {
    /// Sizes of the policy's hidden layers; the paper has 1024 and 512.
    pub actor: Vec<usize>,
    /// Sizes of the value's hidden layers.
    pub critic: Vec<usize>,
    /// Between the layers; the paper has `relu`.
    pub activation: Activation,
}

impl Default for NetworkSettings {
    fn default() -> Self {
        Self { actor: vec![256, 128], critic: vec![256, 128], activation: Activation::Relu }
    }
}

/// The worlds of the training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorldSettings {
    /// Physics step away from the ball, s. Trials are measured at the world's own, finer one.
    pub step: f64,
    /// Most iterations of the contact solver in a step; trials are measured with more.
    pub solver_iterations: usize,
    /// Gain at which the contact solver stops; trials are measured with a smaller one.
    pub solver_tolerance: f64,
    /// Whether the ball lies at its place; without, it lies far away.
    pub ball: bool,
    /// Noise and delay of the sensors beyond the robot's own.
    pub sensors: instep_sim::settings::SensorNoise,
    /// Whether drives are as `robot.toml` has them.
    pub drives: Fidelity,
    /// Whether senses are as `robot.toml` has them.
    pub senses: Fidelity,
    /// How far apart the environments' worlds are.
    pub spread: Spread,
}

/// How far the worlds of a training's environments differ: each environment draws its own once, evenly. Zero by default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Spread {
    /// Most by which the factor on every link's mass and inertia differs from 1.
    pub mass: f64,
    /// Most by which the centre of mass of the base is shifted on each horizontal axis, m.
    pub base_shift: f64,
    /// Most by which the friction of the ground is lower or higher.
    pub friction: f64,
    /// Most by which all sensors are late beyond their own delay, s.
    pub delay: f64,
    /// Most by which the restitution of foot and ball is lower or higher.
    pub restitution: f64,
}

impl Spread {
    /// The world of one environment, drawn from `rng` round `world`.
    pub(crate) fn draw(&self, world: &mut instep_sim::settings::WorldSettings, rng: &mut ChaCha8Rng) {
        let mut within = |most: f64| if most > 0.0 { rng.random_range(-most..=most) } else { 0.0 };
        world.model_error.mass += within(self.mass);
        for axis in 0..2 {
            world.model_error.base_shift[axis] += within(self.base_shift);
        }
        world.pitch.friction += within(self.friction);
        world.impact.restitution += within(self.restitution);
        world.sensors.delay += within(self.delay).abs();
    }
}

impl Default for WorldSettings {
    fn default() -> Self {
        Self {
            step: 0.004,
            solver_iterations: 10,
            solver_tolerance: 1e-5,
            ball: false,
            sensors: instep_sim::settings::SensorNoise::default(),
            drives: Fidelity::Ideal,
            senses: Fidelity::Ideal,
            spread: Spread::default(),
        }
    }
}

impl LearnSettings {
    /// The second stage of paper 1: from a policy that follows its reference to one that kicks the ball, with the values of the
    /// shipped policy's last millions of steps. Little exploration and a loose threshold; start errors half as large again as
    /// those of trials, mostly at the clip's start, where trials start; a ball that is worth less than a fall costs; the world as
    /// built, a little different for each environment, in its own step; and joint speeds held well below their limits, for a
    /// landing is short and hard.
    #[must_use]
    pub fn ball() -> Self {
        Self {
            reward: RewardSettings {
                w_limit: 60.0,
                limit_from: 0.85,
                w_ball: 8.0,
                ball_across: 4.0,
                ..RewardSettings::default()
            },
            termination: TerminationSettings { d_max: 0.4, d_min: 0.4, ..TerminationSettings::default() },
            start: StartSettings {
                uniform: 0.1,
                first: 0.75,
                joint: 0.015,
                joint_speed: 0.15,
                base_speed: 0.045,
                stand: 0.5,
            },
            ppo: PpoSettings {
                horizon: 48,
                minibatch: 3072,
                gamma: 0.99,
                lambda: 0.97,
                learning_rate: 5e-5,
                kl: 0.015,
                warm_up: 6,
                sigma: 0.1,
                ..PpoSettings::default()
            },
            world: WorldSettings {
                // In longer ones it learns what only they allow, and falls in the world that it is measured in.
                step: 0.001,
                ball: true,
                drives: Fidelity::AsBuilt,
                senses: Fidelity::AsBuilt,
                spread: Spread { mass: 0.03, friction: 0.15, delay: 0.003, restitution: 0.04, ..Spread::default() },
                ..WorldSettings::default()
            },
            ..Self::default()
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`LearnError::Setting`] for the first whose value cannot be.
    pub fn validate(&self) -> Result<(), LearnError> {
        let check = |field: &str, found: f64, good: bool, expected: &str| {
            if good && found.is_finite() {
                return Ok(());
            }
            Err(LearnError::Setting { field: field.into(), found: found.to_string(), expected: expected.into() })
        };
        let reward = &self.reward;
        for (name, weight) in [
            ("w_k", reward.w_k),
            ("w_q", reward.w_q),
            ("w_v", reward.w_v),
            ("w_c", reward.w_c),
            ("w_rate", reward.w_rate),
            ("w_action", reward.w_action),
            ("w_limit", reward.w_limit),
            ("w_ball", reward.w_ball),
            ("ball_across", reward.ball_across),
        ] {
            check(&format!("reward.{name}"), weight, weight >= 0.0, "a number of at least 0")?;
        }
        let sum = reward.w_k + reward.w_q + reward.w_v + reward.w_c;
        check("reward: w_k + w_q + w_v + w_c", sum, sum > 0.0, "above 0")?;
        for (name, factor) in [("k_k", reward.k_k), ("k_q", reward.k_q), ("k_v", reward.k_v), ("k_c", reward.k_c)] {
            check(&format!("reward.{name}"), factor, factor < 0.0, "a number below 0")?;
        }
        for (name, value) in
            [("limit_from", reward.limit_from), ("ball_scale", reward.ball_scale), ("ball_cap", reward.ball_cap)]
        {
            check(&format!("reward.{name}"), value, value > 0.0, "a number above 0")?;
        }
        let end = &self.termination;
        check("termination.d_max", end.d_max, end.d_max > 0.0, "a distance above 0")?;
        check("termination.d_min", end.d_min, end.d_min > 0.0 && end.d_min <= end.d_max, "in (0, d_max]")?;
        check("termination.t_start", end.t_start, (0.0..=1.0).contains(&end.t_start), "a share in [0, 1]")?;
        check("termination.t_end", end.t_end, end.t_end > end.t_start && end.t_end <= 1.0, "in (t_start, 1]")?;
        check("termination.n", end.n as f64, (1..=100).contains(&end.n), "1 to 100")?;
        check("termination.gamma", end.gamma, end.gamma > 0.0, "a number above 0")?;
        check("termination.survival", end.survival, (0.0..=1.0).contains(&end.survival), "a share in [0, 1]")?;
        let start = &self.start;
        check("start.uniform", start.uniform, (0.0..=1.0).contains(&start.uniform), "a share in [0, 1]")?;
        let shares = start.uniform + start.first;
        check("start.first", start.first, start.first >= 0.0 && shares <= 1.0, "a share, with uniform at most 1")?;
        for (name, value) in [
            ("joint", start.joint),
            ("joint_speed", start.joint_speed),
            ("base_speed", start.base_speed),
            ("stand", start.stand),
        ] {
            check(&format!("start.{name}"), value, value >= 0.0, "a number of at least 0")?;
        }
        let ppo = &self.ppo;
        for (name, value, most) in [
            ("environments", ppo.environments, 1 << 16),
            ("horizon", ppo.horizon, 1 << 12),
            ("minibatch", ppo.minibatch, 1 << 20),
            ("epochs", ppo.epochs, 100),
        ] {
            check(&format!("ppo.{name}"), value as f64, (1..=most).contains(&value), &format!("1 to {most}"))?;
        }
        check("ppo.gamma", ppo.gamma, (0.0..1.0).contains(&ppo.gamma), "in [0, 1)")?;
        check("ppo.lambda", ppo.lambda, (0.0..=1.0).contains(&ppo.lambda), "in [0, 1]")?;
        check("ppo.clip", ppo.clip, ppo.clip > 0.0 && ppo.clip < 1.0, "in (0, 1)")?;
        let [least, most] = ppo.learning_rate_range;
        check("ppo.learning_rate_range", least, least > 0.0 && least <= most, "two rising numbers above 0")?;
        let rate = ppo.learning_rate;
        check("ppo.learning_rate", rate, (least..=most).contains(&rate), "inside learning_rate_range")?;
        check("ppo.critic_rate", ppo.critic_rate, ppo.critic_rate > 0.0, "a number above 0")?;
        check("ppo.kl", ppo.kl, ppo.kl > 0.0, "a number above 0")?;
        check("ppo.entropy", ppo.entropy, ppo.entropy >= 0.0, "a number of at least 0")?;
        check("ppo.gradient", ppo.gradient, ppo.gradient > 0.0, "a number above 0")?;
        let [least, most] = ppo.sigma_range;
        check("ppo.sigma_range", least, least > 0.0 && least <= most, "two rising numbers above 0")?;
        check("ppo.sigma", ppo.sigma, (least..=most).contains(&ppo.sigma), "inside sigma_range")?;
        for (name, sizes) in [("actor", &self.network.actor), ("critic", &self.network.critic)] {
            let good = sizes.len() <= 8 && sizes.iter().all(|size| (1..=8192).contains(size));
            let worst = sizes.iter().copied().max().unwrap_or(0);
            check(&format!("network.{name}"), worst as f64, good, "at most 8 layers of 1 to 8192")?;
        }
        let iterations = self.world.solver_iterations;
        check("world.solver_iterations", iterations as f64, (1..=1000).contains(&iterations), "1 to 1000")?;
        let tolerance = self.world.solver_tolerance;
        check("world.solver_tolerance", tolerance, (0.0..=1e-2).contains(&tolerance), "in [0, 0.01]")?;
        let spread = &self.world.spread;
        for (name, value, most) in [
            ("mass", spread.mass, 0.5),
            ("base_shift", spread.base_shift, 0.1),
            ("friction", spread.friction, 0.6),
            ("delay", spread.delay, 0.1),
            ("restitution", spread.restitution, 0.25),
        ] {
            check(&format!("world.spread.{name}"), value, (0.0..=most).contains(&value), &format!("0 to {most}"))?;
        }
        let period = self.follower.period;
        check("follower.period", period, (0.001..=0.1).contains(&period), "0.001 to 0.1 s")?;
        let scale = self.follower.scale;
        check("follower.scale", scale, scale > 0.0, "a number above 0")?;
        let horizons = &self.follower.horizons;
        let longest = horizons.iter().copied().fold(0.0, f64::max);
        let good = horizons.len() <= 16 && horizons.iter().all(|h| h.is_finite() && *h >= 0.0);
        check("follower.horizons", longest, good, "at most 16 times of at least 0 s")?;
        let ratio = period / self.world.step;
        let whole = (ratio - ratio.round()).abs() < 1e-6 && ratio.round() >= 1.0;
        check("world.step", self.world.step, whole, "a whole fraction of follower.period")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;

    #[test]
    fn worlds_differ_within_the_spread_and_not_without_one() {
        let plain = instep_sim::settings::WorldSettings::default();
        let drawn = |spread: Spread, seed| {
            let mut world = plain;
            spread.draw(&mut world, &mut ChaCha8Rng::seed_from_u64(seed));
            world
        };
        assert_eq!(drawn(Spread::default(), 1), plain);
        let spread = Spread { mass: 0.1, base_shift: 0.02, friction: 0.3, delay: 0.01, restitution: 0.05 };
        let worlds: Vec<_> = (0..200).map(|seed| drawn(spread, seed)).collect();
        let spans = |of: fn(&instep_sim::settings::WorldSettings) -> f64, middle: f64, low: f64, high: f64| {
            let off: Vec<f64> = worlds.iter().map(|world| of(world) - middle).collect();
            let (least, most) = off.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
            // All within, and all of it used.
            assert!(least >= low && most <= high && most - least > 0.9 * (high - low), "{least} {most}, {low} {high}");
        };
        spans(|w| w.model_error.mass, 1.0, -0.1, 0.1);
        spans(|w| w.model_error.base_shift[0], 0.0, -0.02, 0.02);
        spans(|w| w.model_error.base_shift[1], 0.0, -0.02, 0.02);
        spans(|w| w.pitch.friction, plain.pitch.friction, -0.3, 0.3);
        spans(|w| w.impact.restitution, plain.impact.restitution, -0.05, 0.05);
        spans(|w| w.sensors.delay, 0.0, 0.0, 0.01);
        assert!(worlds.iter().all(|world| world.model_error.base_shift[2] == 0.0));
    }
}
