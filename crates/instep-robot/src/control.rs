//! What passes between a robot and whoever steers it: sensor readings one way, joint commands the other, and the
//! law by which a drive turns a command into torque.

use crate::robot::Joint;

/// One set of sensor readings. A controller sees these and nothing else of the world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sensors {
    /// Since the controller was started, s.
    pub time: f64,
    /// Joint angles, rad, in the robot's joint order.
    pub joint_positions: Vec<f64>,
    /// Joint speeds, rad/s.
    pub joint_velocities: Vec<f64>,
    /// Angular velocity in the inertial sensor's frame, rad/s.
    pub gyro: [f64; 3],
    /// Specific force in the inertial sensor's frame, m/s^2: (0, 0, 9.81) when it rests level.
    pub accelerometer: [f64; 3],
    /// The inertial sensor's estimate of `world_from_imu` (w, x, y, z); its yaw is relative to the start.
    pub orientation: [f64; 4],
    /// Normal force at each contact point, N, in the robot's contact order.
    pub contact_forces: Vec<f64>,
    /// Centre of pressure of the left and the right foot in its sole frame (x forward, y left), m; `None` while the
    /// foot carries no weight.
    pub centre_of_pressure: [Option<[f64; 2]>; 2],
    /// The last sight of the ball, if there was one.
    pub ball: Option<BallObservation>,
}

impl Sensors {
    /// Takes over all of `other`'s readings; allocates nothing once the vectors have their size.
    pub fn copy_from(&mut self, other: &Self) {
        self.joint_positions.clone_from(&other.joint_positions);
        self.joint_velocities.clone_from(&other.joint_velocities);
        self.contact_forces.clone_from(&other.contact_forces);
        let Self { time, gyro, accelerometer, orientation, centre_of_pressure, ball, .. } = other;
        (self.time, self.gyro, self.accelerometer) = (*time, *gyro, *accelerometer);
        (self.orientation, self.centre_of_pressure, self.ball) = (*orientation, *centre_of_pressure, *ball);
    }
}

/// A sight of the ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallObservation {
    /// When it was seen, s.
    pub time: f64,
    /// Ball's centre relative to the base link's ground projection, in its heading (x forward, y left, z up), m.
    pub position: [f64; 3],
}

/// Targets for every joint's drive, in the robot's joint order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointCommand {
    /// Wanted angles, rad.
    pub positions: Vec<f64>,
    /// Wanted speeds, rad/s; zero gives paper 1's control law (42).
    pub velocities: Vec<f64>,
    /// Torques added to the drive's own, N m.
    pub torques: Vec<f64>,
}

impl JointCommand {
    /// A command for `joints` joints: zero angle, speed and torque.
    #[must_use]
    pub fn zeros(joints: usize) -> Self {
        Self { positions: vec![0.0; joints], velocities: vec![0.0; joints], torques: vec![0.0; joints] }
    }
}

/// Something that steers a robot. Called once a control tick; allocates nothing there.
pub trait Controller {
    /// Reads `sensors` and writes the next targets into `command`, whose vectors have one entry a joint.
    fn tick(&mut self, sensors: &Sensors, command: &mut JointCommand);
}

/// The least and the greatest torque (N m) that `joint`'s motor can give at `speed` (rad/s): full up to the corner
/// speed, then falling linearly to zero at the speed limit. Beyond the limit the same line goes on below zero, as the
/// back-EMF of a real motor does: whatever drives the joint too fast is braked. Braking always has the full torque.
#[must_use]
pub fn torque_range(joint: &Joint, speed: f64) -> [f64; 2] {
    let share = |toward: f64| ((1.0 - toward / joint.speed) / (1.0 - joint.corner)).clamp(-1.0, 1.0);
    [-joint.torque * share(-speed), joint.torque * share(speed)]
}

/// As [`torque_range`], for a torque that is held over a whole time step: what the law allows at the speed that the
/// torque itself leads to, so that a strong motor on a light link does not overshoot its speed limit within the step.
/// `step_over_inertia` is the step (s) over the least inertia that the motor can find before it (kg m^2); `voltage` is the
/// supply's as a share of the nominal one: the speed limit falls with it.
#[must_use]
pub fn torque_range_over_step(joint: &Joint, speed: f64, step_over_inertia: f64, voltage: f64) -> [f64; 2] {
    // On the falling line the law is torque = slope (limit - v); at the end of the step v + torque step / inertia.
    let slope = joint.torque / (joint.speed * (1.0 - joint.corner));
    let most = |toward: f64| {
        (slope * (voltage * joint.speed - toward) / (1.0 + slope * step_over_inertia))
            .clamp(-joint.torque, joint.torque)
    };
    [-most(-speed), most(speed)]
}

/// The torque (N m) of an ideal drive of `joint` (no delay, no play; takes everything) for the targets `position`, `velocity` and `torque` at the measured `q` and
/// `v`: proportional-derivative control plus the added torque, within what the motor can give.
#[must_use]
pub fn drive_torque(joint: &Joint, position: f64, velocity: f64, torque: f64, q: f64, v: f64) -> f64 {
    let [least, greatest] = torque_range(joint, v);
    (joint.kp * (position - q) + joint.kd * (velocity - v) + torque).clamp(least, greatest)
}
