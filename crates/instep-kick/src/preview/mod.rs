//! The engine `preview`: balances on one foot by preview control of the zero-moment point and kicks along two cubics
//! through a via point.
//!
//! Source: paper 5 (a ZMP-based preview kick engine tuned by CMA-ES). [`zmp`] estimates the zero-moment point (5), (7) by a
//! Kalman filter; [`regulator`] is the preview controller with gains by [`riccati`]; [`two_link`] is the paper's placement
//! of the centre of mass (8)-(11), beside that of the whole body's inverse kinematics, which is the default; [`stroke`]
//! lays the via-point curve (12); `plan` chooses foot and face and forecasts the motion.
//!
//! Ours beyond the paper: the reference of the zero-moment point goes over to the support foot and back, and is corrected
//! for the swinging leg by inverse dynamics before the kick; unreachable requests are refused with a cause; feed-forward
//! torques; a cancel in any phase; weaker kicks than the tuned one. It does not walk, does not recover from a fall, does
//! not follow a ball that is moved during the kick (a rolling one is forecast), and knows no obstacle but the robot.

mod motion;
mod plan;
pub mod regulator;
pub mod riccati;
mod settings;
pub mod stroke;
pub mod two_link;
pub mod zmp;

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::Robot;
use instep_robot::control::{Controller, JointCommand, Sensors};
use instep_robot::drive::tell;
use nalgebra::Vector3;

use crate::KickError;
use crate::ball::BallModel;
use crate::derive::{Build, Derive};
use crate::engine::{KickEngine, KickPlan, Phase, Progress};
use crate::request::{KickRequest, Refusal};
use crate::settings::Settings;
use crate::stand::{self, Standing};
use crate::whole_body::balance::Balance;
use crate::whole_body::body::Body;
use crate::whole_body::drive::{Footing, STEADY_TILT, inertial, inside, tilt, turn_ankles};
use crate::whole_body::timeline::Course;
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::{Goals, Ik, Residual};
use instep_robot::tree::{Tree, TreePose};
use motion::{Motion, zmp_stand};
use plan::Planner;
use regulator::Regulator;
use two_link::TwoLink;
use zmp::{Filter, Measured, measure};

pub use settings::{Com, Gains, Kick, PreviewSettings, Stabiliser, Swing, Weights};

/// Steps of inverse kinematics in a tick: to the newest sample, and from there to the one that is commanded.
const TICK_STEPS: [usize; 2] = [2, 1];
/// Longest way back to the stand for which room is kept, s.
const WAY_BACK: f64 = 12.0;

/// How the centre of mass is put to its place.
#[derive(Debug, Clone)]
pub(crate) enum Placer {
    General(Box<Ik>),
    TwoLink(Box<TwoLink>),
}

impl Placer {
    fn new(body: &Body, settings: &PreviewSettings) -> Result<Self, KickError> {
        let (coupled, limits) = (&settings.coupled, &settings.limits);
        Ok(match settings.com {
            Com::General => {
                Self::General(Box::new(Ik::new(&body.robot, coupled, limits.joint_margin, limits.knee_bend)?))
            }
            Com::TwoLink => {
                Self::TwoLink(Box::new(TwoLink::new(body, coupled, limits.joint_margin, limits.knee_bend)?))
            }
        })
    }

    /// As [`Ik::solve`].
    pub(crate) fn solve(
        &mut self,
        tree: &Tree,
        pose: &mut TreePose,
        angles: &mut [f64],
        swing: Side,
        goals: &Goals,
        steps: usize,
    ) -> Residual {
        match self {
            Self::General(ik) => ik.solve(tree, pose, angles, swing, goals, steps),
            Self::TwoLink(arm) => arm.solve(tree, pose, angles, swing, goals, steps),
        }
    }
}

/// What the engine wants and believes, in the support sole's frame, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Balanced {
    /// Reference of the zero-moment point.
    pub reference: [f64; 2],
    /// Wanted centre of mass.
    pub com: [f64; 2],
    /// Zero-moment point of the planned joint trajectory, by inverse dynamics.
    pub planned: [f64; 2],
    /// Zero-moment point by the filter.
    pub estimated: [f64; 2],
    /// Centre of mass by the filter.
    pub estimated_com: [f64; 2],
    /// How far the planned pose's centre of mass is from the wanted one: the error of the placement.
    pub placement: f64,
}

