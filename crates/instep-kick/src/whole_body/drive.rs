//! From where foot and trunk are wanted to joint commands: inverse kinematics, feed-forward torques, and the closed loop
//! that keeps the robot upright; one call a tick, nothing allocated.
//!
//! The commanded pose is the wanted one of the middle of the period, moved by the stabiliser. Speeds and torques are those
//! of the wanted motion without the stabiliser, which must not shake them.

use instep_motion::phase::Side;
use instep_robot::control::{JointCommand, Sensors};
use instep_robot::drive::tell;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::whole_body::balance::Balance;
use crate::whole_body::body::Body;
use crate::whole_body::inclination::Lean;
use crate::whole_body::settings::Feedback;
use crate::whole_body::torque::Dynamics;
use instep_robot::ik::{Goals, Ik};
use instep_robot::tree::TreePose;

/// Steps of inverse kinematics in a tick.
const TICK_STEPS: usize = 3;
/// Tilt up to which the support foot counts as flat, rad.
pub(crate) const STEADY_TILT: f64 = 0.04;
/// Distance of the centre of pressure from the foot's edge from which on the foot counts as rocking, m.
const EDGE: f64 = 0.006;
/// Load (share of the weight) from which a foot's centre of pressure counts.
pub(crate) const LOADED: f64 = 0.1;
/// m/s^2.
pub(crate) const GRAVITY: f64 = 9.81;

/// What keeps the robot upright.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant, reason = "a drive holds one; a box would say nothing more")]
pub(crate) enum Loop {
    /// Centre of pressure and inertial sensor.
    Pressure(Balance),
    /// Body inclination (paper 3, section 2.3).
    Inclination(Lean),
}

/// What is wanted at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wanted {
    pub(crate) goals: Goals,
    /// Share of the arms' way.
    pub(crate) arms: f64,
}

/// How the robot stands in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Footing {
    /// The foot in the air, or to be.
    pub(crate) swing: Side,
    /// Both feet carry.
    pub(crate) both: bool,
    /// A motion is under way.
    pub(crate) active: bool,
}

/// State of one robot's drive.
#[derive(Debug)]
pub(crate) struct Drive {
    pub(crate) ik: Ik,
    dynamics: Dynamics,
    pub(crate) stabiliser: Loop,
    /// Pose and angles of the newest sample, and the pose of the middle one.
    pose: TreePose,
    angles: Vec<f64>,
    pub(crate) now: TreePose,
    /// The stabilised pose and angles of the middle sample, which are commanded.
    held: TreePose,
    held_angles: Vec<f64>,
    /// The middle sample.
    middle: Option<Wanted>,
    pub(crate) planned_cop: [f64; 2],
    sensed: TreePose,
}

impl Drive {
    pub(crate) fn new(body: &Body, ik: Ik, dynamics: Dynamics, stabiliser: Loop) -> Self {
        let mut pose = body.tree.pose();
        body.tree.update(&body.angles, &mut pose);
        let mut drive = Self {
            ik,
            dynamics,
            stabiliser,
            now: pose.clone(),
            held: pose.clone(),
            sensed: pose.clone(),
            pose,
            angles: body.angles.clone(),
            held_angles: body.angles.clone(),
            middle: None,
            planned_cop: [0.0; 2],
        };
        drive.start(body, Side::Right, &body.angles, 0.01, true);
        drive
    }

    /// Starts at rest in the pose with `angles` (rad); `both`: on both feet.
    pub(crate) fn start(&mut self, body: &Body, swing: Side, angles: &[f64], dt: f64, both: bool) {
        self.angles.copy_from_slice(angles);
        self.held_angles.copy_from_slice(angles);
        body.tree.update(angles, &mut self.now);
        self.pose.clone_from(&self.now);
        self.held.clone_from(&self.now);
        self.middle = None;
        match &mut self.stabiliser {
            Loop::Pressure(balance) => *balance = balance.fresh(),
            Loop::Inclination(lean) => *lean = lean.fresh(),
        }
        self.dynamics.fill(body, swing.other(), angles, &self.now);
        self.planned_cop = self.dynamics.solve(body, swing, &self.now, dt, both);
    }

    /// One tick: `newest` is what is wanted one and a half periods `dt` (s) ahead.
    pub(crate) fn tick(
        &mut self,
        body: &Body,
        footing: Footing,
        newest: &Wanted,
        dt: f64,
        sensors: &Sensors,
        command: &mut JointCommand,
    ) {
        let Footing { swing, both, active } = footing;
        let middle = self.middle.unwrap_or(*newest);
        let measured = self.measured(body, swing, sensors);
        let tilt = tilt(body, &self.now, swing, sensors);
        let mut held = middle.goals;
        let mut moment = Vector3::zeros();
        match &mut self.stabiliser {
            Loop::Pressure(balance) => {
                let steady = tilt.norm() < STEADY_TILT && measured.is_none_or(|at| inside(body, at, swing.other()));
                let shift = balance.shift(measured, self.planned_cop, (active, steady), dt);
                held.balance[0] += shift[0];
                held.balance[1] += shift[1];
                moment = inertial(body, balance, swing, &tilt, sensors);
            }
            Loop::Inclination(lean) => {
                let com = sensed_com(body, &mut self.sensed, swing.other(), sensors);
                let com = com.filter(|_| active && !both);
                lean.apply(com, &mut held, dt);
            }
        }
        body.set_arms(newest.arms, &mut self.angles);
        self.ik.solve(&body.tree, &mut self.pose, &mut self.angles, swing, &newest.goals, TICK_STEPS);
        self.dynamics.push(body, swing.other(), &self.angles, &self.pose);
        body.tree.update(self.dynamics.angles(), &mut self.now);
        self.planned_cop = self.dynamics.solve(body, swing, &self.now, dt, both);

        body.set_arms(middle.arms, &mut self.held_angles);
        self.ik.solve(&body.tree, &mut self.held, &mut self.held_angles, swing, &held, TICK_STEPS);
        self.middle = Some(*newest);
        command.positions.copy_from_slice(&self.held_angles);
        command.velocities.copy_from_slice(self.dynamics.speeds());
        command.torques.copy_from_slice(&self.dynamics.torques);
        turn_ankles(body, &self.now, &footing, &moment, command);
        tell(&body.robot, command);
    }

