//! Walking on position servos, which take angles only, rarely and late: the gait walks a model of the robot, and the servos follow it.
//!
//! Gait and whole-body controller are those of torque drives, but the state that they see is the model's: it is integrated from their own
//! accelerations, with the support foot where it came down. The real robot is let in where it matters: how its trunk tilts
//! beside the model's shifts the footholds (the body turned about its support foot has its centre of mass elsewhere) and turns the ankles
//! against it; a foot that touches the ground ends the model's step; and what its way is short of what was asked is added, slowly.
//!
//! Targets lead as those of a standing kick do ([`instep_robot::Joint::servo_target`]). Source of the idea: own; B. Stephens, C. Atkeson, Dynamic balance force control
//! for compliant humanoid robots (IROS 2010), lead positions by torques over stiffness in a similar way.
//!
//! What it does not do: it knows no play, and where the model stands is not where the robot stands.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::{JointCommand, Sensors};
use instep_robot::{Robot, RobotData};
use nalgebra::{Matrix3, Quaternion, Rotation2, Rotation3, UnitQuaternion, Vector2, Vector3};

use crate::footsteps::PendulumState;
use crate::gait::Mode;
use crate::settings::{GRAVITY, Servo};
use crate::whole_body::Outcome;
use crate::{Gait, StateEstimate, Velocity};

/// Longest step of the model's integration, s.
const LONGEST: f64 = 0.004;
/// Largest tilt that is reacted to, rad.
const TILT: f64 = 0.3;
/// Share of the velocity that is missing over two steps that is added, and most that is added: of sqrt(g H), and rad/s.
const TRIM: [f64; 3] = [0.3, 0.25, 0.5];

/// The model that walks.
#[derive(Debug)]
pub struct Model {
    robot: Arc<Robot>,
    data: RobotData,
    settings: Servo,
    /// Its state, for the gait.
    pub state: StateEstimate,
    /// Foot that holds it, and where: reference point (m) and orientation.
    anchor: Option<(Side, Vector3<f64>, Matrix3<f64>)>,
    /// How the real trunk is turned beside the model's, rad, and how fast, rad/s; world axes, about x and y.
    tilt: [Vector3<f64>; 2],
    jacobian: Vec<f64>,
    period: f64,
    last: Option<f64>,
    /// Time (s), pose (x, y, heading) of the real robot and what was asked at the last touchdowns, the newest last.
    touchdowns: [Option<(f64, [f64; 3], Velocity)>; 2],
    trim: Velocity,
}

impl Model {
    /// Of `robot`, in its stand.
    #[must_use]
    pub fn new(robot: Arc<Robot>, settings: Servo) -> Self {
        Self {
            data: robot.data(),
            state: StateEstimate::standing(&robot),
            settings,
            anchor: None,
            tilt: [Vector3::zeros(); 2],
            jacobian: vec![0.0; 3 * robot.nv()],
            period: 0.0,
            last: None,
            touchdowns: [None; 2],
            trim: Velocity::default(),
            robot,
        }
    }

    /// Lets the real robot in; `estimate` is of its state. The model then is to be carried over the time since the tick before, in this
    /// many steps.
    pub fn sense(&mut self, sensors: &Sensors, estimate: &StateEstimate) -> usize {
        let Some(last) = self.last.replace(sensors.time) else {
            // The joints may be anywhere at the start: after a kick, say.
            self.state.q.copy_from_slice(&estimate.q);
            self.state.v.fill(0.0);
            self.state.time = sensors.time;
            self.period = 0.0;
            return 1;
        };
        let elapsed = (sensors.time - last).max(0.0);
        let steps = (elapsed / LONGEST).ceil().max(1.0);
        self.period = elapsed / steps;

        let turn = |q: &[f64]| UnitQuaternion::new_normalize(Quaternion::new(q[3], q[4], q[5], q[6]));
        let (real, model) = (turn(&estimate.q), turn(&self.state.q));
        // Up in the real base, seen by the model: z - tilt x z.
        let up = model * (real.inverse() * Vector3::z());
        let tilt = Vector3::new(up.y, -up.x, 0.0);
        let rate = model
            * Vector3::new(
                estimate.v[3] - self.state.v[3],
                estimate.v[4] - self.state.v[4],
                estimate.v[5] - self.state.v[5],
            );
        let share = 1.0 - (-elapsed / self.settings.lag.max(1e-4)).exp();
        let rate = Vector3::new(rate.x, rate.y, 0.0);
        let late = self.robot.senses.delay + self.robot.drives.delay;
        let ahead = (tilt + rate * late).map(|x| x.clamp(-TILT, TILT));
        self.tilt[0] += (ahead - self.tilt[0]) * share;
        self.tilt[1] += (rate - self.tilt[1]) * share;
        self.state.load = estimate.load;
        self.state.contact = estimate.contact;
        steps as usize
    }

    /// What the gait is to know of the real robot before it plans.
    pub fn prepare(&mut self, gait: &mut Gait) {
        self.state.time += self.period;
        let height = gait.settings().gait.height;
        let shift = |turn: &Vector3<f64>| Vector2::new(turn.y, -turn.x) * (height * self.settings.foothold);
        gait.disturb(PendulumState { position: shift(&self.tilt[0]), momentum: shift(&self.tilt[1]) });
        if let Mode::Step { support } = gait.view().mode {
            let swing = support.other() as usize;
            let phase = gait.view().phase;
            // On time whether the sensor says so or not: the clock of the gait is the model's.
            self.state.contact[swing] = phase >= 1.0 || (self.state.contact[swing] && phase > self.settings.earliest);
        }
    }

