//! Where the zero-moment point and the centre of mass are: paper 5, section 3.1.
//!
//! Measured: the zero-moment point from the feet's force sensors, equation (5), and the centre of mass by forward
//! kinematics of the measured joints, level by the inertial sensor. Believed: the linear inverted pendulum, equation (7),
//! carried on by the jerk that the controller asked for. A Kalman filter (Kalman, A new approach to linear filtering and
//! prediction problems, 1960) with constant gains fuses the two, one axis at a time, with the state of the preview
//! controller: position, speed and acceleration of the centre of mass. Its gains come from the Riccati equation of the
//! transposed system.
//!
//! The paper prints (7) as p = (z - p_z) a / (a_z + g). That is the distance of the zero-moment point from the centre of
//! mass, reversed: a body at rest would have it at the origin. Its own c = (1, 0, -z / g) says what is meant,
//! p = x - (z - p_z) a / (a_z + g), and that is what stands here, with a_z = 0 as in c.

use instep_motion::phase::Side;
use instep_robot::control::Sensors;
use instep_robot::{LinkPoint, Robot};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::preview::regulator::cart_table;
use crate::preview::riccati;
use crate::whole_body::drive::{GRAVITY, LOADED, up};
use instep_robot::tree::{Tree, TreePose};

/// How much the filter trusts what; standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trust {
    /// Of the jerk that disturbs the pendulum, m/s^3: larger follows the sensors sooner.
    pub jerk: f64,
    /// Of the centre of mass by kinematics, m.
    pub com: f64,
    /// Of the zero-moment point by the force sensors, m: what the pendulum leaves out (the swinging leg) is in here.
    pub zmp: f64,
}

/// The filter of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    /// Rows: centre of mass, zero-moment point (7).
    measures: Matrix2x3<f64>,
    gain: Matrix3x2<f64>,
    state: Vector3<f64>,
}

impl Filter {
    /// For samples `dt` (s) apart and a centre of mass `height` (m) over the ground, at rest at `start` (m).
    ///
    /// # Errors
    /// When the standard deviations cannot be.
    pub fn new(dt: f64, height: f64, trust: &Trust, start: f64) -> Result<Self, KickError> {
        let (a, b, c) = cart_table(dt, height);
        let measures = Matrix2x3::new(1.0, 0.0, 0.0, c[0], c[1], c[2]);
        let disturbance = b * trust.jerk * trust.jerk * b.transpose();
        let noise = Matrix2::from_diagonal(&Vector2::new(trust.com, trust.zmp).map(|s| s * s));
        let wrong = || KickError::Setting {
            field: "trust".into(),
            found: format!("{trust:?}"),
            expected: "standard deviations above 0 for which the Riccati equation has a solution".into(),
        };
        let p = riccati::solve(&a.transpose(), &measures.transpose(), &disturbance, &noise).ok_or_else(wrong)?;
        let spread = measures * p * measures.transpose() + noise;
        let gain = p * measures.transpose() * spread.try_inverse().ok_or_else(wrong)?;
        Ok(Self { a, b, measures, gain, state: Vector3::new(start, 0.0, 0.0) })
    }

    /// Starts again at rest at `start` (m).
    pub fn reset(&mut self, start: f64) {
        self.state = Vector3::new(start, 0.0, 0.0);
    }

    /// One sample on: the belief under `jerk` (m/s^3), corrected by what was measured (m). What was not measured, or is
    /// not a number, corrects nothing.
    pub fn step(&mut self, jerk: f64, com: Option<f64>, zmp: Option<f64>) {
        self.state = self.a * self.state + self.b * jerk;
        let believed = self.measures * self.state;
        let off = |measured: Option<f64>, believed: f64| {
            measured.map(|m| m - believed).filter(|off| off.is_finite()).unwrap_or(0.0)
        };
        self.state += self.gain * Vector2::new(off(com, believed[0]), off(zmp, believed[1]));
    }

    /// Position (m), speed (m/s) and acceleration (m/s^2) of the centre of mass.
    #[must_use]
    pub fn state(&self) -> Vector3<f64> {
        self.state
    }

    /// The zero-moment point, m.
    #[must_use]
    pub fn zmp(&self) -> f64 {
        (self.measures * self.state)[1]
    }
}

/// What the sensors say, in the support sole's frame turned level, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measured {
    /// Centre of mass over the ground, by kinematics.
    pub com: Option<[f64; 2]>,
    /// Zero-moment point by the force sensors, equation (5); `None` while the feet carry less than a tenth of the weight.
    pub zmp: Option<[f64; 2]>,
}

/// Reads the sensors; `pose` is scratch space and holds the measured pose afterwards.
pub fn measure(robot: &Robot, tree: &Tree, sensors: &Sensors, support: Side, pose: &mut TreePose) -> Measured {
    tree.update(&sensors.joint_positions, pose);
    let sole = &robot.leg(support).sole;
    let origin = pose.point(sole);
    // Level axes in the base frame: up by the inertial sensor, forward along the sole.
    let up = up(sensors);
    let left = up.cross(&(pose.rotation[sole.link] * Vector3::x())).normalize();
    let forward = left.cross(&up);
    let level = |point: Vector3<f64>| [forward.dot(&(point - origin)), left.dot(&(point - origin))];
    let com = level(tree.com(pose));
    // Equation (5).
    let (mut load, mut moment) = (0.0, [0.0; 2]);
    for (contact, force) in robot.contacts.iter().zip(&sensors.contact_forces) {
        let at = level(pose.point(&LinkPoint { link: contact.at.link, point: contact.at.point }));
        load += force;
        moment[0] += force * at[0];
        moment[1] += force * at[1];
    }
    let zmp = moment.map(|m| m / load);
    let finite = |at: [f64; 2]| at.iter().all(|v| v.is_finite()).then_some(at);
    let loaded = load > LOADED * tree.mass() * GRAVITY;
    Measured { com: finite(com), zmp: if loaded { finite(zmp) } else { None } }
}
