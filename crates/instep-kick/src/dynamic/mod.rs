//! The engine `dynamic`: a kick toward any direction from any ball place in reach, as splines of the kicking foot and
//! the trunk in the support foot's frame, stabilised by foot pressure and inertial sensor.
//!
//! Source: Bormann, Engelke, Sell, Developing a reactive and dynamic kicking engine for humanoid robots (paper 2), and
//! its section 6, future work: phase times come from distances and limits, unreachable requests are refused before the
//! robot moves, self-collision is avoided, the inertial sensor and the robot's dynamics are used. Ours beyond the
//! paper: both feet and three faces are forecast and the best wins; feed-forward torques by inverse dynamics; a cancel
//! in any phase leads back to the stand; a ball that moves during the wind-up is followed.
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
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::KickError;
use crate::ball::BallModel;
use crate::engine::{KickEngine, KickPlan, KickStatus, Phase, Progress};
use crate::ik::Ik;
use crate::request::{KickRequest, Refusal};
use crate::settings::Settings;
use crate::tree::TreePose;
use crate::whole_body::balance::Balance;
use crate::whole_body::body::Body;
use crate::whole_body::torque::Dynamics;
use follow::Follow;
use motion::{Motion, Stroke};
use plan::Planner;

pub use crate::whole_body::{Feedback, Limits, Pid, Stance};
use crate::whole_body::{body, foot, torque};
pub use settings::{Accuracy, DynamicSettings, Swing, Times};

/// Steps of inverse kinematics in a tick.
const TICK_STEPS: usize = 3;
/// The same in a check of a new stroke.
const PROBE_STEPS: usize = 10;
/// Tilt up to which the support foot counts as flat, rad.
const STEADY_TILT: f64 = 0.04;
/// Distance of the centre of pressure from the foot's edge from which on the foot counts as rocking, m.
const EDGE: f64 = 0.006;
/// Load (share of the weight) from which a foot's centre of pressure counts.
const LOADED: f64 = 0.1;

