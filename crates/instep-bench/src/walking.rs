//! One walk from start to stop: runs a [`Walker`] on its senses in a world, disturbs it, measures and records.
//!
//! The robot starts in its stand, in which its senses come to rest for a second, is asked for a velocity or a goal for `duration`, then to stop. Speeds are those of the real
//! base over the ground in its real heading, from the time when the gait has reached what was asked; nothing of the truth
//! reaches the walker.

use std::sync::Arc;

use instep_robot::Robot;
use instep_robot::control::{JointCommand, Sensors};
use instep_sim::sensors::SensorSuite;
use instep_sim::settings::WorldSettings;
use instep_sim::trial::has_fallen;
use instep_sim::{BallState, World};
use instep_walk::gait::{Counts, Footstep, Mode};
use instep_walk::offsets::Offsets;
use instep_walk::{Velocity, WalkSettings, Walker, approach};
use nalgebra::{Quaternion, Rotation2, UnitQuaternion, Vector2, Vector3};

use crate::BenchError;
use crate::cpu::thread_seconds;

/// The period of a torque-driven robot's control, s (paper 4: 1 kHz).
pub const PERIOD: f64 = 0.001;
/// Time before the walk in which the robot stands, s: no robot walks off in the instant of its start.
const BEFORE: f64 = 1.0;
/// Time after the asked walk in which the robot has to stop and to stand, s.
pub const AFTER: f64 = 3.0;
/// Time from the start after which the speed counts, s: shift of the weight, then acceleration.
const RAMP: f64 = 3.0;
/// Speed over the ground under which a robot has stopped, m/s.
const STOPPED: f64 = 0.1;
/// Samples of the record at most.
const SAMPLES: f64 = 4000.0;

/// What the robot is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asked {
    /// A velocity.
    Velocity(Velocity),
    /// A place: x, y (m) and heading (rad) from the start.
    Goal([f64; 3]),
}

/// A force on the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// When it starts, s.
    pub time: f64,
    /// How long it lasts, s.
    pub duration: f64,
    /// N, world frame.
    pub force: [f64; 3],
}

