//! The engine `dynamic`: a kick toward any direction from any ball place in reach, as splines of the kicking foot and
//! the trunk in the support foot's frame, stabilised by foot pressure and inertial sensor.
//!
//! Source: Bormann, Engelke, Sell, Developing a reactive and dynamic kicking engine for humanoid robots (paper 2), and
//! its section 6, future work: phase times come from distances and limits, unreachable requests are refused before the
//! robot moves, self-collision is avoided, the inertial sensor and the robot's dynamics are used. Ours beyond the
//! paper: both feet and three faces are forecast and the best wins; feed-forward torques by inverse dynamics; a cancel
//! in any phase leads back to the stand; a ball that moves during the wind-up is followed, rolling or not.
//!
//! It does not walk, does not recover from a fall, and knows no obstacle but the robot itself.

mod follow;
mod motion;
mod plan;
mod settings;

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};

use crate::KickError;
use crate::ball::BallModel;
use crate::derive::{Build, Derive};
use crate::engine::{KickEngine, KickPlan, KickStatus, Phase, Progress};
use crate::request::{KickRequest, Place, Refusal};
use crate::settings::Settings;
use crate::stand::{self, Standing};
use crate::whole_body::body::Body;
use crate::whole_body::drive::{Drive, Footing, Wanted, pressure};
use crate::whole_body::forecast::{judge, miss};
use crate::whole_body::motion::{Motion, goals};
use crate::whole_body::timeline::Course;
use crate::whole_body::torque::Dynamics;
use crate::whole_body::watch::Watch;
use follow::Follow;
use instep_robot::ik::{Ik, Weights};
use instep_robot::tree::TreePose;
use motion::Stroke;
pub(crate) use motion::THROUGH;
use plan::Planner;

pub use crate::whole_body::{Feedback, Limits, Pid, Stance, Times};
pub use settings::{Accuracy, DynamicSettings, Swing};

/// Weight of the swing foot's roll in inverse kinematics, 1/rad: a leg that swings to the side need not keep its sole level.
const LEAN: f64 = 0.3;
/// Damping of inverse kinematics: more than elsewhere, so that what weighs little does not move the joints quickly.
const DAMPING: f64 = 0.1;
/// Steps of inverse kinematics in a check of a new stroke.
const PROBE_STEPS: usize = 10;

/// The dynamic kick engine of one robot.
#[derive(Debug)]
pub struct DynamicKick {
    body: Body,
    settings: DynamicSettings,
    planner: Planner,
    drive: Drive,
    motion: Motion,
    stroke: Option<Stroke>,
    /// What was asked last, and what came of it.
    planned: Option<(KickRequest, KickPlan)>,
    /// The motion's own time, s; it stands still while the foot is held.
    clock: f64,
    course: Course,
    /// The swing foot went down early because the robot tipped toward it.
    caught: bool,
    follow: Option<Follow>,
    /// Scratch of the follower's checks.
    ik: Ik,
    probe: TreePose,
    probe_angles: Vec<f64>,
}

impl DynamicKick {
    /// The engine for `robot` with `settings`.
    ///
    /// # Errors
    /// When a setting cannot be or does not fit the robot.
    pub fn new(robot: Arc<Robot>, ball: BallModel, settings: DynamicSettings) -> Result<Self, KickError> {
        settings.validate()?;
        let ik = Ik::new(&robot, &settings.coupled, settings.limits.joint_margin, settings.limits.knee_bend)?
            .with_weights(Weights { roll: LEAN, damping: DAMPING, ..Weights::default() });
        let dynamics = || Dynamics::new(&robot, &settings.coupled);
        let body = Body::new(Arc::clone(&robot), ball, &settings.arms)?;
        Ok(Self {
            planner: Planner::new(&body, &settings, ik.clone(), dynamics()),
            drive: Drive::new(&body, ik.clone(), dynamics(), pressure(settings.feedback)),
            motion: Motion::standing(&body, Side::Right),
            stroke: None,
            planned: None,
            clock: 0.0,
            course: Course::idle(),
            caught: false,
            follow: None,
            probe: body.tree.pose(),
            probe_angles: body.angles.clone(),
            ik,
            body,
            settings,
        })
    }

    /// The engine for `robot` with the ball and the settings in its folder.
    ///
    /// # Errors
    /// As [`BallModel::load`], [`Derive::of_folder`] and [`DynamicKick::new`].
    pub fn load(robot: Arc<Robot>) -> Result<Self, KickError> {
        let folder = robot.folder().to_owned();
        let ball = BallModel::load(&folder)?;
        let settings = DynamicSettings::of_folder(&Build::of(&robot, &ball), &folder)?;
        Self::new(robot, ball, settings)
    }

    /// Its settings.
    #[must_use]
    pub fn settings(&self) -> &DynamicSettings {
        &self.settings
    }

    /// The ball that it plays.
    #[must_use]
    pub fn ball(&self) -> &BallModel {
        &self.body.ball
    }

    /// Where the base link's ground projection is in the footprint frame while the robot stands, m: turns a
    /// [`instep_robot::control::BallObservation`] into a request.
    #[must_use]
    pub fn footprint_from_base(&self) -> [f64; 2] {
        // Seen from the left support foot the base is at -sole.
        let sole = &self.body.robot.leg(Side::Left).sole;
        let mut pose = self.body.tree.pose();
        self.body.tree.update(&self.body.angles, &mut pose);
        let at = pose.rotation[sole.link].transpose() * (-pose.point(sole));
        [at.x, at.y + self.body.half_width]
    }