/// The preview kick engine of one robot.
#[derive(Debug)]
pub struct PreviewKick {
    body: Body,
    settings: PreviewSettings,
    planner: Planner,
    placer: Placer,
    regulator: Regulator,
    filters: [Filter; 2],
    dynamics: Dynamics,
    balance: Balance,
    /// Planned pose of the newest sample, of the middle one, the one that is commanded, and the measured one.
    pose: TreePose,
    now: TreePose,
    held: TreePose,
    seen: TreePose,
    angles: Vec<f64>,
    held_angles: Vec<f64>,
    motion: Motion,
    /// Reference of the zero-moment point, one entry a sample; the last holds for ever.
    reference: Vec<[f64; 2]>,
    /// The newest sample, one and a half periods ahead of the clock.
    sample: usize,
    /// The preview controller's states of the newest sample and of the two before, x and y.
    states: [[Vector3<f64>; 2]; 3],
    /// The jerks that led to the newest sample and to the one before.
    jerks: [[f64; 2]; 2],
    course: Course,
    balanced: Balanced,
}

impl PreviewKick {
    /// The engine for `robot` with `ball` and `settings`.
    ///
    /// # Errors
    /// When a setting cannot be or does not fit the robot.
    pub fn new(robot: Arc<Robot>, ball: BallModel, settings: PreviewSettings) -> Result<Self, KickError> {
        settings.validate()?;
        let body = Body::new(Arc::clone(&robot), ball, &settings.arms)?;
        let placer = Placer::new(&body, &settings)?;
        let dt = settings.control_period;
        let height = body.stand(Side::Right).com.z - settings.stance.crouch;
        let weights = &settings.regulator;
        let count = (weights.horizon / dt).round().max(1.0) as usize;
        let regulator = Regulator::new(dt, height, (weights.q, weights.r), count)?;
        let filter = Filter::new(dt, height, &settings.trust, 0.0)?;
        let planner = Planner::new(&body, &settings, placer.clone(), Dynamics::new(&robot, &settings.coupled));
        let mut dynamics = Dynamics::new(&robot, &settings.coupled);
        let mut pose = body.tree.pose();
        body.tree.update(&body.angles, &mut pose);
        dynamics.fill(&body, Side::Left, &body.angles, &pose);
        let angles = body.angles.clone();
        let mut engine = Self {
            motion: Motion::standing(&body, Side::Right),
            balance: Balance::new(settings.balance()),
            planner,
            placer,
            regulator,
            filters: [filter; 2],
            dynamics,
            now: pose.clone(),
            held: pose.clone(),
            seen: pose.clone(),
            pose,
            held_angles: angles.clone(),
            angles,
            reference: Vec::new(),
            sample: 0,
            states: [[Vector3::zeros(); 2]; 3],
            jerks: [[0.0; 2]; 2],
            course: Course::idle(),
            balanced: Balanced::default(),
            body,
            settings,
        };
        engine.start(Motion::standing(&engine.body, Side::Right), true);
        Ok(engine)
    }

    /// The engine for `robot` with the ball and the settings in its folder.
    ///
    /// # Errors
    /// As [`BallModel::load`], [`Derive::of_folder`] and [`PreviewKick::new`].
    pub fn load(robot: Arc<Robot>) -> Result<Self, KickError> {
        let folder = robot.folder().to_owned();
        let ball = BallModel::load(&folder)?;
        let settings = PreviewSettings::of_folder(&Build::of(&robot, &ball), &folder)?;
        Self::new(robot, ball, settings)
    }

    /// Its settings.
    #[must_use]
    pub fn settings(&self) -> &PreviewSettings {
        &self.settings
    }

    /// What it wanted and believed in the last tick.
    #[must_use]
    pub fn balanced(&self) -> Balanced {
        self.balanced
    }

