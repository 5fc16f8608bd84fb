//! Walking on position servos, which take angles only, rarely and late: a pendulum walks, and inverse kinematics puts the robot where it is.
//!
//! The pendulum is that of [`crate::footsteps`], told in the support sole's frame: it falls as it must, and the next foothold catches it. The centre
//! of mass, the swing sole, the height and the tilt of the trunk go to the legs' inverse kinematics; targets lead the servos by what speed and
//! load take ([`instep_robot::Joint::servo_target`]). The real robot is let in where it matters:
//!
//! - A step ends when the swing foot bears load, not by the clock; a foot that is late is waited for, and the pendulum with it.
//! - How the trunk tilts beside the plan turns the ankles of the feet that stand against it. (Footholds that follow the tilt were tried, and it fell.)
//! - What the way of two steps is short of what was asked is added, slowly.
//!
//! Source: own. Ending a step by the foot's load and gyro feedback at the ankles are as in B. Hengst, rUNSWift walk 2014 (report, UNSW 2014);
//! the pendulum with a late foot waited for is this file's. It knows no play, no slopes and no pushes beyond one step.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::{JointCommand, Sensors};
use instep_robot::ik::{Goals, Ik, Weights};
use instep_robot::tree::{Tree, TreePose};
use instep_robot::{LinkPoint, Robot, RobotData};
use nalgebra::{Matrix3, Quaternion, Rotation2, Rotation3, UnitQuaternion, Vector2, Vector3};

use crate::footsteps::{Pendulum, PendulumState, Reach};
use crate::gait::{Counts, Footstep, GaitView, Mode};
use crate::settings::{GRAVITY, Velocity, WalkSettings};
use crate::start::Start;
use crate::swing::Swing;
use crate::{StateEstimate, WalkError};

/// Largest tilt that is reacted to, rad.
const TILT: f64 = 0.3;
/// Share of the velocity that is missing over two steps that is added, and most that is added: of sqrt(g H), and rad/s.
const TRIM: [f64; 3] = [0.05, 0.06, 0.2];
/// How much faster it slows down than it speeds up.
const BRAKE: f64 = 4.0;
/// Kept from every joint's limit, and least bend of a knee, rad.
const MARGIN: f64 = 0.02;
/// See [`MARGIN`].
const BEND: f64 = 0.15;
/// What counts in the inverse kinematics of a walk: soles flat, trunk upright, height kept.
const WEIGHTS: Weights = Weights {
    position: 100.0,
    orientation: 30.0,
    roll: 30.0,
    height: 40.0,
    tilt: 15.0,
    yaw: 5.0,
    balance: 60.0,
    damping: 0.01,
};
/// Steps of the inverse kinematics in a tick: each starts from the tick before.
const STEPS: usize = 3;
/// How far a sole may be from where it is to be before a tick counts as unsolved, m.
const OFF: f64 = 0.01;
/// In which time the joints go from where they are at the start to the pattern, s.
const BLEND: f64 = 0.5;
/// Where the capture point may be when a walk ends: share of the half length of a foot, and of half the distance across.
const STOP: [f64; 2] = [0.6, 0.9];
/// How far the feet may be apart ahead when a walk ends, as a share of the half length of a foot, how far turned, rad, and how far off the
/// gait's width, as a share of it: whoever takes the robot over finds it in a stand.
const STAGGER: [f64; 3] = [0.3, 0.05, 0.6];