    /// The angles of the newest sample, rad.
    pub(crate) fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// Centre of pressure of both feet together in the support sole's frame, m.
    fn measured(&self, body: &Body, swing: Side, sensors: &Sensors) -> Option<[f64; 2]> {
        let mut loads = [0.0; 2];
        for (contact, force) in body.robot.contacts.iter().zip(&sensors.contact_forces) {
            loads[contact.leg as usize] += force;
        }
        let least = LOADED * body.tree.mass() * GRAVITY;
        let (mut sum, mut moment) = (0.0, [0.0; 2]);
        let sole = &body.robot.leg(swing.other()).sole;
        let turn = self.now.rotation[sole.link].transpose();
        let origin = self.now.point(sole);
        for side in [Side::Left, Side::Right] {
            let load = loads[side as usize];
            let Some(cop) = sensors.centre_of_pressure[side as usize].filter(|_| load > least) else { continue };
            let mut at = body.robot.leg(side).sole;
            at.point += Vector3::new(cop[0], cop[1], 0.0);
            let point = turn * (self.now.point(&at) - origin);
            sum += load;
            moment[0] += load * point.x;
            moment[1] += load * point.y;
        }
        (sum > least).then(|| moment.map(|m| m / sum))
    }

    /// Lean of the body toward the swing foot, rad: tilt, plus rate times the time to fall.
    pub(crate) fn lean(&self, body: &Body, swing: Side, sensors: &Sensors) -> f64 {
        let fall_time = (body.stand(swing).com.z / GRAVITY).sqrt();
        -Body::sign(swing) * (tilt(body, &self.now, swing, sensors).x + fall_time * sensors.gyro[0])
    }
}

/// The loop of the centre of pressure with `feedback`.
pub(crate) fn pressure(feedback: Feedback) -> Loop {
    Loop::Pressure(Balance::new(feedback))
}

/// How far the base leans from the plan, whose pose is `now`: a rotation vector in the base frame, rad, without yaw.
pub(crate) fn tilt(body: &Body, now: &TreePose, swing: Side, sensors: &Sensors) -> Vector3<f64> {
    let sole = &body.robot.leg(swing.other()).sole;
    up(sensors).cross(&(now.rotation[sole.link] * Vector3::z()))
}

/// The moment of the inertial sensor's loop on the body, in the base frame, N m.
pub(crate) fn inertial(
    body: &Body,
    balance: &Balance,
    swing: Side,
    tilt: &Vector3<f64>,
    sensors: &Sensors,
) -> Vector3<f64> {
    let weight = body.tree.mass() * GRAVITY;
    let foot = &body.feet[swing.other() as usize];
    let half = |[low, high]: [f64; 2]| 0.5 * (high - low) * weight;
    let limits = [half(foot.stand_y), half(foot.stand_x)];
    balance.moment(tilt, &Vector3::from(sensors.gyro), weight * body.stand(swing).com.z, limits)
}

/// Puts a moment on the body (N m, base frame) by the ankles of the feet that carry it.
pub(crate) fn turn_ankles(
    body: &Body,
    now: &TreePose,
    footing: &Footing,
    moment: &Vector3<f64>,
    command: &mut JointCommand,
) {
    // A moment on the body is the opposite of one on the foot, which is what the ankle's torque turns.
    let feet: &[Side] = if footing.both { &[Side::Left, Side::Right] } else { &[footing.swing.other()] };
    for side in feet {
        let leg = body.robot.leg(*side);
        for joint in [Some(leg.ankle_pitch), leg.ankle_roll].into_iter().flatten() {
            command.torques[joint] -= now.axis[joint].dot(moment) / feet.len() as f64;
        }
    }
}

/// The vertical in the base frame.
pub(crate) fn up(sensors: &Sensors) -> Vector3<f64> {
    let [w, x, y, z] = sensors.orientation;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).inverse() * Vector3::z()
}

/// Whether a centre of pressure is well inside the support foot, toward the swing foot without limit.
pub(crate) fn inside(body: &Body, at: [f64; 2], support: Side) -> bool {
    let foot = &body.feet[support as usize];
    let [back, front] = foot.stand_x;
    let outer = if support == Side::Left { foot.stand_y[1] - at[1] } else { at[1] - foot.stand_y[0] };
    at[0] - back > EDGE && front - at[0] > EDGE && outer > EDGE
}

/// The centre of mass over the ground, from encoders and inertial sensor, in the support sole's axes, m; `None` when a
/// reading is not finite.
fn sensed_com(body: &Body, pose: &mut TreePose, support: Side, sensors: &Sensors) -> Option<[f64; 2]> {
    body.tree.update(&sensors.joint_positions, pose);
    let sole = &body.robot.leg(support).sole;
    let from_sole = body.tree.com(pose) - pose.point(sole);
    let up = up(sensors);
    let level = from_sole - up * from_sole.dot(&up);
    let in_sole = pose.rotation[sole.link].transpose() * level;
    (in_sole.x + in_sole.y).is_finite().then_some([in_sole.x, in_sole.y])
}
