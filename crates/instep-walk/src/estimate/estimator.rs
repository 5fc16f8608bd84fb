//! The state of a walking robot from its senses: the filter of [`super::filter`] on heel and toe of each foot.
//!
//! Points are the middles of the foremost and the hindmost contact points of a foot; one stands while it bears its share of the
//! weight, with hysteresis. A robot that has stood on all of them for a while without turning is at rest, which tells the gyro's bias
//! about the vertical. Angles, rates and speeds of the joints are taken as read. How good the senses are follows from the robot's
//! `[senses]`: noise as stated there, with floors, since no sensor is perfect.

use std::sync::Arc;

use instep_motion::phase::Side;
use instep_robot::control::Sensors;
use instep_robot::{Robot, RobotData};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::filter::{CONTACTS, Contact, ContactEkf, Noise};
use crate::StateEstimate;
use crate::settings::GRAVITY;
use crate::whole_body::{FootModel, ground_point};

/// Share of the weight from which a foot stands, and below which it has left the ground; half of that for heel and toe.
const LOAD: [f64; 2] = [0.07, 0.035];
/// How many deviations of a foot sensor's zero its reading must be beyond.
const ZERO: f64 = 3.0;
/// How a standing point creeps, m/s/sqrt(Hz): yaw leans on it, so it is what soft ground does; real slips are thrown out.
const SLIP: f64 = 0.001;
/// Least noise of gyro (rad/s), accelerometer (m/s^2) and kinematics (m): soft ground, bending legs.
const LEAST: [f64; 3] = [0.002, 0.02, 0.001];
/// Deviation of the first orientation, rad, and least ones of the biases of gyro (rad/s) and accelerometer (m/s^2).
const START: [f64; 3] = [0.01, 0.002, 0.02];
/// How far the biases wander, as a share of their deviation in the square root of a second.
const WANDER: f64 = 0.02;
/// How long a robot must not have turned to be at rest, s; how fast it may seem to turn by a gyro of known bias, rad/s; lag of what it
/// seems, s; and how a standing body sways after all, rad/s/sqrt(Hz).
const REST: [f64; 4] = [0.2, 0.02, 0.1, 0.0002];

/// The estimator.
#[derive(Debug)]
pub struct Estimator {
    robot: Arc<Robot>,
    data: RobotData,
    feet: [FootModel; 2],
    /// Contact points of heel and toe of the left foot, then of the right one.
    points: [Vec<usize>; CONTACTS],
    bears: [bool; CONTACTS],
    filter: Option<ContactEkf>,
    last: f64,
    /// The gyro's reading without its noise, rad/s, and since when it tells of no turn, s.
    turning: Vector3<f64>,
    still: f64,
}

impl Estimator {
    /// For `robot`, which stands at the origin.
    #[must_use]
    pub fn new(robot: Arc<Robot>) -> Self {
        let data = robot.data();
        let feet = [FootModel::new(&robot, Side::Left), FootModel::new(&robot, Side::Right)];
        let points = std::array::from_fn(|i| {
            let foot = &feet[i / 2];
            let ahead = data.link_matrix(foot.reference.link).column(0).into_owned();
            let middle = data.point(&foot.reference);
            let is_toe = |c: usize| (ground_point(&robot, &data, c) - middle).dot(&ahead) > 0.0;
            foot.contacts.iter().copied().filter(|&c| is_toe(c) == (i % 2 == 1)).collect()
        });
        Self {
            data,
            feet,
            points,
            bears: [true; CONTACTS],
            filter: None,
            last: 0.0,
            turning: Vector3::zeros(),
            still: 0.0,
            robot,
        }
    }

    /// The filter, once there was a reading.
    #[must_use]
    pub fn filter(&self) -> Option<&ContactEkf> {
        self.filter.as_ref()
    }