/// A pendulum that walks in place of the robot.
#[derive(Debug)]
pub struct Pattern {
    robot: Arc<Robot>,
    settings: WalkSettings,
    tree: Tree,
    pose: TreePose,
    ik: Ik,
    data: RobotData,
    pendulum: Pendulum,
    mode: Mode,
    /// The foot in whose sole's frame things are told; on both feet, the first or the last support foot.
    support: Side,
    /// Centre of mass and its speed over the support sole, m and m/s.
    com: PendulumState,
    /// The other sole's place (m) and heading (rad), and what they were when it left the ground.
    other: (Vector3<f64>, f64),
    lift_off: (Vector3<f64>, f64),
    /// Height of the trunk beyond the planned one at the beginning of the step, m: the foot came down on higher or lower ground.
    rise: f64,
    phase: f64,
    start: Start,
    since: f64,
    asked: Velocity,
    velocity: Velocity,
    trim: Velocity,
    /// Pose of the support sole in the plan's own odometry: x, y (m), heading (rad).
    place: [f64; 3],
    /// Tilt of the real trunk beside the plan, and its rate: toward x and y of the trunk's heading, rad and rad/s.
    tilt: [Vector2<f64>; 2],
    angles: Vec<f64>,
    before: Vec<f64>,
    /// Joints at the start beside the pattern, rad.
    offset: Vec<f64>,
    q: Vec<f64>,
    still: Vec<f64>,
    torques: Vec<f64>,
    jacobian: Vec<f64>,
    began: Option<f64>,
    last: f64,
    /// Height of the base over the support sole, m; half the length of a sole, m.
    height: f64,
    half_length: f64,
    /// Time (s), pose (x, y, heading) of the real robot and what was asked at the last touchdowns, the newest last.
    touchdowns: [Option<(f64, [f64; 3], Velocity)>; 2],
    counts: Counts,
    footstep: Option<Footstep>,
    view: GaitView,
}

impl Pattern {
    /// For `robot` with `settings`; stands.
    ///
    /// # Errors
    /// When the legs have more joints than the inverse kinematics has room for.
    pub fn new(robot: Arc<Robot>, settings: WalkSettings) -> Result<Self, WalkError> {
        let ik = Ik::new(&robot, &robot.coupled(), MARGIN, BEND).map_err(|e| WalkError::Robot {
            robot: robot.name.clone(),
            missing: format!("{} has {}", e.field, e.found),
            expected: e.expected,
        })?;
        let tree = Tree::new(&robot);
        let data = robot.data();
        let gait = &settings.gait;
        let soles = robot.legs.each_ref().map(|leg| data.point(&leg.sole));
        let ground = 0.5 * (soles[0].z + soles[1].z);
        let lowered = data.com().z - ground - gait.height;
        let length = robot
            .contacts
            .iter()
            .map(|contact| (data.point(&contact.at) - soles[contact.leg as usize]).x.abs())
            .fold(0.0, f64::max);
        let pendulum = Pendulum::of(gait);
        let zero = Vector3::zeros();
        let (joints, nv) = (robot.joints.len(), robot.nv());
        let apart = soles[1] - soles[0];
        let com = data.com() - soles[0];
        Ok(Self {
            pose: tree.pose(),
            ik: ik.with_weights(WEIGHTS),
            tree,
            data,
            pendulum,
            mode: Mode::Stand,
            support: Side::Left,
            com: PendulumState { position: com.xy(), momentum: Vector2::zeros() },
            other: (Vector3::new(apart.x, apart.y, 0.0), 0.0),
            lift_off: (zero, 0.0),
            rise: lowered,
            phase: 0.0,
            start: Start::default(),
            since: 0.0,
            asked: Velocity::default(),
            velocity: Velocity::default(),
            trim: Velocity::default(),
            place: [0.0, soles[0].y, 0.0],
            tilt: [Vector2::zeros(); 2],
            angles: robot.stand[7..].to_vec(),
            before: robot.stand[7..].to_vec(),
            offset: vec![0.0; joints],
            q: robot.stand.clone(),
            still: vec![0.0; nv],
            torques: vec![0.0; nv],
            jacobian: vec![0.0; 3 * nv],
            began: None,
            last: 0.0,
            height: robot.stand[2] - ground - lowered,
            half_length: length,
            touchdowns: [None; 2],
            counts: Counts::default(),
            footstep: None,
            view: GaitView::default(),
            settings,
            robot,
        })
    }

