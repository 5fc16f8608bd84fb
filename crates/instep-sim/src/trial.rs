//! One kick from start to finish: runs a controller in a world, watches the impact, audits it, measures and records.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_robot::{LinkPoint, Robot, RobotData};
use nalgebra::Vector3;
use serde::Serialize;

use crate::SimError;
use crate::audit::{Audit, Evidence, Outcome, RERUN_FACTOR, hardest};
use crate::impact::{Impact, ImpactWatch};
use crate::sensors::SensorSuite;
use crate::settings::WorldSettings;
use crate::world::{BallState, JointPeak, Steps, World};

/// Tilt of the base link beyond which the robot counts as fallen, rad.
pub const FALLEN_TILT: f64 = 1.05;
/// Load (N) above which a contact point of the support foot is expected not to slip.
const LOADED: f64 = 20.0;
/// Speed beyond the limit that counts as a violation, as a share of the limit: what one step can overshoot.
const SPEED_TOLERANCE: f64 = 0.02;

/// What is to be tried.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialSettings {
    /// Constants of the world.
    pub world: WorldSettings,
    /// Seed of all noise.
    pub seed: u64,
    /// Length of the trial, s.
    pub duration: f64,
    /// Period at which the controller is called, s; rounded to whole ticks.
    pub control_period: f64,
    /// Robot's position at the start, 7 + n.
    pub q: Vec<f64>,
    /// Robot's speed at the start, 6 + n.
    pub v: Vec<f64>,
    /// Ball at the start.
    pub ball: BallState,
    /// Wanted direction of the ball, rad from world x toward y.
    pub direction: f64,
}

/// Peak torque and speed of a joint group, each against its limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupPeak {
    /// Group name.
    pub group: String,
    /// Joint with the largest share of its torque limit.
    pub torque_joint: String,
    /// Its peak torque, N m.
    pub torque: f64,
    /// Its limit, N m.
    pub torque_limit: f64,
    /// Joint with the largest share of its speed limit.
    pub speed_joint: String,
    /// Its peak speed, rad/s.
    pub speed: f64,
    /// Its limit, rad/s.
    pub speed_limit: f64,
}

/// A joint that went beyond what its motor can do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitViolation {
    /// Joint name.
    pub joint: String,
    /// "torque" or "speed".
    pub quantity: &'static str,
    /// Peak, N m or rad/s.
    pub peak: f64,
    /// Limit, N m or rad/s.
    pub limit: f64,
    /// When, s.
    pub time: f64,
}

/// When a part of the kicking leg was fastest along the wanted direction, around the impact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SegmentPeak {
    /// "pelvis", "thigh", "shank", "foot" or "toe".
    pub segment: &'static str,
    /// Peak forward speed of its centre of mass, m/s.
    pub speed: f64,
    /// When, s.
    pub time: f64,
}

/// Samples at every tick; one row of `width` numbers a sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    /// Times, s.
    pub times: Vec<f64>,
    /// Robot positions, 7 + n a row.
    pub q: Vec<f64>,
    /// Robot speeds, 6 + n a row.
    pub v: Vec<f64>,
    /// Joint torques, n a row, N m.
    pub torques: Vec<f64>,
    /// Ground force on each contact point, 3 x points a row, N.
    pub contact_forces: Vec<f64>,
    /// Ball.
    pub ball: Vec<BallState>,
    /// Every physics step, where the world was told to keep them.
    pub steps: Option<Steps>,
}

/// What came of a kick.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The touch that gave the ball the largest impulse, if it was touched.
    pub impact: Option<Impact>,
    /// Every touch, in order.
    pub touches: Vec<Impact>,
    /// Whether all this may be believed.
    pub audit: Audit,
    /// Ball's speed as it leaves the robot for good, after the last touch, m/s.
    pub ball_speed: Option<f64>,
    /// Signed angle from the wanted to the real direction of the ball, rad.
    pub direction_error: Option<f64>,
    /// Ball's angle above the horizontal as it leaves, rad.
    pub launch_angle: Option<f64>,
    /// When the robot fell, s.
    pub fell_at: Option<f64>,
    /// Longest way that a loaded contact point of the support foot slid, m; `None` without an impact.
    pub support_slip: Option<f64>,
    /// Peaks by joint group.
    pub groups: Vec<GroupPeak>,
    /// Joints beyond their limits.
    pub limit_violations: Vec<LimitViolation>,
    /// Peak speeds of the kicking leg from pelvis to toe; empty without an impact.
    pub segments: Vec<SegmentPeak>,
    /// Where the ball was at the end, m.
    pub ball_end: [f64; 3],
    /// Everything, sampled.
    pub record: Record,
}

