//! One cell of the benchmark: one engine, robot, scenario and seed; every case planned, tried and measured.
//!
//! The engine sees the request and the sensors; the world and its truth stay here. The time that plans and ticks take on
//! a core is measured here too, and is the only thing in a result that differs from run to run.

use std::collections::BTreeSet;
use std::sync::Arc;

use instep_kick::rolling::ball_velocity;
use instep_kick::{BreakOff, KickEngine, KickPlan, KickRequest, Phase, Refusal};
use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::trial::{Disturbance, Trial, TrialSettings, run_disturbed};
use instep_sim::{BallState, World};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::BenchError;
use crate::cpu::thread_seconds;
use crate::engines::Subject;
use crate::scenario::{Case, Scenario};

/// Time after the planned end in which the robot must stand, s.
const AFTER: f64 = 0.8;
/// A ball that leaves slower than this share of the asked speed was not hit.
const HIT: f64 = 0.3;
/// A kick is delivered when the ball has this share of the asked speed or more,
pub(crate) const DELIVERED_SPEED: f64 = 0.8;
/// and goes at most this far off the asked direction, rad.
const DELIVERED_DIRECTION: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// Sets the draw of a start's errors apart from the trial's noise, which has the same seed.
const START_STREAM: u64 = 1;

/// Which cell.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CellKey {
    /// Engine.
    pub engine: String,
    /// Robot.
    pub robot: String,
    /// Scenario.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// Number of requests.
    pub requests: usize,
    /// Of the robot, its settings and the scenario: a kept cell counts only while these are the same. It does not see
    /// a change of the program, of a policy or of a reachability grid.
    #[serde(default)]
    pub fingerprint: u64,
}

/// What came of one accepted request.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Kicked {
    /// Whether the ball was hit: by a kick that passed the audit, and at a share of the asked speed that deserves the name.
    pub hit: bool,
    /// Whether it was what had been asked: hit, the robot upright, direction within 15 degrees, speed at least 0.8 of it.
    #[serde(default)]
    pub delivered: bool,
    /// Whether the whole kick, run again at a quarter of the step, led to the same.
    #[serde(default)]
    pub converged: bool,
    /// Whether the robot stood to the end.
    pub upright: bool,
    /// Speed of the ball, m/s; only when the audit believes it.
    pub ball_speed: Option<f64>,
    /// Speed asked, m/s.
    pub asked_speed: f64,
    /// Speed of the striking point just before the contact, m/s.
    #[serde(default)]
    pub foot_speed: Option<f64>,
    /// Signed direction error of a hit, rad.
    pub direction_error: Option<f64>,
    /// How far the ball of a hit rolls from its place, m, else 0: as simulated, and from the last speed on by the rolling
    /// deceleration.
    pub distance: f64,
    /// From the plan to the contact, s.
    pub contact: Option<f64>,
    /// Whether the ball was touched by a kick that failed the audit.
    pub audit_invalid: bool,
    /// Joints beyond their limits.
    pub violations: usize,
    /// The direction as the scenario says it, rad: positive toward the middle line, as seen from the ball's side.
    #[serde(default)]
    pub turn: f64,
    /// Direction error in the same sense, rad.
    #[serde(default)]
    pub turn_error: Option<f64>,
    /// The engine's forecast g of the direction, where it has one.
    #[serde(default)]
    pub forecast: Option<f64>,
    /// The standard deviation of the direction that the plan stated, rad.
    #[serde(default)]
    pub precision: f64,
    /// Samples at which the kicking foot touched the ground while it was to swing.
    #[serde(default)]
    pub grounded: usize,
    /// Why the engine gave the kick up.
    #[serde(default)]
    pub broken_off: Option<BreakOff>,
}

/// All results of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellResult {
    /// Which cell.
    pub key: CellKey,
    /// For each case, in order: what came of it, or the refusal's name.
    pub outcomes: Vec<Result<Kicked, String>>,
    /// For each case, the fastest ball that the robot's geometry and joint speeds allow, m/s, `None` where no foot comes to it
    /// ([`instep_kick::bound`]; of a rolling ball one that is fast enough will do); empty where kicks do not start from the stand.
    #[serde(default)]
    pub bounds: Vec<Option<f64>>,
    /// For each case, the speed that was asked, m/s.
    #[serde(default)]
    pub asked: Vec<f64>,
    /// Time of each plan, s.
    pub plan_times: Vec<f64>,
    /// Median and 99th percentile of the ticks' times, s.
    pub tick_times: [f64; 2],
    /// The constants, by their keys, in which a case's world was not the robot's default one.
    #[serde(default)]
    pub world_changes: BTreeSet<String>,
}

/// Measures the ticks of an engine.
struct Timed<'a> {
    engine: &'a mut dyn KickEngine,
    times: &'a mut Vec<f32>,
    /// First and last time at which the foot was to swing, s.
    swing: [f64; 2],
    /// The last forecast before the contact.
    forecast: Option<f64>,
}