    /// Asks for a velocity from now on; returns what the robot is allowed.
    pub fn set_velocity(&mut self, velocity: Velocity) -> Velocity {
        self.asked = self.settings.limits.clip(velocity);
        self.asked
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &WalkSettings {
        &self.settings
    }

    /// What is seen and wanted, in the plan's own odometry.
    #[must_use]
    pub fn view(&self) -> &GaitView {
        &self.view
    }

    /// The velocity that the gait is at on its way to what was asked.
    #[must_use]
    pub fn velocity(&self) -> Velocity {
        self.velocity
    }

    /// What happened how often.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The step that ended in the last tick, if one did.
    #[must_use]
    pub fn footstep(&self) -> Option<Footstep> {
        self.footstep
    }

    /// Somebody else moved the joints: the next tick begins from where they are.
    pub fn resume(&mut self) {
        self.began = None;
    }

    /// One tick: `estimate` is of the real robot's state, `pose` its place (x, y, heading).
    pub fn tick(&mut self, sensors: &Sensors, estimate: &StateEstimate, pose: [f64; 3], command: &mut JointCommand) {
        let begins = self.began.is_none();
        let began = *self.began.get_or_insert(sensors.time);
        let period = if begins { 0.0 } else { (sensors.time - self.last).max(0.0) };
        self.last = sensors.time;
        self.counts.ticks += 1;
        self.footstep = None;
        self.feel(estimate, period);
        self.approach(period);
        self.change(estimate, pose);
        match self.mode {
            Mode::Stand => self.stand(period),
            Mode::Shift { .. } => self.shift(),
            Mode::Step { .. } => self.step(period),
        }
        self.solve();
        if begins {
            for ((offset, angle), measured) in self.offset.iter_mut().zip(&self.angles).zip(&sensors.joint_positions) {
                *offset = measured - angle;
            }
            self.before.copy_from_slice(&self.angles);
        }
        let left = (1.0 - (sensors.time - began) / BLEND).max(0.0);
        self.load();
        self.write(period, left, command);
        self.look();
    }

    /// How the real trunk tilts beside the planned one, as it will be when a command acts.
    fn feel(&mut self, estimate: &StateEstimate, period: f64) {
        let q = &estimate.q;
        let turn = UnitQuaternion::new_normalize(Quaternion::new(q[3], q[4], q[5], q[6]));
        let up = turn.inverse() * Vector3::z();
        let lean = self.settings.gait.lean;
        // Toward x by pitch, toward y by roll the other way.
        let tilt = Vector2::new((-up.x).atan2(up.z) - lean, -up.y.atan2(up.z));
        let rate = Vector2::new(estimate.v[4], -estimate.v[3]);
        let late = self.robot.senses.delay + self.robot.drives.delay;
        let ahead = (tilt + rate * late).map(|x| x.clamp(-TILT, TILT));
        let share = 1.0 - (-period / self.settings.drive.servo.lag.max(1e-4)).exp();
        self.tilt[0] += (ahead - self.tilt[0]) * share;
        self.tilt[1] += (rate - self.tilt[1]) * share;
    }

    /// The velocity goes toward what was asked as fast as the limits allow.
    fn approach(&mut self, period: f64) {
        self.velocity = match self.mode {
            Mode::Step { .. } => self.settings.limits.approach(self.velocity, self.asked, BRAKE, period),
            _ => Velocity::default(),
        };
    }

    /// Changes of the mode: start, touchdown, stop.
    fn change(&mut self, estimate: &StateEstimate, pose: [f64; 3]) {
        match self.mode {
            Mode::Stand => {
                let settled = self.com.momentum.norm() < 0.02 && self.last - self.since > BLEND;
                if !self.asked.is_zero() && settled {
                    let leftward = self.asked.y > 0.0 || (self.asked.y == 0.0 && self.asked.turn > 0.0);
                    let support = if leftward { Side::Right } else { Side::Left };
                    if self.support != support {
                        self.swap();
                    }
                    let middle = 0.5 * self.other.0.xy();
                    // The sway of a walk with the feet as far apart as they are.
                    self.pendulum.width = self.other.0.y.abs();
                    let speed = -self.pendulum.sway(support);
                    let Pendulum { lambda, .. } = self.pendulum;
                    let time = self.settings.gait.start_time;
                    self.start = Start::new(self.com.position - middle, -middle, speed, lambda, time);
                    self.mode = Mode::Shift { support };
                    self.since = self.last;
                }
            }
            Mode::Shift { support } => {
                if self.last - self.since >= self.start.duration() {
                    self.lift(support);
                }
            }
            Mode::Step { support } => {
                let swing = support.other();
                let earliest = self.settings.drive.servo.earliest;
                let landed = self.phase > earliest && estimate.contact[swing as usize];
                let late = self.phase > 1.0 + self.settings.gait.latest / self.settings.gait.step_time;
                if landed || late {
                    self.counts.late += usize::from(!landed);
                    self.counts.steps += 1;
                    self.swap();
                    let [x, y, heading] = self.place;
                    let position = Vector3::new(x, y, 0.0);
                    self.footstep = Some(Footstep { time: self.last, side: swing, position, heading });
                    self.learn(pose);
                    if self.may_stop() {
                        self.mode = Mode::Stand;
                        self.since = self.last;
                        self.touchdowns = [None; 2];
                    } else {
                        self.lift(swing);
                    }
                }
            }
        }
    }

    /// The other foot becomes the one in whose frame things are told.
    fn swap(&mut self) {
        let (place, heading) = self.other;
        let turn = Rotation2::new(-heading);
        let [x, y, yaw] = self.place;
        let moved = Rotation2::new(yaw) * place.xy();
        self.place = [x + moved.x, y + moved.y, yaw + heading];
        self.com =
            PendulumState { position: turn * (self.com.position - place.xy()), momentum: turn * self.com.momentum };
        let back = turn * -place.xy();
        self.other = (Vector3::new(back.x, back.y, -place.z), -heading);
        let phase = if matches!(self.mode, Mode::Step { .. }) { self.phase } else { 1.0 };
        self.rise = self.rise * (1.0 - phase.min(1.0)).powi(2) - place.z;
        self.support = self.support.other();
    }

    /// The foot other than `support` leaves the ground.
    fn lift(&mut self, support: Side) {
        self.mode = Mode::Step { support };
        self.lift_off = self.other;
        self.phase = 0.0;
        self.since = self.last;
    }

    /// Whether a walk may end on both feet.
    fn may_stop(&self) -> bool {
        let apart = self.other.0.xy();
        let capture = self.com.position + self.com.momentum / self.pendulum.lambda - 0.5 * apart;
        self.asked.is_zero()
            && self.velocity.is_zero()
            && apart.x.abs() < STAGGER[0] * self.half_length
            && self.other.1.abs() < STAGGER[1]
            && (apart.y.abs() / self.settings.gait.width - 1.0).abs() < STAGGER[2]
            && capture.x.abs() < STOP[0] * self.half_length
            && capture.y.abs() < 0.5 * STOP[1] * apart.y.abs()
    }

    /// What two steps were short of is learned.
    fn learn(&mut self, pose: [f64; 3]) {
        let [before, last] = self.touchdowns;
        let asked = self.velocity;
        self.touchdowns = [last, Some((self.last, pose, asked))];
        let Some((time, from, was)) = before else { return };
        let elapsed = (self.last - time).max(1e-3);
        let turned = wrap(pose[2] - from[2]);
        let way = Rotation2::new(-(from[2] + 0.5 * turned)) * Vector2::new(pose[0] - from[0], pose[1] - from[1]);
        let most = TRIM[1] * (GRAVITY * self.settings.gait.height).sqrt();
        let add = |known: &mut f64, asked: [f64; 2], walked: f64, most: f64| {
            let missing = 0.5 * (asked[0] + asked[1]) - walked / elapsed;
            *known = (*known + TRIM[0] * missing.clamp(-most, most)).clamp(-most, most);
        };
        add(&mut self.trim.x, [was.x, asked.x], way.x, most);
        add(&mut self.trim.y, [was.y, asked.y], way.y, most);
        add(&mut self.trim.turn, [was.turn, asked.turn], turned, TRIM[2]);
    }

    /// Back to the middle of the feet, as a critically damped spring.
    fn stand(&mut self, period: f64) {
        let middle = 0.5 * self.other.0.xy();
        let rate = self.pendulum.lambda;
        let PendulumState { position, momentum } = self.com;
        let acceleration = (middle - position) * (rate * rate) - momentum * (2.0 * rate);
        self.com.momentum += acceleration * period;
        self.com.position += self.com.momentum * period;
        let share = (-period * rate).exp();
        self.rise *= share;
        self.other.0.z *= share;
        self.phase = 0.0;
    }

    /// Off from the foot that is lifted first.
    fn shift(&mut self) {
        let [position, speed, _] = self.start.at(self.last - self.since);
        self.com = PendulumState { position: 0.5 * self.other.0.xy() + position, momentum: speed };
    }

    /// On one foot: the pendulum falls, the other foot goes where it is caught.
    fn step(&mut self, period: f64) {
        let gait = &self.settings.gait;
        let (step_time, swing) = (gait.step_time, self.support.other());
        // A foot that is late is waited for.
        let passed = (period / step_time).min((1.0 - self.phase).max(0.0));
        // A pendulum that is out of reach of any step is that of a robot that has fallen.
        if self.com.position.norm() < gait.reach {
            self.com = self.pendulum.ahead(&self.com, passed * step_time);
        }
        self.phase += period / step_time;

        let reach = Reach { ahead: gait.reach, across: gait.across };
        // A walk that ends brings the feet side by side.
        let Velocity { x, y, turn } = if self.asked.is_zero() { Velocity::default() } else { self.trim };
        let velocity = Vector2::new(self.velocity.x + x, self.velocity.y + y);
        let turn = self.velocity.turn + turn;
        self.pendulum.width = gait.width.max(velocity.y.abs() * step_time + reach.across[0]);
        self.pendulum.alpha = gait.alpha;
        let left = (1.0 - self.phase).max(0.0) * step_time;
        let wanted = self.pendulum.foothold(&self.com, left, velocity, 0.0, Vector2::zeros(), swing);
        let foothold = reach.clip(wanted, swing);
        let way = Swing {
            from: self.lift_off.0,
            waypoint: None,
            clearance: gait.clearance,
            to: Vector3::new(foothold.x, foothold.y, 0.0),
            landing_speed: gait.landing_speed,
            duration: step_time,
        };
        let s = self.phase.clamp(0.0, 1.0);
        let heading = self.lift_off.1 + (turn * step_time - self.lift_off.1) * s * s * (3.0 - 2.0 * s);
        self.other = (way.at(self.phase).position, heading);
        self.view.wanted = self.pendulum.wanted(velocity, self.support);
        self.view.foothold = self.world(&way.to);
    }

    /// The joints for the plan.
    fn solve(&mut self) {
        let (place, heading) = self.other;
        let s = self.phase.clamp(0.0, 1.0);
        let goals = Goals {
            position: place,
            yaw_pitch: [heading, 0.0],
            balance: self.com.position.into(),
            height: self.height + self.rise * (1.0 - s) * (1.0 - s),
            base: [0.0, self.settings.gait.lean, 0.5 * heading],
        };
        let swing = self.support.other();
        let residual = self.ik.solve(&self.tree, &mut self.pose, &mut self.angles, swing, &goals, STEPS);
        self.counts.unsolved += usize::from(residual.position > OFF);
    }

    /// What gravity and the pendulum's own force ask of the joints, N m.
    fn load(&mut self) {
        let soles = self.robot.legs.each_ref().map(|leg| leg.sole);
        let sole: &LinkPoint = &soles[self.support as usize];
        let turn: Matrix3<f64> = self.pose.rotation[sole.link].transpose();
        let origin = turn * -self.pose.point(sole);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        self.q[..3].copy_from_slice(origin.as_slice());
        self.q[3..7].copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
        self.q[7..].copy_from_slice(&self.angles);
        self.data.set_state(&self.q, &self.still);
        let weight = self.robot.mass() * GRAVITY;
        // Where the ground pushes: under the support sole; on both feet where a shift needs it.
        let pressure = match self.mode {
            Mode::Step { .. } => Vector2::zeros(),
            Mode::Stand => self.com.position,
            Mode::Shift { .. } => {
                let [.., acceleration] = self.start.at(self.last - self.since);
                self.com.position - acceleration / self.pendulum.lambda.powi(2)
            }
        };
        let across = self.other.0.xy();
        let share = (pressure.dot(&across) / across.norm_squared().max(1e-6)).clamp(0.0, 1.0);
        let sideways = (self.com.position - pressure) / self.settings.gait.height;
        let force = Vector3::new(sideways.x, sideways.y, 1.0) * weight;
        let other = soles[self.support.other() as usize];
        let forces = [(*sole, force * (1.0 - share)), (other, force * share)];
        self.data.inverse_dynamics_into(&self.still, &forces, &mut self.torques);
    }

    /// Targets that lead the servos to where the pattern is, `left` of the way from the start still to be gone.
    fn write(&mut self, period: f64, left: f64, command: &mut JointCommand) {
        let servo = &self.settings.drive.servo;
        let turn = self.tilt[0] * servo.tilt + self.tilt[1] * servo.rate;
        // Leaning toward x is a turn about y, toward y one about -x.
        let turn = Vector3::new(-turn.y, turn.x, 0.0);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let angle = self.angles[j] + self.offset[j] * left;
            let speed = if period > 0.0 { (angle - self.before[j]) / period } else { 0.0 };
            self.before[j] = angle;
            let speed = speed.clamp(-joint.speed, joint.speed);
            // The plan is where the robot is to be when the command acts: no lead for the delay.
            command.positions[j] = joint.servo_target(angle, speed, self.torques[6 + j], 0.0);
            command.velocities[j] = speed;
            command.torques[j] = 0.0;
        }
        // The ankles of feet that carry turn the body back: about their own axes.
        let nv = self.robot.nv();
        for (side, leg) in [Side::Left, Side::Right].into_iter().zip(&self.robot.legs) {
            if matches!(self.mode, Mode::Step { support } if support != side) {
                continue;
            }
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

    /// A point of the support sole's frame in the plan's odometry, m.
    fn world(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let [x, y, yaw] = self.place;
        let turned = Rotation2::new(yaw) * point.xy();
        Vector3::new(x + turned.x, y + turned.y, point.z)
    }

    fn look(&mut self) {
        let [x, y, yaw] = self.place;
        let com = self.com.position;
        let speed = Rotation2::new(yaw) * self.com.momentum;
        self.view.mode = self.mode;
        self.view.phase = if matches!(self.mode, Mode::Step { .. }) { self.phase } else { 0.0 };
        self.view.momentum = self.com.momentum;
        self.view.heading = yaw + 0.5 * self.other.1;
        self.view.com = self.world(&Vector3::new(com.x, com.y, self.settings.gait.height));
        self.view.com_velocity = Vector3::new(speed.x, speed.y, 0.0);
        self.view.feet[self.support as usize] = Vector3::new(x, y, 0.0);
        self.view.feet[self.support.other() as usize] = self.world(&self.other.0);
    }
}

fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