/// The dynamic kick engine of one robot.
#[derive(Debug)]
pub struct DynamicKick {
    body: Body,
    settings: DynamicSettings,
    planner: Planner,
    ik: Ik,
    dynamics: Dynamics,
    balance: Balance,
    /// Pose of the newest sample, and that of the middle one.
    pose: TreePose,
    now: TreePose,
    angles: Vec<f64>,
    /// The stabilised pose and angles of the middle sample, which are commanded.
    held: TreePose,
    held_angles: Vec<f64>,
    motion: Motion,
    stroke: Option<Stroke>,
    request: Option<KickRequest>,
    /// The motion's own time, s; it stands still while the foot is held.
    clock: f64,
    status: KickStatus,
    hold: bool,
    cancel: bool,
    /// The swing foot went down early because the robot tipped toward it.
    caught: bool,
    planned_cop: [f64; 2],
    follow: Option<Follow>,
    /// Scratch of the follower's checks.
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
        let ik = Ik::new(&robot, &settings.coupled, settings.limits.joint_margin, settings.limits.knee_bend)?;
        let body = Body::new(Arc::clone(&robot), ball, &settings.arms)?;
        let planner = Planner::new(&body, &settings, ik.clone(), Dynamics::new(&robot, &settings.coupled));
        let motion = Motion::standing(&body, Side::Right);
        let mut pose = body.tree.pose();
        body.tree.update(&body.angles, &mut pose);
        let mut dynamics = Dynamics::new(&robot, &settings.coupled);
        dynamics.fill(&body, Side::Left, &body.angles, &pose);
        let angles = body.angles.clone();
        let balance = Balance::new(settings.feedback);
        Ok(Self {
            planner,
            ik,
            dynamics,
            balance,
            now: pose.clone(),
            held: pose.clone(),
            probe: pose.clone(),
            probe_angles: angles.clone(),
            follow: None,
            pose,
            held_angles: angles.clone(),
            angles,
            motion,
            stroke: None,
            request: None,
            clock: 0.0,
            status: KickStatus::Idle,
            hold: false,
            cancel: false,
            caught: false,
            planned_cop: [0.0; 2],
            body,
            settings,
        })
    }

    /// The engine for `robot` with the ball and the settings in its folder.
    ///
    /// # Errors
    /// As [`BallModel::load`], [`DynamicSettings::load`] and [`DynamicKick::new`].
    pub fn load(robot: Arc<Robot>) -> Result<Self, KickError> {
        let folder = robot.folder().to_owned();
        let settings = DynamicSettings::load(&folder)?;
        Self::new(robot, BallModel::load(&folder)?, settings)
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
        self.planned_cop
    }

    /// Follows a ball that is seen to move during the wind-up; `ahead` (s) is the time of the newest sample.
    fn follow(&mut self, sensors: &Sensors, ahead: f64) {
        let (Some(mut follow), Some(stroke)) = (self.follow, self.stroke) else { return };
        let time = self.clock + ahead;
        let phase = self.motion.phase(time);
        if !matches!(self.status, KickStatus::Running | KickStatus::Holding) || phase > Phase::WindUp {
            self.follow = None;
            return;
        }
        let swing = stroke.swing;
        if let Some(ball) = sensors.ball {
            let sole = &self.body.robot.leg(swing.other()).sole;
            let turn = self.now.rotation[sole.link].transpose();
            let base = turn * (-self.now.point(sole));
            let yaw = turn[(1, 0)].atan2(turn[(0, 0)]);
            follow.see(ball.time, [ball.position[0], ball.position[1]], base.xy(), yaw);
        }
        if phase == Phase::WindUp {
            follow.propose(&stroke);
            if let Some((candidate, ball, good)) = follow.candidate {
                let places = [candidate.pose(0.0), candidate.windup_pose(), candidate.follow_pose()];
                if good < places.len() {
                    let foot = places[good];
                    let trunk = motion::trunk_support(&self.body, &self.settings, swing, candidate.yaw);
                    let goals = motion::goals(&foot, &trunk);
                    if good == 0 {
                        self.probe_angles.copy_from_slice(&self.angles);
                        self.body.set_arms(1.0, &mut self.probe_angles);
                    }
                    let tree = &self.body.tree;
                    let residual =
                        self.ik.solve(tree, &mut self.probe, &mut self.probe_angles, swing, &goals, PROBE_STEPS);
                    let limits = &self.settings.limits;
                    let fine =
                        plan::miss(&residual) < limits.reach && tree.least_gap(&self.probe).0 >= limits.clearance;
                    follow.candidate = fine.then_some((candidate, ball, good + 1));
                } else {
                    self.motion = self.motion.retargeted(&self.body, &self.settings, time, &candidate);
                    self.stroke = Some(candidate);
                    follow.accept(ball);
                }
            }
        }
        self.follow = Some(follow);
    }

    fn running(&self) -> bool {
        matches!(self.status, KickStatus::Running | KickStatus::Holding | KickStatus::Cancelling)
    }

    /// Centre of pressure of both feet together in the support sole's frame, m, and the weight they feel, N.
    fn measured(&self, sensors: &Sensors) -> Option<[f64; 2]> {
        let swing = self.motion.swing;
        let mut loads = [0.0; 2];
        for (contact, force) in self.body.robot.contacts.iter().zip(&sensors.contact_forces) {
            loads[contact.leg as usize] += force;
        }
        let least = LOADED * self.body.tree.mass() * 9.81;
        let (mut sum, mut moment) = (0.0, [0.0; 2]);
        let sole = &self.body.robot.leg(swing.other()).sole;
        let turn = self.now.rotation[sole.link].transpose();
        let origin = self.now.point(sole);
        for side in [Side::Left, Side::Right] {
            let load = loads[side as usize];
            let Some(cop) = sensors.centre_of_pressure[side as usize].filter(|_| load > least) else { continue };
            let mut at = *sole;
            if side == swing {
                at = self.body.robot.leg(swing).sole;
            }
            at.point += Vector3::new(cop[0], cop[1], 0.0);
            let point = turn * (self.now.point(&at) - origin);
            sum += load;
            moment[0] += load * point.x;
            moment[1] += load * point.y;
        }
        (sum > least).then(|| moment.map(|m| m / sum))
    }

    /// Whether a centre of pressure is well inside the support foot, toward the swing foot without limit.
    fn inside(&self, at: [f64; 2], support: Side) -> bool {
        let foot = &self.body.feet[support as usize];
        let [back, front] = foot.stand_x;
        let outer = if support == Side::Left { foot.stand_y[1] - at[1] } else { at[1] - foot.stand_y[0] };
        at[0] - back > EDGE && front - at[0] > EDGE && outer > EDGE
    }

    /// How far the base leans from the plan: a rotation vector in the base frame, rad, without yaw.
    fn tilt(&self, sensors: &Sensors) -> Vector3<f64> {
        let [w, x, y, z] = sensors.orientation;
        let measured = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let sole = &self.body.robot.leg(self.motion.swing.other()).sole;
        let up = measured.inverse() * Vector3::z();
        let wanted = self.now.rotation[sole.link] * Vector3::z();
        up.cross(&wanted)
    }

    /// Puts the swing foot down at once when the robot tips toward it after the contact.
    fn catch(&mut self, tilt: &Vector3<f64>, sensors: &Sensors, ahead: f64) {
        let time = self.clock + ahead;
        let swing = self.motion.swing;
        if self.caught
            || !self.settings.feedback.on
            || !matches!(self.motion.phase(time), Phase::MoveBack | Phase::Lower)
        {
            return;
        }
        let fall_time = (self.body.stand(swing).com.z / 9.81).sqrt();
        let lean = -Body::sign(swing) * (tilt.x + fall_time * sensors.gyro[0]);
        // A NaN is no lean.
        if lean > self.settings.feedback.catch {
            self.motion = self.motion.caught(&self.body, &self.settings, time);
            self.caught = true;
        }
    }

    /// The moment of the inertial sensor's loop on the body, in the base frame, N m.
    fn inertial(&self, sensors: &Sensors) -> Vector3<f64> {
        let swing = self.motion.swing;
        let tilt = self.tilt(sensors);
        let rate = Vector3::from(sensors.gyro);
        let com = self.body.stand(swing).com;
        let weight = self.body.tree.mass() * 9.81;
        let foot = &self.body.feet[swing.other() as usize];
        let half = |[low, high]: [f64; 2]| 0.5 * (high - low) * weight;
        self.balance.moment(&tilt, &rate, weight * com.z, [half(foot.stand_y), half(foot.stand_x)])
    }
}

