//! The engine itself: each tick it looks where the ball will be at the contact, looks the stroke up anew when that has
//! moved, and lays the retraction anew from where the foot is (paper 3: "we calculate the next position of the foot in
//! each cycle by local optimization"). The strike starts only while its foot target fits the ball; otherwise it waits,
//! and breaks off when no stroke fits for too long.
//!
//! A new stroke passes three checks by inverse kinematics, one a tick, so that no tick takes long: target, retraction
//! point, follow-through. First the same part of the foot is tried; where it cannot, all parts of that foot in turn.

use std::path::Path as FilePath;
use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use nalgebra::Vector2;

use crate::KickError;
use crate::adaptive::geometry::{PARTS, Part};
use crate::adaptive::grid::{CELL, Grid};
use crate::adaptive::lookup::{Found, Query, look_up};
use crate::adaptive::motion::{CAREFUL, Stroke, adapted};
use crate::adaptive::plan::{Planner, check, precision, push};
use crate::adaptive::settings::AdaptiveSettings;
use crate::adaptive::{GRID_FILE, grid_hash, parts};
use crate::ball::BallModel;
use crate::derive::{Build, Derive};
use crate::engine::{BreakOff, Face, KickEngine, KickPlan, KickStatus, Phase, Progress};
use crate::request::{KickRequest, Place, Refusal, Strength};
use crate::settings::Settings;
use crate::stand::{self, Standing};
use crate::whole_body::body::Body;
use crate::whole_body::drive::{Drive, Footing, Wanted};
use crate::whole_body::motion::Motion;
use crate::whole_body::timeline::Course;
use crate::whole_body::torque::Dynamics;
use crate::whole_body::watch::Watch;
use instep_robot::ik::Ik;
use instep_robot::tree::TreePose;

/// Distance between the ball and the one of the present stroke from which on another is looked up, m.
const MOVED: f64 = 0.004;
/// The same up to which a stroke may start.
const FITS: f64 = 0.012;
/// The same beyond which a strike under way is given up.
const GONE: f64 = 0.06;
/// Time to the contact under which nothing can be changed any more, s.
const TOO_LATE: f64 = 0.06;
/// Time without a stroke that fits after which the kick is broken off, s.
const LOST: f64 = 0.8;
/// Parts that are looked up in a tick.
const PARTS_A_TICK: usize = 1;
/// Steps of inverse kinematics of a check.
const CHECK_STEPS: usize = 6;
/// Changes of the contact's time that are tried for a rolling ball, s.
const SHIFTS: [f64; 5] = [0.0, 0.06, -0.06, 0.15, -0.15];

/// A stroke under test.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    stroke: Stroke,
    /// Checks passed.
    passed: usize,
}

/// The search among all parts of the foot.
#[derive(Debug, Clone, Copy)]
struct Search {
    /// Ball for which it is made, m.
    ball: Vector2<f64>,
    next: usize,
    best: Option<Found>,
}

/// The best stroke of the grid for a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// The foot that would kick.
    pub foot: Side,
    /// Which part of it would strike.
    pub face: Face,
    /// The forecast g: cosine of the angle between the foot's way and the wanted direction (paper 3, equation 1).
    pub forecast: f64,
    /// Standard deviation of the direction, rad.
    pub precision: f64,
}

/// The adaptive kick engine of one robot.
#[derive(Debug)]
pub struct AdaptiveKick {
    body: Body,
    settings: AdaptiveSettings,
    grid: Arc<Grid>,
    planner: Planner,
    drive: Drive,
    motion: Motion,
    stroke: Option<Stroke>,
    request: Option<KickRequest>,
    planned: Option<KickPlan>,
    watch: Option<Watch>,
    candidate: Option<Candidate>,
    search: Option<Search>,
    /// Time for which no stroke has fitted, s.
    lost: f64,
    /// Time for which the foot has waited retracted, s.
    waited: f64,
    unaimed: bool,
    broken_off: Option<BreakOff>,
    clock: f64,
    course: Course,
    caught: bool,
    /// Scratch of the checks.
    probe: TreePose,
    probe_angles: Vec<f64>,
    ik: Ik,
}