/// A walk to be made.
#[derive(Debug, Clone)]
pub struct WalkTask {
    /// What is asked.
    pub asked: Asked,
    /// For how long, s; then the robot is to stop.
    pub duration: f64,
    /// Seed of all sensor noise.
    pub seed: u64,
    /// The world.
    pub world: WorldSettings,
    /// Pushes.
    pub pushes: Vec<Push>,
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Walked {
    /// When the robot fell, s.
    pub fell_at: Option<f64>,
    /// What was asked within the robot's limits.
    pub asked: Velocity,
    /// Mean velocity over the ground in the robot's heading.
    pub mean: Velocity,
    /// Difference of the two as a share of what was asked; of the turn when only a turn was asked; 0 for a stand.
    pub error: f64,
    /// Way of the base over the ground, m.
    pub distance: f64,
    /// Where the estimate ends from the truth, as a share of the way.
    pub drift_share: f64,
    /// Root mean square error of the estimated velocity over the ground, m/s.
    pub velocity_error: f64,
    /// How far the estimated heading is off at the end, rad.
    pub heading_error: f64,
    /// From the end of what was asked until the robot has stopped for good, s.
    pub stop_time: Option<f64>,
    /// Distance (m) and angle (rad) from the goal at the end, where one was asked.
    pub goal_error: Option<[f64; 2]>,
    /// The whole-body controller's and the whole tick's times that 99 of 100 ticks keep, s.
    pub tick_p99: [f64; 2],
    /// Simulated time of control over the time that its ticks took.
    pub real_time_factor: f64,
    /// What happened how often.
    pub counts: Counts,
    /// Largest share of its torque limit of each joint, and of its speed limit.
    pub peaks: Vec<[f64; 2]>,
    /// What the pendulum leaves out, as learned on the way; of torque drives.
    pub offsets: Option<Offsets>,
    /// Steps that were made, odometry frame.
    pub footsteps: Vec<Footstep>,
    /// Samples.
    pub record: WalkRecord,
}

/// Samples of a walk; one row of a fixed width each.
#[derive(Debug, Clone, Default)]
pub struct WalkRecord {
    /// s.
    pub times: Vec<f64>,
    /// Robot's true positions, 7 + n a row.
    pub q: Vec<f64>,
    /// Torques, n a row, N m.
    pub torques: Vec<f64>,
    /// Ground force on each contact point, 3 a point, N.
    pub forces: Vec<f64>,
    /// True and estimated velocity of the base over the ground, world axes, m/s.
    pub velocity: Vec<[[f64; 2]; 2]>,
    /// True and estimated place of the base, m.
    pub place: Vec<[[f64; 2]; 2]>,
    /// Momentum about the contact over m H in the heading's axes, and as planned for the end of the step, m/s.
    pub momentum: Vec<[[f64; 2]; 2]>,
    /// Whether the left and the right foot swing.
    pub swing: Vec<[bool; 2]>,
}

/// Walks `robot` with `settings`.
///
/// # Errors
/// When robot, settings or world cannot be, or the simulation diverges. A fall is a result.
pub fn walk(
    robot: &Arc<Robot>,
    settings: WalkSettings,
    task: &WalkTask,
    mut tell: impl FnMut(f64),
) -> Result<Walked, BenchError> {
    let mut world_settings = task.world;
    world_settings.step.tick = world_settings.step.tick.min(PERIOD);
    world_settings.step.far = world_settings.step.far.min(world_settings.step.tick);
    let mut world = World::new(Arc::clone(robot), &world_settings)?;
    let far_ball = BallState::at_rest([1000.0, 0.0, world_settings.ball.radius]);
    world.reset(&robot.stand, &vec![0.0; robot.nv()], &far_ball)?;
    let limits = settings.limits.clone();
    let mut walker = Walker::new(Arc::clone(robot), settings)?;
    let mut suite = SensorSuite::new(&mut world, task.seed);
    suite.sense(&world);
    let mut sensors = Sensors::default();
    let mut command = JointCommand::zeros(robot.joints.len());
    let mut meter = Meter::new(robot, task);
    let period = world_settings.step.tick;
    let steps = ((BEFORE + task.duration + AFTER) / period).round() as usize;
    for step in 0..steps {
        let time = step as f64 * period - BEFORE;
        let asked = match task.asked {
            _ if !(0.0..task.duration).contains(&time) => Velocity::default(),
            Asked::Velocity(velocity) => velocity,
            Asked::Goal(goal) => approach::toward(walker.odometry(), goal, &limits),
        };
        let asked = walker.set_velocity(asked);
        for push in &task.pushes {
            let on = (push.time..push.time + push.duration).contains(&time);
            let was_on = (push.time..push.time + push.duration).contains(&(time - period));
            if on != was_on {
                world.push(if on { push.force } else { [0.0; 3] });
            }
        }
        suite.read_into(world.time(), &mut sensors);
        let start = thread_seconds();
        let targets = walker.plan(&sensors, &mut command);
        let planned = thread_seconds();
        let outcome = walker.solve(targets.as_ref());
        let solved = thread_seconds();
        walker.write(outcome, &mut command);
        meter.solves.push(solved - planned);
        meter.ticks.push(thread_seconds() - start);
        meter.look(time, asked, &walker, &world);
        world.advance(&command, None)?;
        suite.sense(&world);
        if step % 100 == 0 {
            tell(time);
        }
        if has_fallen(&world) {
            meter.fell_at = Some(world.time() - BEFORE);
            break;
        }
    }
    Ok(meter.finish(&walker, &world))
}

/// Collects what is measured.
struct Meter {
    task: WalkTask,
    fell_at: Option<f64>,
    asked: Velocity,
    ticks: Vec<f64>,
    solves: Vec<f64>,
    way: f64,
    steady: Option<f64>,
    moved: Velocity,
    last: Option<([f64; 2], f64)>,
    moving: f64,
    velocity_square: f64,
    heading_error: f64,
    samples: f64,
    footsteps: Vec<Footstep>,
    sample_period: f64,
    forces: Vec<Vector3<f64>>,
    record: WalkRecord,
}

impl Meter {
    fn new(robot: &Robot, task: &WalkTask) -> Self {
        Self {
            fell_at: None,
            asked: Velocity::default(),
            ticks: Vec::new(),
            solves: Vec::new(),
            way: 0.0,
            steady: None,
            moved: Velocity::default(),
            last: None,
            moving: 0.0,
            velocity_square: 0.0,
            heading_error: 0.0,
            samples: 0.0,
            footsteps: Vec::new(),
            sample_period: 0.005_f64.max((task.duration + AFTER) / SAMPLES),
            forces: vec![Vector3::zeros(); robot.contacts.len()],
            record: WalkRecord::default(),
            task: task.clone(),
        }
    }