    /// Starts `motion` from the stand.
    fn start(&mut self, motion: Motion, standing: bool) {
        let dt = self.settings.control_period;
        let count = (motion.timeline.end() / dt).ceil() as usize + 1;
        let room = count + (WAY_BACK / dt) as usize;
        self.motion = motion;
        self.sample = 0;
        self.reference.clear();
        self.reference.reserve(room);
        let correction = if standing { &[][..] } else { &self.planner.correction };
        self.reference.extend((0..count).map(|i| {
            let zmp = motion.zmp(i as f64 * dt);
            let off = correction.get(i).copied().unwrap_or_default();
            [zmp[0] - off[0], zmp[1] - off[1]]
        }));
        let com = zmp_stand(&self.body, motion.swing);
        self.states = [com.map(|at| Vector3::new(at, 0.0, 0.0)); 3];
        self.jerks = [[0.0; 2]; 2];
        for (filter, at) in self.filters.iter_mut().zip(com) {
            filter.reset(at);
        }
        self.balance = Balance::new(self.settings.balance());
        self.angles.copy_from_slice(&self.body.angles);
        self.held_angles.copy_from_slice(&self.body.angles);
        self.body.tree.update(&self.angles, &mut self.now);
        self.pose.clone_from(&self.now);
        self.dynamics.fill(&self.body, motion.swing.other(), &self.angles, &self.now);
        self.balanced.planned = self.dynamics.solve(&self.body, motion.swing, &self.now, dt, true);
    }

    /// Gives the kick up: the reference is written anew from the next sample on, without the correction.
    fn turn_back(&mut self) {
        let dt = self.settings.control_period;
        self.motion = self.motion.cancelled(&self.body, &self.settings, self.time());
        if self.motion.contact.is_some() {
            // After the kick it goes on as planned.
            return;
        }
        self.reference.truncate(self.sample + 1);
        let count = (self.motion.timeline.end() / dt).ceil() as usize + 1;
        while self.reference.len() < count.min(self.reference.capacity()) {
            self.reference.push(self.motion.zmp(self.reference.len() as f64 * dt));
        }
        if let Some(last) = self.reference.last_mut() {
            *last = zmp_stand(&self.body, self.motion.swing);
        }
    }

    /// The newest sample's time, s.
    fn time(&self) -> f64 {
        self.sample as f64 * self.settings.control_period
    }

    /// The motion's time, s: it stands still while the foot is held.
    fn clock(&self) -> f64 {
        self.time() - 1.5 * self.settings.control_period
    }

    /// Whether the foot waits at the retraction point; moves the course and the clock on.
    fn pass(&mut self) -> bool {
        if !self.course.running() {
            return false;
        }
        let waits = self.course.hold && self.time() >= self.motion.timeline.end_of(Phase::WindUp) - 1e-9;
        self.course.step(waits);
        if !waits {
            self.sample += 1;
        }
        if self.clock() >= self.motion.timeline.end() {
            self.course.finish();
        }
        waits
    }

    /// One sample of estimate and preview control; `waits`: the reference stands still.
    fn control(&mut self, measured: &Measured, waits: bool) {
        let dt = self.settings.control_period;
        let last = if waits { self.sample } else { self.reference.len() - 1 }.min(self.reference.len() - 1);
        let follows = self.settings.has(Stabiliser::Preview) && self.course.running();
        let mut next = self.states[0];
        for axis in 0..2 {
            // What is measured now belongs to the sample before the last.
            let filter = &mut self.filters[axis];
            filter.step(self.jerks[1][axis], measured.com.map(|at| at[axis]), measured.zmp.map(|at| at[axis]));
            let state = &mut next[axis];
            if follows {
                let share = (self.settings.feedback.preview * dt).min(1.0);
                let off = filter.state() - self.states[2][axis];
                state.x += share * off.x;
                state.y += share * off.y;
            }
            let from = self.sample.saturating_sub(1);
            let jerk = self.regulator.jerk(state, |i| self.reference[(from + i).min(last)][axis]);
            *state = self.regulator.advance(state, jerk);
            self.jerks[1][axis] = self.jerks[0][axis];
            self.jerks[0][axis] = jerk;
        }
        self.states = [next, self.states[0], self.states[1]];
        let now = self.states[1];
        self.balanced.reference = self.motion.zmp(self.time() - dt);
        self.balanced.com = [now[0].x, now[1].x];
        self.balanced.estimated = [self.filters[0].zmp(), self.filters[1].zmp()];
        self.balanced.estimated_com = [self.filters[0].state().x, self.filters[1].state().x];
    }
}