impl AdaptiveKick {
    /// The engine for `robot` with `settings` and the grid that was measured with them.
    ///
    /// # Errors
    /// When a setting cannot be or does not fit the robot, or the grid is another robot's or an older model's.
    pub fn new(
        robot: Arc<Robot>,
        ball: BallModel,
        settings: AdaptiveSettings,
        grid: Arc<Grid>,
    ) -> Result<Self, KickError> {
        settings.validate()?;
        let hash = grid_hash(&robot, &settings);
        if grid.hash() != hash {
            return Err(KickError::OtherGrid { robot: robot.name.clone(), found: grid.hash(), expected: hash });
        }
        let dynamics = Dynamics::new(&robot, &settings.coupled);
        let (body, drive) = parts(robot, ball, &settings)?;
        let planner = Planner::new(&body, &settings, drive.ik.clone(), dynamics);
        Ok(Self {
            planner,
            motion: Motion::standing(&body, Side::Right),
            stroke: None,
            request: None,
            planned: None,
            watch: None,
            candidate: None,
            search: None,
            lost: 0.0,
            waited: 0.0,
            unaimed: false,
            broken_off: None,
            clock: 0.0,
            course: Course::idle(),
            caught: false,
            probe: body.tree.pose(),
            probe_angles: body.angles.clone(),
            ik: drive.ik.clone(),
            drive,
            grid,
            body,
            settings,
        })
    }

    /// The engine for `robot` with the ball, the settings and the grid in its folder.
    ///
    /// # Errors
    /// As [`BallModel::load`], [`Derive::of_folder`], [`load_grid`] and [`AdaptiveKick::new`].
    pub fn load(robot: Arc<Robot>) -> Result<Self, KickError> {
        let folder = robot.folder().to_owned();
        let ball = BallModel::load(&folder)?;
        let settings = AdaptiveSettings::of_folder(&Build::of(&robot, &ball), &folder)?;
        let grid = load_grid(&folder)?;
        Self::new(robot, ball, settings, Arc::new(grid))
    }

    /// Its settings.
    #[must_use]
    pub fn settings(&self) -> &AdaptiveSettings {
        &self.settings
    }

    /// What the grid alone says of `request` with the ball at rest where it is: a fraction of a millisecond, for a caller
    /// that weighs many places to stand before it plans one. `None` where no foot reaches; a plan may still find that a
    /// joint is too slow.
    ///
    /// # Errors
    /// When the request holds a number that cannot be.
    pub fn outlook(&mut self, request: &KickRequest) -> Result<Option<Outlook>, Refusal> {
        request.check()?;
        let ball = (request.ball, [0.0; 2]);
        let found = self.planner.look_up(&self.body, &self.settings, &self.grid, request, ball);
        let best = found.first().map(|(stroke, _)| Outlook {
            foot: stroke.swing,
            face: stroke.face,
            forecast: stroke.forecast,
            precision: precision(&self.settings, stroke),
        });
        Ok(best)
    }

    /// Looks after the ball: another stroke when it has moved, or a break-off. `time` is the motion's at the newest sample.
    fn adapt(&mut self, sensors: &Sensors, time: f64) {
        let (Some(mut watch), Some(stroke), Some(request)) = (self.watch, self.stroke, self.request) else { return };
        let phase = self.motion.timeline.phase(time);
        let kicks = self.course.running() && self.course.status() != KickStatus::Cancelling;
        let Some(contact) = self.motion.contact.filter(|_| kicks) else { return };
        let left = contact - time;
        if phase > Phase::Kick || left < TOO_LATE {
            return;
        }
        let model = self.body.ball;
        if let Some(ball) = sensors.ball {
            watch.see(ball.time, self.body.sighted(&self.drive.now, stroke.swing, ball.position), &model);
        }
        self.watch = Some(watch);
        let (ball, velocity) = watch.at(sensors.time + left, &model);
        let off = (ball - stroke.ball).norm();
        if phase == Phase::Kick {
            if off > GONE {
                self.give_up(BreakOff::BallGone);
            }
            return;
        }
        if off > MOVED {
            self.look_again(time, &stroke, &request, (ball, velocity), &watch, sensors.time + left);
        } else {
            (self.candidate, self.search) = (None, None);
        }
        let off = self.stroke.map_or(f64::INFINITY, |stroke| (ball - stroke.ball).norm());
        let dt = self.settings.control_period;
        self.lost = match phase {
            Phase::WindUp if off > FITS => self.lost + dt,
            _ => 0.0,
        };
        if self.lost > LOST {
            let why = if self.unaimed { BreakOff::Unaimed } else { BreakOff::BallGone };
            self.give_up(why);
        }
    }