    /// The planned centre of pressure in the support sole's frame, m.
    #[must_use]
    pub fn planned(&self) -> [f64; 2] {
        self.drive.planned_cop
    }

    /// The ball of `request` as the support foot of `swing` has it.
    fn watch(&self, swing: Side, request: &KickRequest, sensors: &Sensors) -> Watch {
        let place = self.body.support_from_footprint(swing, request.ball).into();
        Watch::new(place, request.ball_velocity.into(), sensors.time)
    }

    /// Follows a ball that is seen to move during the wind-up; `ahead` (s) is the time of the newest sample.
    fn follow(&mut self, sensors: &Sensors, ahead: f64) {
        let (Some(mut follow), Some(stroke)) = (self.follow, self.stroke) else { return };
        let time = self.clock + ahead;
        let phase = self.motion.timeline.phase(time);
        if self.course.status() == KickStatus::Cancelling || !self.course.running() || phase > Phase::WindUp {
            self.follow = None;
            return;
        }
        let swing = stroke.swing;
        if let Some(ball) = sensors.ball {
            follow.see(ball.time, self.body.sighted(&self.drive.now, swing, ball.position), &self.body.ball);
        }
        if phase == Phase::WindUp {
            let left = self.motion.contact.unwrap_or(time) - time;
            follow.propose(&stroke, sensors.time + left, &self.body.ball);
            if let Some((candidate, ball, good)) = follow.candidate {
                let places = [candidate.pose(0.0), candidate.windup_pose(), candidate.follow_pose()];
                if good < places.len() {
                    let foot = places[good];
                    let trunk = self.settings.manner().trunk_support(&self.body, swing, candidate.yaw);
                    let goals = goals(&foot, &trunk);
                    if good == 0 {
                        self.probe_angles.copy_from_slice(self.drive.angles());
                        self.body.set_arms(1.0, &mut self.probe_angles);
                    }
                    let Self { body, ik, probe, probe_angles, settings, .. } = self;
                    let off = ik.solve(&body.tree, probe, probe_angles, swing, &goals, PROBE_STEPS);
                    let fine = judge(body, &settings.limits, probe, swing, Place::Way, miss(&off, 0.0)).is_ok();
                    follow.candidate = fine.then_some((candidate, ball, good + 1));
                } else {
                    self.motion = motion::retargeted(&self.motion, &self.body, &self.settings, time, &candidate);
                    self.stroke = Some(candidate);
                    follow.accept(ball);
                }
            }
        }
        self.follow = Some(follow);
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
}

impl Controller for DynamicKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let dt = self.settings.control_period;
        // The newest sample is one and a half periods ahead, so that the middle one is half a period ahead.
        let ahead = 1.5 * dt;
        if self.course.turns_back() {
            self.motion = self.motion.cancelled(&self.body, &self.settings.manner(), self.clock + ahead, 1.0);
        }
        self.follow(sensors, ahead);
        if self.course.running() {
            let waits = self.course.hold && self.clock + ahead >= self.motion.timeline.end_of(Phase::WindUp) - 1e-9;
            self.course.step(waits);
            if !waits {
                self.clock += dt;
            }
            if self.clock >= self.motion.timeline.end() {
                self.course.finish();
            }
        }
        let time = self.clock + ahead;
        self.catch(sensors, time);
        let footing = Footing {
            swing: self.motion.swing,
            both: self.motion.timeline.both_feet(self.clock),
            active: self.course.running(),
        };
        let newest = Wanted { goals: self.motion.goals(time), arms: self.motion.arms(time) };
        self.drive.tick(&self.body, footing, &newest, dt, sensors, command);
    }
}

impl KickEngine for DynamicKick {
    fn name(&self) -> &'static str {
        "dynamic"
    }

    fn control_period(&self) -> f64 {
        self.settings.control_period
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        if self.course.running() {
            // A goal that says only where the ball is now is followed (paper 2, section 4.1).
            let planned = self.planned.ok_or(Refusal::Busy)?;
            self.update(request, sensors)?;
            return Ok(planned.1);
        }
        self.body.check_standing(sensors, self.settings.limits.stand)?;
        let planned = self.planner.plan(&self.body, &self.settings, request)?;
        self.planned = Some((*request, planned.plan));
        self.motion = planned.motion;
        self.stroke = Some(planned.stroke);
        self.clock = 0.0;
        let swing = planned.stroke.swing;
        let follows = self.settings.feedback.on && self.settings.feedback.follow_ball;
        let watch = self.watch(swing, request, sensors);
        self.follow = follows.then(|| Follow::new(planned.stroke.ball, watch));
        self.course = Course::started(request.hold);
        self.caught = false;
        self.drive.start(&self.body, swing, &self.body.angles, self.settings.control_period, true);
        Ok(planned.plan)
    }

    fn update(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<(), Refusal> {
        request.check()?;
        if !self.course.running() {
            return Err(Refusal::NoKick);
        }
        if !self.planned.is_some_and(|(planned, _)| planned.differs_by_ball(request)) {
            return Err(Refusal::Busy);
        }
        let watch = self.watch(self.motion.swing, request, sensors);
        self.follow.as_mut().ok_or(Refusal::Struck)?.told(watch);
        Ok(())
    }

    fn where_to_stand(&mut self, request: &KickRequest) -> Option<Standing> {
        let Self { planner, body, settings, .. } = self;
        stand::nearest(body, request, |asked| planner.plan(body, settings, asked).is_ok())
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
}
