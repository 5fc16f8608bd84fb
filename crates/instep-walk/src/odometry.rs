//! Leg odometry: the base's place and velocity from the feet that stand and the inertial sensor, as a complementary filter.
//!
//! Orientation is the inertial sensor's own. Velocity: the accelerometer's integral, pulled to what the legs say when a point
//! on the ground stands still. Place: the velocity's integral, pulled to where the standing feet came down. A foot stands
//! while it bears a share of the weight, with hysteresis. Estimates no biases and states no uncertainty.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::Sensors;
use instep_robot::{Robot, RobotData};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::StateEstimate;
use crate::settings::GRAVITY;
use crate::whole_body::FootModel;

/// Share of the weight from which a foot stands, and below which it has left the ground.
const LOAD: [f64; 2] = [0.07, 0.035];
/// How fast velocity and place follow the legs, 1/s.
const FOLLOW: [f64; 2] = [60.0, 20.0];

/// The filter.
#[derive(Debug)]
pub struct Odometry {
    robot: Arc<Robot>,
    data: RobotData,
    feet: [FootModel; 2],
    /// Where each foot stands, m.
    anchors: [Option<Vector3<f64>>; 2],
    position: Vector3<f64>,
    /// Velocity of the inertial sensor, m/s.
    velocity: Vector3<f64>,
    last: Option<f64>,
}

impl Odometry {
    /// For `robot`, which stands at the origin.
    #[must_use]
    pub fn new(robot: Arc<Robot>) -> Self {
        Self {
            data: robot.data(),
            feet: [FootModel::new(&robot, Side::Left), FootModel::new(&robot, Side::Right)],
            anchors: [None; 2],
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            last: None,
            robot,
        }
    }

    /// One tick: writes what `sensors` tell over `state`.
    pub fn update(&mut self, sensors: &Sensors, state: &mut StateEstimate) {
        let period = self.last.map_or(0.0, |last| (sensors.time - last).max(0.0));
        let first = self.last.is_none();
        self.last = Some(sensors.time);
        state.time = sensors.time;
        let [w, x, y, z] = sensors.orientation;
        let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let rate = Vector3::from(sensors.gyro);
        state.q[..3].fill(0.0);
        state.q[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
        state.q[7..].copy_from_slice(&sensors.joint_positions);
        state.v[..3].fill(0.0);
        state.v[3..6].copy_from_slice(rate.as_slice());
        state.v[6..].copy_from_slice(&sensors.joint_velocities);
        self.data.set_state(&state.q, &state.v);

        let weight = self.robot.mass() * GRAVITY;
        let (mut legs, mut load_sum) = (Vector3::zeros(), 0.0);
        let mut from_base = [Vector3::zeros(); 2];
        for (i, foot) in self.feet.iter().enumerate() {
            let load: f64 = foot.contacts.iter().map(|&c| sensors.contact_forces[c]).sum();
            state.load[i] = load;
            state.contact[i] = load > weight * if state.contact[i] && !first { LOAD[1] } else { LOAD[0] };
            from_base[i] = self.data.point(&foot.reference);
            legs -= self.data.point_velocity(&foot.reference) * load;
            load_sum += load;
        }
        let lever = turn * rate.cross(&self.robot.imu.point);
        if first {
            let ground = 0.5 * (from_base[0] + from_base[1]);
            self.position = -ground;
            self.velocity = lever;
        }
        let acceleration = turn * Vector3::from(sensors.accelerometer) - Vector3::new(0.0, 0.0, GRAVITY);
        self.velocity += acceleration * period;
        if load_sum > LOAD[0] * weight {
            let share = 1.0 - (-FOLLOW[0] * period).exp();
            self.velocity += (legs / load_sum + lever - self.velocity) * share;
        }
        let velocity = self.velocity - lever;
        self.position += velocity * period;
        let (mut error, mut loads) = (Vector3::zeros(), 0.0);
        for (i, (anchor, from_base)) in self.anchors.iter_mut().zip(from_base).enumerate() {
            if !state.contact[i] {
                *anchor = None;
                continue;
            }
            let anchor = *anchor.get_or_insert(self.position + from_base);
            error += (anchor - from_base - self.position) * state.load[i];
            loads += state.load[i];
        }
        if loads > 0.0 {
            self.position += error / loads * (1.0 - (-FOLLOW[1] * period).exp());
        }
        state.q[..3].copy_from_slice(self.position.as_slice());
        state.v[..3].copy_from_slice(velocity.as_slice());
    }
}