impl Controller for DynamicKick {
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand) {
        let dt = self.settings.control_period;
        // The newest sample is one and a half periods ahead, so that the middle one is half a period ahead.
        let ahead = 1.5 * dt;
        if self.cancel {
            self.cancel = false;
            if self.running() {
                self.motion = self.motion.cancelled(&self.body, &self.settings, self.clock + ahead);
                self.status = KickStatus::Cancelling;
                self.hold = false;
            }
        }
        self.follow(sensors, ahead);
        let waits = self.hold && self.clock + ahead >= self.motion.end_of(Phase::WindUp) - 1e-9;
        if self.running() {
            self.status = match self.status {
                KickStatus::Running if waits => KickStatus::Holding,
                KickStatus::Holding if !waits => KickStatus::Running,
                status => status,
            };
            if !waits {
                self.clock += dt;
            }
            if self.clock >= self.motion.end() {
                self.status =
                    if self.status == KickStatus::Cancelling { KickStatus::Cancelled } else { KickStatus::Finished };
            }
        }

        let swing = self.motion.swing;
        let both = self.motion.both_feet(self.clock);
        let measured = self.measured(sensors);
        let tilt = self.tilt(sensors);
        self.catch(&tilt, sensors, ahead);
        let steady = tilt.norm() < STEADY_TILT && measured.is_none_or(|at| self.inside(at, swing.other()));
        let shift = self.balance.shift(measured, self.planned_cop, (self.running(), steady), dt);
        // The plan, without feedback: its differences give speeds and torques that feedback must not shake.
        let goals = self.motion.goals(self.clock + ahead);
        self.body.set_arms(self.motion.arms(self.clock + ahead), &mut self.angles);
        self.ik.solve(&self.body.tree, &mut self.pose, &mut self.angles, swing, &goals, TICK_STEPS);
        self.dynamics.push(&self.body, swing.other(), &self.angles, &self.pose);
        self.body.tree.update(self.dynamics.angles(), &mut self.now);
        self.planned_cop = self.dynamics.solve(&self.body, swing, &self.now, dt, both);

        // The plan of the middle sample, shifted by the closed loop.
        let mut goals = self.motion.goals(self.clock + 0.5 * dt);
        self.body.set_arms(self.motion.arms(self.clock + 0.5 * dt), &mut self.held_angles);
        goals.balance[0] += shift[0];
        goals.balance[1] += shift[1];
        self.ik.solve(&self.body.tree, &mut self.held, &mut self.held_angles, swing, &goals, TICK_STEPS);
        command.positions.copy_from_slice(&self.held_angles);
        command.velocities.copy_from_slice(self.dynamics.speeds());
        command.torques.copy_from_slice(&self.dynamics.torques);
        // A moment on the body is the opposite of one on the foot, which is what the ankle's torque turns.
        let moment = self.inertial(sensors);
        let feet: &[Side] = if both { &[Side::Left, Side::Right] } else { &[swing.other()] };
        for side in feet {
            let leg = self.body.robot.leg(*side);
            for joint in [leg.ankle_pitch, leg.ankle_roll] {
                command.torques[joint] -= self.now.axis[joint].dot(&moment) / feet.len() as f64;
            }
        }
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
        if self.running() {
            return Err(Refusal::Busy);
        }
        for (joint, (now, stand)) in sensors.joint_positions.iter().zip(&self.body.angles).enumerate() {
            let off = now - stand;
            // Written so that a NaN fails.
            if !matches!(off.abs().partial_cmp(&self.settings.limits.stand), Some(o) if o.is_le()) {
                return Err(Refusal::NotStanding { joint, off });
            }
        }
        let planned = self.planner.plan(&self.body, &self.settings, request)?;
        self.motion = planned.motion;
        self.stroke = Some(planned.stroke);
        self.request = Some(*request);
        self.clock = 0.0;
        let swing = planned.stroke.swing;
        let resting = request.ball_velocity.iter().all(|v| v.abs() < 0.02);
        let target = self.body.support_from_footprint(swing, request.ball).into();
        let follows = self.settings.feedback.on && self.settings.feedback.follow_ball && resting;
        self.follow = follows.then(|| Follow::new(target));
        self.status = KickStatus::Running;
        self.hold = request.hold;
        self.cancel = false;
        self.caught = false;
        self.balance = Balance::new(self.settings.feedback);
        self.angles.copy_from_slice(&self.body.angles);
        self.body.tree.update(&self.angles, &mut self.now);
        self.pose.clone_from(&self.now);
        self.held_angles.copy_from_slice(&self.body.angles);
        self.dynamics.fill(&self.body, planned.stroke.swing.other(), &self.angles, &self.now);
        self.planned_cop =
            self.dynamics.solve(&self.body, planned.stroke.swing, &self.now, self.settings.control_period, true);
        Ok(planned.plan)
    }

    fn release(&mut self) {
        self.hold = false;
    }

    fn cancel(&mut self) {
        self.cancel = true;
    }

    fn progress(&self) -> Progress {
        let end = self.motion.end();
        let over = !self.running();
        Progress {
            status: self.status,
            phase: if over { Phase::Stand } else { self.motion.phase(self.clock) },
            done: if over || end <= 0.0 { 1.0 } else { (self.clock / end).clamp(0.0, 1.0) },
            to_contact: self.motion.contact.filter(|_| !over).map(|contact| contact - self.clock),
            foot: (!over).then_some(self.motion.swing),
        }
    }
}
