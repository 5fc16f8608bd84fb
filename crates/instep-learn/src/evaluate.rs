//! What a policy is worth: seeded trials in the world in which every kick is measured, with the ball at its place (unless they
//! start too late for it).
//!
//! A trial starts in the track's first state (or a later one, or the trials' starts are spread over the clip) with the small
//! errors of [`StartSettings`], and goes on until two seconds after the contact, or the end of the stand if that is later.

mod chatter;

use std::sync::Arc;

use instep_kick::policy::{PERIOD, Policy, PolicyKick};
use instep_robot::Robot;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::{self, LimitViolation, Trial, TrialSettings};
use instep_sim::{BallState, NamedRate, World};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::LearnError;
use crate::environment::{NO_BALL, Scene, before_ball};
use crate::settings::{ClipSettings, LearnSettings, StartSettings};

/// A trial counts as completed while no link is farther from the reference than this, m: paper 1's fixed threshold.
pub const COMPLETED: f64 = 0.3;
/// How long after the contact a robot must be upright, s.
const UPRIGHT: f64 = 2.0;

/// What is to be tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Number of trials.
    pub trials: usize,
    /// Seed of the first; each has its own.
    pub seed: u64,
    /// Where in the track they start, s.
    pub start: f64,
    /// Whether only the first starts there, and the others are spread evenly from there to the clip's end.
    pub spread: bool,
    /// Errors of the start, and the stand that is part of the trial.
    pub errors: StartSettings,
    /// The world.
    pub world: WorldSettings,
}

impl Default for Evaluation {
    fn default() -> Self {
        Self {
            trials: 100,
            seed: 1,
            start: 0.0,
            spread: false,
            errors: StartSettings::default(),
            world: WorldSettings::default(),
        }
    }
}

impl Evaluation {
    /// Trial number `index` alone, of a clip of `duration` (s); it starts at a multiple of the policy's `period` (s).
    fn single(&self, index: u64, duration: f64, period: f64) -> Self {
        let share = if self.spread { index as f64 / self.trials as f64 } else { 0.0 };
        let later = (share * (duration - self.start) / period).floor() * period;
        Self { trials: 1, seed: self.seed + index, start: self.start + later, spread: false, ..self.clone() }
    }
}

/// What came of one trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tried {
    /// Its seed.
    pub seed: u64,
    /// Whether no link left the reference by more than [`COMPLETED`] before the clip's end, and the robot did not fall.
    pub completed: bool,
    /// Mean over the clip and the links of the distance from the reference, m.
    pub link_error: f64,
    /// Whether the ball was hit by a kick that the audit believes.
    pub hit: bool,
    /// Whether the whole kick, run again at a quarter of the step, led to the same.
    pub converged: bool,
    /// m/s; `None` when the ball was not touched or the audit refused the kick.
    pub ball_speed: Option<f64>,
    /// From straight ahead to the ball's direction, positive to the left, degrees; `None` as above.
    pub direction_error_deg: Option<f64>,
    /// Whether the robot stood to the trial's end, at least two seconds after the contact.
    pub upright: bool,
    /// When it fell, s.
    pub fell_at: Option<f64>,
    /// Whether the ball was touched but the audit refused the kick.
    pub audit_invalid: bool,
    /// Joints beyond a torque or speed limit.
    pub limit_violations: usize,
    /// Share of the ticks in which a joint's torque has gone from beyond +80 % to beyond -80 % of its limit, or back, within 40 ms.
    pub torque_reversals: f64,
    /// Which, how far and when.
    pub beyond: Vec<LimitViolation>,
}

/// What came of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of trials.
    pub trials: usize,
    /// Share that followed the clip to its end.
    #[serde(flatten)]
    pub completed: NamedRate,
    /// Mean of the trials' link errors, m.
    pub link_error_mean: f64,
    /// Their standard deviation, m.
    pub link_error_deviation: f64,
    /// Median of the audited ball speeds, m/s.
    pub ball_speed_median: Option<f64>,
    /// Median of the absolute direction errors, degrees.
    pub direction_error_median_deg: Option<f64>,
    /// Share that stood to the end.
    #[serde(flatten)]
    pub upright: NamedRate,
    /// Share that hit the ball with a kick that the audit believes.
    #[serde(flatten)]
    pub hit: NamedRate,
    /// Share whose re-run at a quarter of the step led to the same.
    #[serde(flatten)]
    pub converged: NamedRate,
    /// Touched balls that the audit refused.
    pub audit_invalid: usize,
    /// Joints beyond a limit, over all trials.
    pub limit_violations: usize,
    /// Mean share of ticks in which a joint's torque has gone from beyond +80 % to beyond -80 % of its limit, or back, within 40 ms.
    pub torque_reversal_share: f64,
    /// Each trial.
    pub each: Vec<Tried>,
}