impl Controller for PreviewKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let dt = self.settings.control_period;
        if self.course.turns_back() {
            self.turn_back();
        }
        let waits = self.pass();
        let swing = self.motion.swing;
        let active = self.course.running();
        let footing = Footing { swing, both: self.motion.timeline.both_feet(self.clock()), active };
        let measured = measure(&self.body.robot, &self.body.tree, sensors, swing.other(), &mut self.seen);
        self.control(&measured, waits);

        // The plan, without feedback: its differences give speeds and torques that feedback must not shake.
        let time = self.time();
        let [newest, now, _] = self.states;
        let goals = self.motion.goals(time, [newest[0].x, newest[1].x]);
        self.body.set_arms(self.motion.arms(time), &mut self.angles);
        let residual =
            self.placer.solve(&self.body.tree, &mut self.pose, &mut self.angles, swing, &goals, TICK_STEPS[0]);
        self.balanced.placement = residual.balance;
        self.dynamics.push(&self.body, swing.other(), &self.angles, &self.pose);
        self.body.tree.update(self.dynamics.angles(), &mut self.now);
        self.balanced.planned = self.dynamics.solve(&self.body, swing, &self.now, dt, footing.both);

        // The plan of the middle sample, shifted by the closed loop.
        let tilt = tilt(&self.body, &self.now, swing, sensors);
        let estimated = measured.zmp.map(|_| self.balanced.estimated);
        let steady = tilt.norm() < STEADY_TILT && estimated.is_none_or(|at| inside(&self.body, at, swing.other()));
        let shift = self.balance.shift(estimated, self.balanced.planned, (active, steady), dt);
        self.held_angles.copy_from_slice(self.dynamics.angles());
        if shift != [0.0; 2] {
            let middle = if waits { time } else { time - dt };
            let goals = self.motion.goals(middle, [now[0].x + shift[0], now[1].x + shift[1]]);
            let steps = TICK_STEPS[1];
            self.placer.solve(&self.body.tree, &mut self.held, &mut self.held_angles, swing, &goals, steps);
        }
        command.positions.copy_from_slice(&self.held_angles);
        command.velocities.copy_from_slice(self.dynamics.speeds());
        command.torques.copy_from_slice(&self.dynamics.torques);
        let moment = inertial(&self.body, &self.balance, swing, &tilt, sensors);
        turn_ankles(&self.body, &self.now, &footing, &moment, command);
        tell(&self.body.robot, command);
    }
}

impl KickEngine for PreviewKick {
    fn name(&self) -> &'static str {
        "preview"
    }

    fn control_period(&self) -> f64 {
        self.settings.control_period
    }

    fn plan(&mut self, request: &KickRequest, sensors: &Sensors) -> Result<KickPlan, Refusal> {
        if self.course.running() {
            return Err(Refusal::Busy);
        }
        self.body.check_standing(sensors, self.settings.limits.stand)?;
        let planned = self.planner.plan(&self.body, &self.settings, &self.regulator, request)?;
        self.start(planned.motion, false);
        self.course = Course::started(request.hold);
        Ok(planned.plan)
    }

    fn where_to_stand(&mut self, request: &KickRequest) -> Option<Standing> {
        let Self { planner, body, settings, regulator, .. } = self;
        stand::nearest(body, request, |asked| planner.plan(body, settings, regulator, asked).is_ok())
    }

    fn release(&mut self) {
        self.course.hold = false;
    }

    fn cancel(&mut self) {
        self.course.cancel();
    }

    fn progress(&self) -> Progress {
        self.course.progress(&self.motion.timeline, self.clock(), self.motion.contact, self.motion.swing)
    }
}