impl Controller for Timed<'_> {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let start = thread_seconds();
        self.engine.tick(sensors, command);
        self.times.push((thread_seconds() - start) as f32);
        let progress = self.engine.progress();
        if matches!(progress.phase, Phase::WindUp | Phase::Kick) {
            self.swing = [self.swing[0].min(sensors.time), sensors.time];
        }
        if progress.to_contact.is_some_and(|left| left > 0.0) {
            self.forecast = self.engine.forecast();
        }
    }
}

/// Runs one cell.
///
/// # Errors
/// When the world cannot be built or the simulation diverges.
pub fn run_cell(subject: &Subject, scenario: &Scenario, key: &CellKey) -> Result<CellResult, BenchError> {
    let mut ticks = Vec::new();
    let mut plan_times = Vec::with_capacity(key.requests);
    let mut outcomes = Vec::with_capacity(key.requests);
    let mut shared: Option<World> = None;
    let cases = cases(subject, scenario, key)?;
    let stands = subject.engine(&key.engine)?.own_start().is_none();
    let mut bounds = if stands { subject.bounds() } else { None };
    let mut fastest = Vec::new();
    let asked = cases.iter().map(|case| case.request.strength.value()).collect();
    let mut world_changes = BTreeSet::new();
    for case in cases {
        if let Some(bounds) = &mut bounds {
            let rolls = case.request.ball_velocity != [0.0; 2];
            let enough = if rolls { case.request.strength.value() } else { f64::INFINITY };
            fastest.push(bounds.of(&case.request, enough).map(|bound| bound.ball_speed));
        }
        let world = match &mut shared {
            Some(world) if !scenario.varies_world() => world,
            slot => slot.insert(world(subject, scenario, &case)?),
        };
        world_changes.extend(world.settings().changes(&subject.default_world()).into_iter().map(|change| change.key));
        let (outcome, plan_time, _) = run_case(subject, &key.engine, &case, world, &mut ticks)?;
        plan_times.push(plan_time);
        outcomes.push(outcome.map_err(|refusal| refusal.name().to_owned()));
    }
    ticks.sort_by(f32::total_cmp);
    let at = |share: f64| ticks.get(((ticks.len() as f64 * share) as usize).min(ticks.len().max(1) - 1));
    let tick_times = [0.5, 0.99].map(|share| at(share).map_or(0.0, |t| f64::from(*t)));
    Ok(CellResult { key: key.clone(), outcomes, bounds: fastest, asked, plan_times, tick_times, world_changes })
}

/// The cases of a cell.
///
/// # Errors
/// When there is no such engine for the robot.
pub fn cases(subject: &Subject, scenario: &Scenario, key: &CellKey) -> Result<Vec<Case>, BenchError> {
    Ok(match subject.engine(&key.engine)?.own_start() {
        Some(start) => scenario.cases_about(&start.request, &subject.size, key.seed, key.requests),
        None => scenario.cases(&subject.size, key.seed, key.requests),
    })
}

/// The world of a case.
///
/// # Errors
/// When its constants cannot be.
pub fn world(subject: &Subject, scenario: &Scenario, case: &Case) -> Result<World, BenchError> {
    let mut settings = subject.world();
    settings.sensors = scenario.sensors;
    settings.model_error = case.model;
    let [friction, softness] = case.pitch;
    settings.pitch.friction = friction.unwrap_or(settings.pitch.friction);
    settings.pitch.softness = softness.unwrap_or(settings.pitch.softness);
    Ok(World::new(Arc::clone(&subject.robot), &settings)?)
}

/// What an accepted request led to.
#[derive(Debug)]
pub struct Ran {
    /// What was asked.
    pub request: KickRequest,
    /// What the engine planned.
    pub plan: KickPlan,
    /// How it was tried.
    pub settings: TrialSettings,
    /// What happened.
    pub trial: Trial,
}

/// The outcome of a case, the time of its plan (s), and what an accepted request led to.
pub type Tried = (Result<Kicked, Refusal>, f64, Option<Ran>);