/// Tries `policy` on `robot`; `told` is called after each trial, from any thread.
///
/// # Errors
/// When policy and robot do not fit, or a simulation diverges.
pub fn evaluate(
    robot: &Arc<Robot>,
    policy: &Policy,
    evaluation: &Evaluation,
    told: &(dyn Fn() + Sync),
) -> Result<Summary, LearnError> {
    let [from, to] = policy.header.window;
    let settings = LearnSettings {
        clip: ClipSettings { from: Some(from), to: Some(to) },
        follower: policy.header.follower.clone(),
        start: evaluation.errors.clone(),
        ..LearnSettings::default()
    };
    let scene = Scene::new(Arc::clone(robot), Arc::clone(&policy.reference), settings)?;
    let (duration, period) = (scene.follower().track().duration(), policy.header.follower.period);
    let each = (0..evaluation.trials as u64)
        .into_par_iter()
        .map_init(
            || None,
            |world, index| {
                let world = match world {
                    Some(world) => world,
                    None => world.insert(World::new(Arc::clone(robot), &evaluation.world)?),
                };
                let single = evaluation.single(index, duration, period);
                let tried = attempt(robot, policy, &single, &scene, world);
                told();
                tried
            },
        )
        .collect::<Result<Vec<_>, LearnError>>()?;
    Ok(summary(each))
}

/// One trial of a policy at the evaluation's start, with the small start errors of its seed.
fn kick(robot: &Arc<Robot>, policy: &Policy, evaluation: &Evaluation, world: &mut World) -> Result<Trial, LearnError> {
    let mut engine = PolicyKick::new(robot, policy, evaluation.start)?;
    let mut twin = PolicyKick::new(robot, policy, evaluation.start)?;
    let (mut q, mut v) = engine.initial_state();
    let mut rng = ChaCha8Rng::seed_from_u64(evaluation.seed);
    let errors = &evaluation.errors;
    errors.disturb(robot, &mut q, &mut v, &mut rng);
    let track = engine.follower().track();
    let (contact, end) = (track.contact_time(), track.duration() + errors.stand);
    let ball = if before_ball(track, evaluation.start) { policy.reference.ball } else { NO_BALL };
    let settings = TrialSettings {
        world: evaluation.world,
        seed: evaluation.seed,
        duration: end.max(contact + UPRIGHT) - evaluation.start,
        control_period: PERIOD.max(evaluation.world.step.tick),
        q,
        v,
        ball: BallState::at_rest(ball),
        direction: 0.0,
    };
    Ok(trial::run_in(world, &settings, &mut engine, &mut twin)?)
}

fn attempt(
    robot: &Arc<Robot>,
    policy: &Policy,
    evaluation: &Evaluation,
    scene: &Scene,
    world: &mut World,
) -> Result<Tried, LearnError> {
    let trial = kick(robot, policy, evaluation, world)?;
    let period = policy.header.follower.period;
    let track = scene.follower().track();
    let mut data = robot.data();
    let (mut sum, mut count, mut farthest) = (0.0, 0u32, 0.0f64);
    let mut next = 0.0;
    for (i, &time) in trial.record.times.iter().enumerate() {
        let at = evaluation.start + time;
        if at > track.duration() + 1e-9 {
            break;
        }
        if time + 1e-9 < next {
            continue;
        }
        next += period;
        let tick = (at / period).round() as usize;
        let row = |values| trial.record.row(values, i);
        let deviation = scene.deviation(tick, row(&trial.record.q), row(&trial.record.v), &mut data);
        sum += deviation.links;
        count += 1;
        farthest = farthest.max(deviation.farthest.0);
    }
    let valid = trial.audit.is_valid();
    let limits: Vec<f64> = robot.joints.iter().map(|joint| joint.torque).collect();
    let clip_end = track.duration() - evaluation.start;
    Ok(Tried {
        seed: evaluation.seed,
        completed: farthest <= COMPLETED && trial.fell_at.is_none_or(|time| time > clip_end),
        link_error: sum / f64::from(count.max(1)),
        hit: valid,
        converged: trial.audit.converged,
        ball_speed: trial.ball_speed.filter(|_| valid),
        direction_error_deg: trial.direction_error.filter(|_| valid).map(f64::to_degrees),
        upright: trial.upright(),
        fell_at: trial.fell_at,
        audit_invalid: trial.impact.is_some() && !valid,
        limit_violations: trial.limit_violations.len(),
        torque_reversals: chatter::share(&trial.record.times, &trial.record.torques, &limits),
        beyond: trial.limit_violations,
    })
}

fn summary(each: Vec<Tried>) -> Summary {
    let count = each.len().max(1) as f64;
    let rate = |name, good: fn(&Tried) -> bool| {
        NamedRate::of(name, each.iter().filter(|tried| good(tried)).count(), each.len())
    };
    let mean = each.iter().map(|tried| tried.link_error).sum::<f64>() / count;
    let variance = each.iter().map(|tried| (tried.link_error - mean).powi(2)).sum::<f64>() / count;
    Summary {
        trials: each.len(),
        completed: rate("completed_rate", |tried| tried.completed),
        link_error_mean: mean,
        link_error_deviation: variance.sqrt(),
        ball_speed_median: median(each.iter().filter_map(|tried| tried.ball_speed)),
        direction_error_median_deg: median(each.iter().filter_map(|tried| tried.direction_error_deg.map(f64::abs))),
        upright: rate("upright_rate", |tried| tried.upright),
        hit: rate("hit_rate", |tried| tried.hit),
        converged: rate("converged_rate", |tried| tried.converged),
        audit_invalid: each.iter().filter(|tried| tried.audit_invalid).count(),
        limit_violations: each.iter().map(|tried| tried.limit_violations).sum(),
        torque_reversal_share: each.iter().map(|tried| tried.torque_reversals).sum::<f64>() / count,
        each,
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

#[cfg(test)]
mod tests;