    /// One tick: writes what `sensors` tell over `state`.
    pub fn update(&mut self, sensors: &Sensors, state: &mut StateEstimate) {
        let period = (sensors.time - self.last).max(0.0);
        self.last = sensors.time;
        // The legs, in the base's own frame.
        state.q[..7].copy_from_slice(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        state.q[7..].copy_from_slice(&sensors.joint_positions);
        self.data.set_position(&state.q);
        let (data, robot) = (&self.data, &self.robot);
        let weight = robot.mass() * GRAVITY;
        let first = self.filter.is_none();
        // What as many sensors read whose zeros are off, once in a few hundred robots, is no load.
        let zero = |sensors: usize| ZERO * robot.senses.foot_offset * (sensors as f64).sqrt();
        let contacts: [Contact; CONTACTS] = std::array::from_fn(|i| {
            let points = &self.points[i];
            let load: f64 = points.iter().map(|&c| sensors.contact_forces[c]).sum();
            self.bears[i] = !points.is_empty()
                && load > (0.5 * weight * LOAD[usize::from(self.bears[i] && !first)]).max(zero(points.len()));
            let sum: Vector3<f64> = points.iter().map(|&c| data.point(&robot.contacts[c].at)).sum();
            Contact { stands: self.bears[i], point: sum / points.len().max(1) as f64 - robot.imu.point }
        });
        for (i, foot) in self.feet.iter().enumerate() {
            let load: f64 = foot.contacts.iter().map(|&c| sensors.contact_forces[c]).sum();
            state.load[i] = load;
            state.contact[i] =
                load > (weight * LOAD[usize::from(state.contact[i] && !first)]).max(zero(foot.contacts.len()));
        }

        let rate = Vector3::from(sensors.gyro);
        let filter = self.filter.get_or_insert_with(|| {
            let [w, x, y, z] = sensors.orientation;
            let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
            let ground = self.feet.each_ref().map(|foot| data.point(&foot.reference));
            let imu = robot.imu.point;
            let at = turn * (imu - 0.5 * (ground[0] + ground[1]));
            filter(robot, sensors.orientation, at, turn * rate.cross(&imu))
        });
        if period > 0.0 {
            filter.propagate(&rate, &sensors.accelerometer.into(), period);
        }
        filter.correct(&contacts);
        if period > 0.0 {
            let [least, slow, lag, sway] = REST;
            self.turning += (rate - self.turning) * (1.0 - (-period / lag).exp());
            let quiet = (self.turning - filter.gyro_bias).amax() < slow + 2.0 * robot.senses.gyro_bias;
            self.still = if quiet && self.bears.iter().all(|&bears| bears) { self.still + period } else { 0.0 };
            if self.still > least {
                filter.rest(&rate, sway, period);
            }
        }

        let rate = rate - filter.gyro_bias;
        let lever = filter.rotation * robot.imu.point;
        let position = filter.position - lever;
        let velocity = filter.velocity - (filter.rotation * rate).cross(&lever);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(filter.rotation));
        state.time = sensors.time;
        state.q[..3].copy_from_slice(position.as_slice());
        state.q[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
        state.v[..3].copy_from_slice(velocity.as_slice());
        state.v[3..6].copy_from_slice(rate.as_slice());
        state.v[6..].copy_from_slice(&sensors.joint_velocities);
    }
}

/// A filter for `robot` at rest with its inertial sensor at `position` (m), moving with `velocity` (m/s).
fn filter(robot: &Robot, orientation: [f64; 4], position: Vector3<f64>, velocity: Vector3<f64>) -> ContactEkf {
    let senses = &robot.senses;
    // A reading a period, each with its own noise: the density is the deviation times the root of the period.
    let root = robot.drives.period.sqrt();
    let biases = [senses.gyro_bias.max(START[1]), senses.accelerometer_bias.max(START[2])];
    let leg = robot.stand[2];
    let noise = Noise {
        gyro: senses.gyro_noise.max(LEAST[0]) * root,
        accelerometer: senses.accelerometer_noise.max(LEAST[1]) * root,
        gyro_bias: WANDER * biases[0],
        accelerometer_bias: WANDER * biases[1],
        slip: SLIP,
        kinematics: (senses.encoder_offset.max(senses.encoder_resolution) * leg).max(LEAST[2]),
    };
    let [w, x, y, z] = orientation;
    let turn: Matrix3<f64> =
        UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner();
    let spread = [senses.tilt_bias.max(START[0]), 0.01, 0.001, biases[0], biases[1]];
    ContactEkf::new(noise, turn, velocity, position, spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that stands still, first on sensors of `loads[0]` (N) each, at last of `loads[1]`, its gyro off by `bias` (rad/s) about the
    /// vertical.
    fn standing(name: &str, loads: [f64; 2], bias: f64, seconds: f64) -> (Estimator, StateEstimate) {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name);
        let robot = Arc::new(Robot::load(&folder).unwrap());
        let mut estimator = Estimator::new(Arc::clone(&robot));
        let mut state = StateEstimate::standing(&robot);
        let mut sensors = Sensors {
            joint_positions: robot.stand[7..].to_vec(),
            joint_velocities: vec![0.0; robot.joints.len()],
            orientation: [1.0, 0.0, 0.0, 0.0],
            gyro: [0.0, 0.0, bias],
            accelerometer: [0.0, 0.0, GRAVITY],
            contact_forces: vec![loads[0]; robot.contacts.len()],
            ..Sensors::default()
        };
        for tick in 1..=(seconds / 0.002) as usize {
            sensors.time = 0.002 * tick as f64;
            estimator.update(&sensors, &mut state);
        }
        sensors.contact_forces.fill(loads[1]);
        estimator.update(&sensors, &mut state);
        (estimator, state)
    }

    #[test]
    fn a_robot_at_rest_finds_its_gyros_bias_about_the_vertical_and_keeps_its_heading() {
        for bias in [0.006, -0.009] {
            let (estimator, state) = standing("nao", [6.5; 2], bias, 1.5);
            let found = estimator.filter().unwrap().gyro_bias.z;
            assert!((found - bias).abs() < 0.05 * bias.abs(), "{found} for {bias}");
            assert!(state.contact == [true; 2] && state.q[6].abs() < 2e-3, "{state:?}");
        }
    }

    #[test]
    fn a_robot_that_turns_is_not_at_rest() {
        let (estimator, _) = standing("nao", [6.5; 2], 0.3, 1.0);
        let with_feet = estimator.filter().unwrap().covariance()[(21 + 2, 21 + 2)];
        let (estimator, _) = standing("nao", [6.5; 2], 0.0, 1.0);
        let at_rest = estimator.filter().unwrap().covariance()[(21 + 2, 21 + 2)];
        assert!(with_feet > 4.0 * at_rest, "{with_feet} {at_rest}");
    }

    #[test]
    fn what_a_sensor_reads_by_its_zero_alone_is_no_load() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/nao");
        let robot = Robot::load(&folder).unwrap();
        // More than the share of the weight from which a foot stood, once it did: that left it standing in the air.
        let off = 1.4 * robot.senses.foot_offset;
        let foot = robot.contacts.len() as f64 / 2.0;
        assert!(foot * off > LOAD[1] * robot.mass() * GRAVITY);
        let (_, state) = standing("nao", [6.5, off], 0.0, 0.01);
        assert_eq!(state.contact, [false; 2]);
        let (_, state) = standing("nao", [6.5, 3.0], 0.0, 0.01);
        assert_eq!(state.contact, [true; 2]);
    }
}