    fn look(&mut self, time: f64, asked: Velocity, walker: &Walker, world: &World) {
        let (q, v) = (world.q(), world.v());
        let place = [q[0], q[1]];
        let heading = heading(q);
        let speed = Vector2::new(v[0], v[1]).norm();
        if let Some((from, turned)) = self.last {
            let step = Vector2::new(place[0] - from[0], place[1] - from[1]);
            self.way += step.norm();
            let ramp = RAMP.min(0.5 * self.task.duration);
            if (ramp..self.task.duration).contains(&time) {
                self.steady.get_or_insert(time);
                let local = Rotation2::new(-heading) * step;
                self.moved.x += local.x;
                self.moved.y += local.y;
                self.moved.turn += wrap(heading - turned);
            }
        }
        self.last = Some((place, heading));
        if (0.0..self.task.duration).contains(&time) {
            self.asked = asked;
        }
        if speed > STOPPED || !matches!(walker.view().mode, Mode::Stand) {
            self.moving = time;
        }
        let estimate = walker.estimate();
        let error = Vector2::new(v[0] - estimate.v[0], v[1] - estimate.v[1]);
        self.heading_error = wrap(heading - self::heading(&estimate.q));
        self.velocity_square += error.norm_squared();
        self.samples += 1.0;
        self.footsteps.extend(walker.footstep());
        if time + 1e-9 >= self.record.times.len() as f64 * self.sample_period {
            self.sample(time, walker, world);
        }
    }

    fn sample(&mut self, time: f64, walker: &Walker, world: &World) {
        let (q, v, estimate, view) = (world.q(), world.v(), walker.estimate(), walker.view());
        let record = &mut self.record;
        record.times.push(time);
        record.q.extend_from_slice(q);
        record.torques.extend_from_slice(world.torques());
        world.contact_forces_into(&mut self.forces);
        record.forces.extend(self.forces.iter().flat_map(|force| [force.x, force.y, force.z]));
        record.velocity.push([[v[0], v[1]], [estimate.v[0], estimate.v[1]]]);
        record.place.push([[q[0], q[1]], [estimate.q[0], estimate.q[1]]]);
        record.momentum.push([view.momentum.into(), view.wanted.into()]);
        let swing = match view.mode {
            Mode::Step { support } => [support as usize == 1, support as usize == 0],
            _ => [false; 2],
        };
        record.swing.push(swing);
    }

    fn finish(mut self, walker: &Walker, world: &World) -> Walked {
        let end = self.fell_at.unwrap_or(self.task.duration).min(self.task.duration);
        let time = self.steady.map_or(f64::NAN, |from| end - from);
        let mean = Velocity { x: self.moved.x / time, y: self.moved.y / time, turn: self.moved.turn / time };
        let asked = self.asked;
        let size = asked.x.hypot(asked.y);
        let error = if size > 0.0 {
            (mean.x - asked.x).hypot(mean.y - asked.y) / size
        } else if asked.turn != 0.0 {
            (mean.turn - asked.turn).abs() / asked.turn.abs()
        } else {
            0.0
        };
        let (q, estimate) = (world.q(), walker.estimate());
        let drift = (q[0] - estimate.q[0]).hypot(q[1] - estimate.q[1]);
        let goal_error = match self.task.asked {
            Asked::Goal(goal) => Some([(q[0] - goal[0]).hypot(q[1] - goal[1]), wrap(heading(q) - goal[2])]),
            Asked::Velocity(_) => None,
        };
        let sum: f64 = self.ticks.iter().sum();
        let count = self.ticks.len();
        let p99 = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            times.get(times.len() * 99 / 100).copied().unwrap_or(f64::NAN)
        };
        let peaks = world.robot().joints.iter().zip(world.peaks());
        Walked {
            fell_at: self.fell_at,
            asked,
            mean,
            error,
            distance: self.way,
            drift_share: if self.way > 0.0 { drift / self.way } else { 0.0 },
            heading_error: self.heading_error,
            velocity_error: (self.velocity_square / self.samples.max(1.0)).sqrt(),
            stop_time: (self.fell_at.is_none() && self.moving < self.task.duration + AFTER - 0.5)
                .then_some((self.moving - self.task.duration).max(0.0)),
            goal_error,
            tick_p99: [p99(&mut self.solves), p99(&mut self.ticks)],
            real_time_factor: count as f64 * world.settings().step.tick / sum,
            counts: walker.counts(),
            peaks: peaks.map(|(joint, peak)| [peak.torque / joint.torque, peak.speed / joint.speed]).collect(),
            offsets: walker.gait().map(instep_walk::Gait::offsets),
            footsteps: self.footsteps,
            record: self.record,
        }
    }
}

impl WalkRecord {
    /// Row `i` of one of the flat arrays.
    #[must_use]
    pub fn row<'a>(&self, values: &'a [f64], i: usize) -> &'a [f64] {
        let width = values.len() / self.times.len().max(1);
        &values[i * width..(i + 1) * width]
    }
}

/// Heading of a robot at `q`, rad.
#[must_use]
pub fn heading(q: &[f64]) -> f64 {
    let turn = UnitQuaternion::new_normalize(Quaternion::new(q[3], q[4], q[5], q[6]));
    let ahead = turn * Vector3::x();
    ahead.y.atan2(ahead.x)
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