    /// After the gait has planned: at a touchdown, what two steps were short of is learned. `pose` is the real robot's (x, y, heading).
    pub fn watch(&mut self, gait: &mut Gait, pose: [f64; 3]) {
        if gait.view().mode == Mode::Stand {
            self.touchdowns = [None; 2];
        }
        if gait.footstep().is_none() {
            return;
        }
        let [before, last] = self.touchdowns;
        let asked = gait.velocity();
        self.touchdowns = [last, Some((self.state.time, pose, asked))];
        let Some((time, from, was)) = before.filter(|_| gait.view().mode != Mode::Stand) else { return };
        let elapsed = (self.state.time - time).max(1e-3);
        let turned = wrap(pose[2] - from[2]);
        let way = Rotation2::new(-(from[2] + 0.5 * turned)) * Vector2::new(pose[0] - from[0], pose[1] - from[1]);
        let most = TRIM[1] * (GRAVITY * gait.settings().gait.height).sqrt();
        let add = |known: &mut f64, asked: [f64; 2], walked: f64, most: f64| {
            let missing = 0.5 * (asked[0] + asked[1]) - walked / elapsed;
            *known = (*known + TRIM[0] * missing.clamp(-most, most)).clamp(-most, most);
        };
        add(&mut self.trim.x, [was.x, asked.x], way.x, most);
        add(&mut self.trim.y, [was.y, asked.y], way.y, most);
        add(&mut self.trim.turn, [was.turn, asked.turn], turned, TRIM[2]);
        gait.set_trim(self.trim);
    }

    /// Carries the model on with the gait's accelerations.
    pub fn integrate(&mut self, gait: &Gait, outcome: Outcome) {
        let h = self.period;
        if outcome != Outcome::Unsolved {
            for (v, a) in self.state.v.iter_mut().zip(&gait.body().acceleration) {
                *v += a * h;
            }
        }
        self.data.integrate(&mut self.state.q, &self.state.v, h);
        for (joint, q) in self.robot.joints.iter().zip(&mut self.state.q[7..]) {
            *q = q.clamp(joint.range[0], joint.range[1]);
        }
        // The foot that carries holds the base.
        let carries = match gait.view().mode {
            Mode::Step { support } | Mode::Shift { support } => support,
            Mode::Stand => self.anchor.map_or(Side::Left, |(side, ..)| side),
        };
        self.data.set_state(&self.state.q, &self.state.v);
        let foot = &gait.body().feet[carries as usize];
        let reference = self.data.point(&foot.reference);
        let matrix = self.data.link_matrix(foot.reference.link);
        let (_, at, level) = match self.anchor {
            Some(anchor) if anchor.0 == carries => anchor,
            _ => {
                let ahead = matrix.column(0);
                let level = Rotation3::from_axis_angle(&Vector3::z_axis(), ahead.y.atan2(ahead.x)).into_inner();
                // Level ground at the height of the start.
                let ground = self.anchor.map_or(reference.z, |(_, at, _)| at.z);
                *self.anchor.insert((carries, Vector3::new(reference.x, reference.y, ground), level))
            }
        };
        let base = self.data.link_matrix(self.robot.base);
        let origin = Vector3::new(self.state.q[0], self.state.q[1], self.state.q[2]);
        let turned = level * matrix.transpose() * base;
        let position = at - turned * (base.transpose() * (reference - origin));
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turned));
        self.state.q[..3].copy_from_slice(position.as_slice());
        self.state.q[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
    }

    /// Targets that lead the servos to where the model is.
    pub fn write(&mut self, gait: &Gait, command: &mut JointCommand) {
        let turn = self.tilt[0] * self.settings.tilt + self.tilt[1] * self.settings.rate;
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let (q, v, torque) = (self.state.q[7 + j], self.state.v[6 + j], gait.body().torques[j]);
            // The model is where the robot is to be when the command acts: no lead for the delay.
            command.positions[j] = joint.servo_target(q, v, torque, 0.0);
            command.velocities[j] = v;
            command.torques[j] = 0.0;
        }
        // The ankles of feet that carry turn the body back: about their own axes.
        let carries = match gait.view().mode {
            Mode::Step { support } => [support == Side::Left, support == Side::Right],
            Mode::Stand | Mode::Shift { .. } => [true; 2],
        };
        let nv = self.robot.nv();
        for (leg, _) in self.robot.legs.iter().zip(carries).filter(|(_, carries)| *carries) {
            self.data.rotation_jacobian_into(leg.foot, &mut self.jacobian);
            for joint in [Some(leg.ankle_pitch), leg.ankle_roll].into_iter().flatten() {
                let about: f64 = (0..3).map(|axis| turn[axis] * self.jacobian[axis * nv + 6 + joint]).sum();
                command.positions[joint] += about;
            }
        }
        for (joint, position) in self.robot.joints.iter().zip(&mut command.positions) {
            *position = position.clamp(joint.range[0], joint.range[1]);
        }
    }
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