    /// Looks for a stroke that fits the ball, a little a tick.
    fn look_again(
        &mut self,
        time: f64,
        stroke: &Stroke,
        request: &KickRequest,
        (ball, velocity): (Vector2<f64>, Vector2<f64>),
        watch: &Watch,
        contact: f64,
    ) {
        if let Some(candidate) = self.candidate.take() {
            self.check(time, candidate);
            return;
        }
        let Self { body, settings, grid, .. } = self;
        let speed = match request.strength {
            Strength::BallSpeed(v) => v,
            _ => 1.0,
        };
        let query = |ball: Vector2<f64>, velocity: Vector2<f64>| {
            let aim = push(request.direction, speed, velocity);
            Query {
                swing: stroke.swing,
                ball,
                direction: aim.y.atan2(aim.x),
                speed: stroke.speed,
                follow: settings.kick.follow,
                retraction: stroke.run().max(settings.kick.retraction[0] + CELL),
            }
        };
        let good = |found: &Found| found.0.forecast >= settings.kick.forecast_least;
        if self.search.is_none_or(|search| (search.ball - ball).norm() > FITS) {
            // A rolling ball may be met a little earlier or later.
            let shifts = if watch.rolls() { &SHIFTS[..] } else { &SHIFTS[..1] };
            for shift in shifts {
                let (ball, velocity) =
                    if *shift == 0.0 { (ball, velocity) } else { watch.at(contact + shift, &body.ball) };
                let found = look_up(body, settings, grid, &query(ball, velocity), &stroke.part, false);
                if let Some((next, _)) = found.filter(good) {
                    let at = if stroke.at > 0.0 { self.motion.contact.unwrap_or(0.0) + shift } else { 0.0 };
                    self.candidate = Some(Candidate { stroke: Stroke { at, pace: stroke.pace, ..next }, passed: 0 });
                    self.search = None;
                    return;
                }
            }
            self.search = Some(Search { ball, next: 0, best: None });
        }
        let Some(search) = &mut self.search else { return };
        let parts = if settings.kick.true_shape { PARTS } else { 1 };
        for _ in 0..PARTS_A_TICK {
            if search.next < parts {
                let found = look_up(body, settings, grid, &query(search.ball, velocity), &Part::of(search.next), false);
                self.unaimed |= found.is_some_and(|found| !good(&found));
                if let Some(found) = found.filter(good)
                    && search.best.is_none_or(|best| found.1 < best.1)
                {
                    search.best = Some(found);
                }
                search.next += 1;
            }
        }
        if search.next >= parts {
            self.candidate = search
                .best
                .take()
                .map(|(next, _)| Candidate { stroke: Stroke { at: stroke.at, pace: stroke.pace, ..next }, passed: 0 });
            search.next = 0;
        }
    }

    /// One check of a stroke; after the last one it is the stroke.
    fn check(&mut self, time: f64, mut candidate: Candidate) {
        let stroke = candidate.stroke;
        if candidate.passed == 0 {
            self.probe_angles.copy_from_slice(self.drive.angles());
            self.body.set_arms(1.0, &mut self.probe_angles);
        }
        let (place, what) = match candidate.passed {
            0 => (stroke.contact, Place::Contact),
            1 => (stroke.retraction, Place::WindUp),
            _ => (stroke.rest(), Place::FollowThrough),
        };
        let scratch = (&mut self.ik, &mut self.probe, &mut self.probe_angles);
        let good = check(&self.body, &self.settings, scratch, &stroke, &place, what, CHECK_STEPS).is_ok();
        let limit = self.settings.limits.hold;
        if !good || self.planner.rehearsal.load(&self.body, stroke.swing, &self.probe_angles, &self.probe).0 > limit {
            return;
        }
        candidate.passed += 1;
        if candidate.passed < 3 {
            self.candidate = Some(candidate);
            return;
        }
        self.motion = adapted(&self.motion, &self.body, &self.settings, time, &stroke);
        self.stroke = Some(stroke);
        self.search = None;
        self.unaimed = false;
    }

    /// Breaks the kick off.
    fn give_up(&mut self, why: BreakOff) {
        self.broken_off = Some(why);
        self.course.cancel();
    }

    /// Puts the swing foot down at once when the robot tips toward it after the contact.
    fn catch(&mut self, sensors: &Sensors, time: f64) {
        let late = matches!(self.motion.timeline.phase(time), Phase::MoveBack | Phase::Lower);
        if self.caught || !self.settings.feedback.on || !late {
            return;
        }
        // A NaN is no lean.
        if self.drive.lean(&self.body, self.motion.swing, sensors) > self.settings.feedback.catch {
            self.motion = self.motion.caught(&self.body, &self.settings.manner(), time);
            self.caught = true;
        }
    }

    /// Whether the foot must stay retracted at `time`: told to, or the ball is not where the stroke wants it.
    fn waits(&mut self, time: f64) -> bool {
        // The newest sample stays before the strike, so that the retraction can still be changed.
        let next = time + self.settings.control_period;
        if next < self.motion.timeline.end_of(Phase::WindUp) || self.motion.timeline.phase(self.clock) > Phase::WindUp {
            return false;
        }
        if self.course.hold {
            return true;
        }
        if self.lost > 0.0 && self.settings.feedback.follow_ball {
            self.waited += self.settings.control_period;
            if self.waited > self.settings.kick.wait {
                self.give_up(BreakOff::Late);
            }
            return true;
        }
        false
    }
}