/// Plans and tries one case with the engine called `name`, from the stand or from where the engine says that its kicks start.
/// Where the robot has a camera, the engine is told the ball's velocity as it follows from the sights before the plan, not as it
/// is. Gives the outcome, the time of the plan (s) and what an accepted request led to.
///
/// # Errors
/// When there is no such engine for the robot, the ball lies in it, or the simulation diverges.
pub fn run_case(
    subject: &Subject,
    name: &str,
    case: &Case,
    world: &mut World,
    ticks: &mut Vec<f32>,
) -> Result<Tried, BenchError> {
    let robot = &subject.robot;
    // The audit runs the whole kick again, with an engine of its own.
    let (mut engine, mut twin) = (subject.engine(name)?, subject.engine(name)?);
    let (mut q, mut v, footprint) = match engine.own_start() {
        Some(start) => (start.q, start.v, start.footprint),
        None => (robot.stand.clone(), vec![0.0; robot.nv()], subject.footprint),
    };
    // The robot has looked at the ball before it is asked.
    if let Some(mut gaze) = subject.gaze() {
        gaze.aim(case.request.ball, &mut q[7..]);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(case.seed);
    rng.set_stream(START_STREAM);
    case.start.disturb(robot, &mut q, &mut v, &mut rng);
    let on_ground = |[x, y]: [f64; 2]| [x + footprint[0], y + footprint[1], subject.size.ball];
    let mut ball = BallState::at_rest(on_ground(case.ball));
    let [vx, vy] = case.ball_velocity;
    ball.velocity = [vx, vy, 0.0];
    ball.angular_velocity = [-vy / subject.size.ball, vx / subject.size.ball, 0.0];
    world.reset(&q, &v, &ball)?;
    let mut suite = SensorSuite::new(world, case.seed);
    suite.sense(world);
    let mut sensors = Sensors::default();
    suite.read_into(0.0, &mut sensors);

    let mut request = case.request;
    if let (Some(sights), Some(camera)) = (suite.ball_sights(), &robot.camera) {
        request.ball_velocity = ball_velocity(sights, camera, robot.data().point(&camera.at).z);
    }
    let start = thread_seconds();
    let planned = engine.plan(&request, &sensors);
    let plan_time = thread_seconds() - start;
    let plan = match planned.and_then(|plan| twin.plan(&request, &sensors).map(|_| plan)) {
        Ok(plan) => plan,
        Err(refusal) => return Ok((Err(refusal), plan_time, None)),
    };
    let mut disturbances = Vec::new();
    if let Some((before, duration, change)) = case.push {
        let share = robot.mass() / duration;
        let force = [change[0] * share, change[1] * share, 0.0];
        disturbances.push(Disturbance::Push { time: (plan.contact - before).max(0.01), duration, force });
    }
    if let Some((before, by)) = case.ball_moved {
        let place = [case.ball[0] + by[0], case.ball[1] + by[1]];
        let ball = BallState::at_rest(on_ground(place));
        disturbances.push(Disturbance::MoveBall { time: (plan.contact - before).max(0.01), ball });
    }
    let settings = TrialSettings {
        world: *world.settings(),
        seed: case.seed,
        duration: plan.duration + AFTER,
        control_period: engine.control_period(),
        q,
        v,
        ball,
        direction: request.direction,
    };
    let forecast = engine.forecast();
    let mut timed =
        Timed { engine: engine.as_mut(), times: ticks, swing: [f64::INFINITY, f64::NEG_INFINITY], forecast };
    let trial = run_disturbed(world, &settings, &disturbances, &mut timed, twin.as_mut())?;
    let mut kicked = judge(subject, case, &trial);
    kicked.forecast = timed.forecast;
    kicked.grounded = grounded(robot, &trial, plan.foot, timed.swing);
    kicked.broken_off = engine.broken_off();
    kicked.precision = plan.precision;
    Ok((Ok(kicked), plan_time, Some(Ran { request, plan, settings, trial })))
}

fn judge(subject: &Subject, case: &Case, trial: &Trial) -> Kicked {
    let asked_speed = case.request.strength.value();
    let valid = trial.audit.is_valid();
    let ball_speed = trial.ball_speed.filter(|_| valid);
    let hit = ball_speed.is_some_and(|speed| speed > HIT * asked_speed);
    let direction_error = trial.direction_error.filter(|_| hit);
    let straight = direction_error.is_some_and(|error| error.abs() <= DELIVERED_DIRECTION);
    let fast = ball_speed.is_some_and(|speed| speed >= DELIVERED_SPEED * asked_speed);
    let first = trial.record.ball.first().map_or([0.0; 3], |ball| ball.position);
    let last_speed = trial.record.ball.last().map_or(0.0, |ball| ball.velocity[0].hypot(ball.velocity[1]));
    let rolled = (trial.ball_end[0] - first[0]).hypot(trial.ball_end[1] - first[1]);
    let distance = rolled + last_speed * last_speed / (2.0 * subject.size.deceleration);
    Kicked {
        hit,
        delivered: hit && trial.upright() && straight && fast,
        converged: trial.audit.converged,
        upright: trial.upright(),
        ball_speed,
        asked_speed,
        foot_speed: trial.impact.as_ref().map(|impact| impact.foot_speed),
        direction_error,
        distance: if hit { distance } else { 0.0 },
        contact: trial.impact.as_ref().map(|impact| impact.time),
        audit_invalid: trial.impact.is_some() && !valid,
        violations: trial.limit_violations.len(),
        turn: case.turn,
        turn_error: direction_error.map(|error| -case.side * error),
        forecast: None,
        precision: 0.0,
        grounded: 0,
        broken_off: None,
    }
}

/// Samples between two times at which a foot touched the ground.
fn grounded(robot: &Robot, trial: &Trial, foot: Side, [from, to]: [f64; 2]) -> usize {
    let upright = trial.fell_at.unwrap_or(f64::INFINITY);
    let record = &trial.record;
    let during = |i: &usize| (from..=to.min(upright)).contains(&record.times[*i]);
    let touches = |i: &usize| {
        let forces = record.row(&record.contact_forces, *i);
        robot.contacts.iter().enumerate().any(|(c, contact)| contact.leg == foot && forces[3 * c + 2] > 0.0)
    };
    (0..record.len()).filter(during).filter(touches).count()
}

#[cfg(test)]
mod tests;