impl Trial {
    /// Whether the robot stood to the end.
    #[must_use]
    pub fn upright(&self) -> bool {
        self.fell_at.is_none()
    }
}

/// Runs `controller` through one kick, and `twin`, which is in the same state, through the audit's re-run of it.
///
/// # Errors
/// When the settings cannot be, the ball overlaps robot or ground at the start, or the simulation diverges. A missed ball, a
/// fall and an invalid impact are results.
pub fn run(
    robot: &Arc<Robot>,
    settings: &TrialSettings,
    controller: &mut dyn Controller,
    twin: &mut dyn Controller,
) -> Result<Trial, SimError> {
    let mut world = World::new(Arc::clone(robot), &settings.world)?;
    run_in(&mut world, settings, controller, twin)
}

/// As [`run`], in a world that was already built for the same robot and `settings.world`.
///
/// # Errors
/// As [`run`].
pub fn run_in(
    world: &mut World,
    settings: &TrialSettings,
    controller: &mut dyn Controller,
    twin: &mut dyn Controller,
) -> Result<Trial, SimError> {
    run_disturbed(world, settings, &[], controller, twin)
}

/// Something that happens to robot or ball in a trial, whatever the controller does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Disturbance {
    /// A force on the base link's centre of mass, world frame.
    Push {
        /// When it starts, s.
        time: f64,
        /// How long it lasts, s.
        duration: f64,
        /// N.
        force: [f64; 3],
    },
    /// The ball is put elsewhere.
    MoveBall {
        /// When, s.
        time: f64,
        /// Its new state.
        ball: BallState,
    },
}

/// As [`run_in`], with `disturbances`.
///
/// # Errors
/// As [`run`].
pub fn run_disturbed(
    world: &mut World,
    settings: &TrialSettings,
    disturbances: &[Disturbance],
    controller: &mut dyn Controller,
    twin: &mut dyn Controller,
) -> Result<Trial, SimError> {
    let robot = Arc::clone(world.robot());
    let mut data = robot.data();
    let mut record = Record::default();
    let course = follow(world, settings, disturbances, controller, Some(&mut record), &mut data)?;
    let step = settings.world.step;
    let fine = step.finer(RERUN_FACTOR);
    let rerun = if course.touches.is_empty() {
        None
    } else {
        world.set_step(fine);
        let again = follow(world, settings, disturbances, twin, None, &mut data);
        world.set_step(step);
        Some((again?.outcome(settings.direction), fine))
    };
    let outcome = course.outcome(settings.direction);
    let audit = Audit::new(&Evidence {
        touches: &course.touches,
        finished: course.finished,
        ball_radius: settings.world.ball.radius,
        outcome,
        rerun,
    });
    let impact = hardest(&course.touches).map(|i| course.touches[i].clone());
    let kicker = impact.as_ref().and_then(|impact| kicking_side(&robot, &impact.link));
    let around = impact.as_ref().zip(kicker);
    Ok(Trial {
        ball_speed: outcome.ball_speed,
        direction_error: outcome.direction_error,
        launch_angle: course.leaving().map(|v| v.z.atan2(v.x.hypot(v.y))),
        fell_at: course.fell_at,
        support_slip: around.map(|(_, side)| record.slip(&robot, side.other(), &mut data)),
        groups: group_peaks(&robot, &course.peaks),
        limit_violations: violations(&robot, &course.peaks),
        segments: around.map_or_else(Vec::new, |(impact, side)| {
            record.segment_peaks(&robot, side, impact.time, settings.direction, &mut data)
        }),
        impact,
        touches: course.touches,
        audit,
        ball_end: course.ball_end,
        record,
    })
}

/// What happened from a trial's start to its end.
struct Course {
    touches: Vec<Impact>,
    finished: bool,
    fell_at: Option<f64>,
    peaks: Vec<JointPeak>,
    ball_end: [f64; 3],
}