/// The grid in a robot's folder.
///
/// # Errors
/// When it is missing or not a grid.
pub fn load_grid(folder: &FilePath) -> Result<Grid, KickError> {
    let file = folder.join(GRID_FILE);
    let name = file.display().to_string();
    let bytes = std::fs::read(&file).map_err(|e| KickError::Read {
        file: name.clone(),
        detail: format!("{e}; expected a reachability grid: make it with `instep robot reach`"),
    })?;
    Grid::from_bytes(&name, &bytes)
}

impl Controller for AdaptiveKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let dt = self.settings.control_period;
        // The newest sample is one and a half periods ahead, so that the middle one is half a period ahead.
        let ahead = 1.5 * dt;
        if self.settings.feedback.follow_ball {
            self.adapt(sensors, self.clock + ahead);
        }
        if self.course.turns_back() {
            self.motion = self.motion.cancelled(&self.body, &self.settings.manner(), self.clock + ahead, CAREFUL);
        }
        if self.course.running() {
            let waits = self.course.status() != KickStatus::Cancelling && self.waits(self.clock + ahead);
            self.course.step(waits);
            if !waits {
                self.clock += dt;
            }
            if self.clock >= self.motion.timeline.end() {
                self.course.finish();
            }
        }
        self.catch(sensors, self.clock + ahead);
        let footing = Footing {
            swing: self.motion.swing,
            both: self.motion.timeline.both_feet(self.clock),
            active: self.course.running(),
        };
        let time = self.clock + ahead;
        let newest = Wanted { goals: self.motion.goals(time), arms: self.motion.arms(time) };
        self.drive.tick(&self.body, footing, &newest, dt, sensors, command);
    }
}

impl KickEngine for AdaptiveKick {
    fn name(&self) -> &'static str {
        "adaptive"
    }

    fn control_period(&self) -> f64 {
        self.settings.control_period
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        if self.course.running() {
            // A goal that says only where the ball is now is followed.
            let planned = self.planned.ok_or(Refusal::Busy)?;
            self.update(request, sensors)?;
            return Ok(planned);
        }
        self.body.check_standing(sensors, self.settings.limits.stand)?;
        let planned = self.planner.plan(&self.body, &self.settings, &self.grid, request)?;
        self.planned = Some(planned.plan);
        let swing = planned.stroke.swing;
        let place = self.body.support_from_footprint(swing, request.ball).into();
        self.watch = Some(Watch::new(place, request.ball_velocity.into(), sensors.time));
        self.motion = planned.motion;
        self.stroke = Some(planned.stroke);
        self.request = Some(*request);
        (self.candidate, self.search, self.broken_off) = (None, None, None);
        (self.lost, self.waited, self.clock) = (0.0, 0.0, 0.0);
        self.course = Course::started(request.hold);
        (self.caught, self.unaimed) = (false, false);
        self.drive.start(&self.body, swing, &self.body.angles, self.settings.control_period, true);
        Ok(planned.plan)
    }

    fn update(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<(), Refusal> {
        request.check()?;
        if !self.course.running() {
            return Err(Refusal::NoKick);
        }
        if !self.request.is_some_and(|planned| planned.differs_by_ball(request)) || !self.settings.feedback.follow_ball
        {
            return Err(Refusal::Busy);
        }
        if self.motion.timeline.phase(self.clock) > Phase::WindUp || self.course.status() == KickStatus::Cancelling {
            return Err(Refusal::Struck);
        }
        let place = self.body.support_from_footprint(self.motion.swing, request.ball).into();
        self.watch = Some(Watch::new(place, request.ball_velocity.into(), sensors.time));
        (self.candidate, self.search) = (None, None);
        Ok(())
    }

    fn where_to_stand(&mut self, request: &KickRequest) -> Option<Standing> {
        let Self { planner, body, settings, grid, .. } = self;
        stand::nearest(body, request, |asked| planner.plan(body, settings, grid, asked).is_ok())
    }

    fn release(&mut self) {
        self.course.hold = false;
    }

    fn cancel(&mut self) {
        self.course.cancel();
    }

    fn progress(&self) -> Progress {
        self.course.progress(&self.motion.timeline, self.clock, self.motion.contact, self.motion.swing)
    }

    fn forecast(&self) -> Option<f64> {
        self.stroke.filter(|_| self.course.running()).map(|stroke| stroke.forecast)
    }

    fn broken_off(&self) -> Option<BreakOff> {
        self.broken_off
    }
}