impl Course {
    /// Ball's velocity as it leaves the robot for good, m/s.
    fn leaving(&self) -> Option<Vector3<f64>> {
        self.touches.last().map(|touch| Vector3::from(touch.ball_velocity))
    }

    fn outcome(&self, direction: f64) -> Outcome {
        let leaving = self.leaving();
        Outcome {
            ball_speed: leaving.map(|v| v.norm()),
            direction_error: leaving.map(|v| wrap(v.y.atan2(v.x) - direction)),
            upright: self.fell_at.is_none(),
        }
    }
}

/// Runs one trial in the world's present steps, from the start to the end.
fn follow(
    world: &mut World,
    settings: &TrialSettings,
    disturbances: &[Disturbance],
    controller: &mut dyn Controller,
    mut record: Option<&mut Record>,
    data: &mut RobotData,
) -> Result<Course, SimError> {
    let tick = settings.world.step.tick;
    let whole = |time: f64| (time / tick).round().max(1.0) as usize;
    let (ticks, period) = (whole(settings.duration), whole(settings.control_period));

    world.reset(&settings.q, &settings.v, &settings.ball)?;
    if let Some((what, depth)) = world.ball_overlap() {
        let [x, y, z] = settings.ball.position;
        return Err(SimError::State {
            found: format!("the ball at ({x:.3}, {y:.3}, {z:.3}) m is {depth:.3} m inside {what}"),
            expected: "a ball that touches neither robot nor ground".into(),
        });
    }
    let mut suite = SensorSuite::new(world, settings.seed);
    suite.sense(world);
    let mut sensors = Sensors::default();
    let mut command = JointCommand::zeros(world.robot().joints.len());
    let mut watch = ImpactWatch::new();
    let mut fall = FallWatch::default();
    if let Some(record) = record.as_deref_mut() {
        record.push(world);
    }
    for step in 0..ticks {
        if step % period == 0 {
            suite.read_into(world.time(), &mut sensors);
            controller.tick(&sensors, &mut command);
        }
        for disturbance in disturbances {
            match *disturbance {
                Disturbance::Push { time, duration, force } => {
                    if step == whole(time) {
                        world.push(force);
                    } else if step == whole(time + duration) {
                        world.push([0.0; 3]);
                    }
                }
                Disturbance::MoveBall { time, ref ball } => {
                    if step == whole(time) {
                        world.place_ball(ball);
                    }
                }
            }
        }
        world.advance(&command, Some(&mut watch))?;
        suite.sense(world);
        fall.look(world);
        if let Some(record) = record.as_deref_mut() {
            record.push(world);
        }
    }
    if let Some(record) = record {
        record.steps = world.take_steps();
    }
    let (finished, ball_end, peaks) = (watch.is_free(world.time()), world.ball().position, world.peaks().to_vec());
    Ok(Course { touches: watch.touches(world, data), finished, fell_at: fall.fell_at, peaks, ball_end })
}

/// Angle in (-pi, pi].
fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// The leg that a link belongs to.
fn kicking_side(robot: &Robot, link: &str) -> Option<Side> {
    [Side::Left, Side::Right].into_iter().find(|&side| {
        let leg = robot.leg(side);
        leg.strike.iter().any(|&geom| {
            let body = usize::try_from(robot.model().geom_bodyid()[geom]).unwrap_or(0);
            robot.link_name(body) == link
        })
    })
}

/// Watches for a fall: the body on the ground, the base too low or tilted too far.
#[derive(Default)]
struct FallWatch {
    fell_at: Option<f64>,
}

impl FallWatch {
    fn look(&mut self, world: &World) {
        if self.fell_at.is_some() {
            return;
        }
        if has_fallen(world) {
            self.fell_at = Some(world.time());
        }
    }
}

/// Whether the robot lies: see [`crate::View::has_fallen`].
#[must_use]
pub fn has_fallen(world: &World) -> bool {
    world.on(0).has_fallen()
}

impl Record {
    fn push(&mut self, world: &World) {
        self.times.push(world.time());
        self.q.extend_from_slice(world.q());
        self.v.extend_from_slice(world.v());
        self.torques.extend_from_slice(world.torques());
        let mut forces = vec![Vector3::zeros(); world.robot().contacts.len()];
        world.contact_forces_into(&mut forces);
        self.contact_forces.extend(forces.iter().flat_map(|force| [force.x, force.y, force.z]));
        self.ball.push(world.ball());
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Row `i` of one of the flat arrays.
    #[must_use]
    pub fn row<'a>(&self, values: &'a [f64], i: usize) -> &'a [f64] {
        let width = values.len() / self.len().max(1);
        &values[i * width..(i + 1) * width]
    }

    /// Longest horizontal way of a contact point of the `support` foot while it stayed loaded, m.
    fn slip(&self, robot: &Robot, support: Side, data: &mut RobotData) -> f64 {
        let mut since: Vec<Option<Vector3<f64>>> = vec![None; robot.contacts.len()];
        let mut longest: f64 = 0.0;
        for i in 0..self.len() {
            data.set_position(self.row(&self.q, i));
            let forces = self.row(&self.contact_forces, i);
            for (c, contact) in robot.contacts.iter().enumerate().filter(|(_, contact)| contact.leg == support) {
                if forces[3 * c + 2] < LOADED {
                    since[c] = None;
                    continue;
                }
                let now = data.point(&contact.at);
                let start = since[c].get_or_insert(now);
                longest = longest.max((now - *start).xy().norm());
            }
        }
        longest
    }

    /// Peak forward speeds of pelvis, thigh, shank, foot and toe in the half second before the impact and 0.1 s after.
    fn segment_peaks(
        &self,
        robot: &Robot,
        side: Side,
        impact: f64,
        direction: f64,
        data: &mut RobotData,
    ) -> Vec<SegmentPeak> {
        let leg = robot.leg(side);
        let forward = Vector3::new(direction.cos(), direction.sin(), 0.0);
        let mut links = vec![("pelvis", robot.base), ("thigh", leg.thigh), ("shank", leg.shank), ("foot", leg.foot)];
        links.extend(leg.toe_link.map(|toe| ("toe", toe)));
        let mut peaks: Vec<SegmentPeak> =
            links.iter().map(|(segment, _)| SegmentPeak { segment, speed: f64::NEG_INFINITY, time: 0.0 }).collect();
        for i in (0..self.len()).filter(|&i| (impact - 0.5..=impact + 0.1).contains(&self.times[i])) {
            data.set_state(self.row(&self.q, i), self.row(&self.v, i));
            for (peak, (_, link)) in peaks.iter_mut().zip(&links) {
                let centre = LinkPoint { link: *link, point: robot.model().body_ipos()[*link].into() };
                let speed = data.point_velocity(&centre).dot(&forward);
                if speed > peak.speed {
                    (peak.speed, peak.time) = (speed, self.times[i]);
                }
            }
        }
        peaks
    }
}

fn group_peaks(robot: &Robot, peaks: &[JointPeak]) -> Vec<GroupPeak> {
    let mut groups = Vec::with_capacity(robot.groups.len());
    for (g, group) in robot.groups.iter().enumerate() {
        let members = || robot.joints.iter().zip(peaks).filter(|(joint, _)| joint.group == g);
        let torque = members().max_by(|a, b| (a.1.torque / a.0.torque).total_cmp(&(b.1.torque / b.0.torque)));
        let speed = members().max_by(|a, b| (a.1.speed / a.0.speed).total_cmp(&(b.1.speed / b.0.speed)));
        let Some(((torque_joint, torque), (speed_joint, speed))) = torque.zip(speed) else { continue };
        groups.push(GroupPeak {
            group: group.clone(),
            torque_joint: torque_joint.name.clone(),
            torque: torque.torque,
            torque_limit: torque_joint.torque,
            speed_joint: speed_joint.name.clone(),
            speed: speed.speed,
            speed_limit: speed_joint.speed,
        });
    }
    groups
}

fn violations(robot: &Robot, peaks: &[JointPeak]) -> Vec<LimitViolation> {
    let mut found = Vec::new();
    for (joint, peak) in robot.joints.iter().zip(peaks) {
        let mut add = |quantity, peak, limit, time| {
            found.push(LimitViolation { joint: joint.name.clone(), quantity, peak, limit, time });
        };
        if peak.torque > joint.torque * (1.0 + 1e-9) {
            add("torque", peak.torque, joint.torque, peak.torque_time);
        }
        if peak.speed > joint.speed * (1.0 + SPEED_TOLERANCE) {
            add("speed", peak.speed, joint.speed, peak.speed_time);
        }
    }
    found
}

#[cfg(test)]
mod tests;
