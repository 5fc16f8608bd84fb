//! An extended Kalman filter with data association, as teams run it: each sight goes to the nearest landmark of its
//! class within a gate, one to one, and corrects pose and covariance once.
//!
//! Source: Thrun, Burgard, Fox, Probabilistic Robotics (2005), 7.4 to 7.6. No robust weights, no second association, no
//! scale, no recovery: what the shipped filter adds is the difference between the two in the table.

use std::sync::Arc;

use instep_field::{Pose, wrap};
use nalgebra::{Matrix3, Vector3};

use crate::association::Association;
use crate::localiser::{Method, Start};
use crate::map::Map;
use crate::measurement::{Expected, Polar};
use crate::window::nearest_first;
use crate::{Frame, OdometryNoise, Settings};

/// The extended Kalman filter.
#[derive(Debug, Clone)]
pub struct Kalman {
    map: Arc<Map>,
    settings: Settings,
    pose: Pose,
    covariance: Matrix3<f64>,
    sights: Vec<Polar>,
    association: Association,
}

impl Kalman {
    /// A filter that has not been started.
    pub fn new(map: Arc<Map>, settings: Settings) -> Kalman {
        Kalman {
            association: Association::with_capacity(&map, settings.filter.most_sights),
            map,
            settings,
            pose: Pose::default(),
            covariance: Matrix3::identity(),
            sights: Vec::with_capacity(64),
        }
    }
}

/// Pose and covariance that a start stands for; what is unknown is the middle with a wide one.
pub(crate) fn begin(map: &Map, start: Start) -> (Pose, Matrix3<f64>) {
    let [length, width] = map.half();
    let (pose, sigmas) = match start {
        Start::Near { pose, position_sigma: p, heading_sigma: h } => (pose, [p, p, h]),
        Start::OwnHalf => (Pose::new(-length / 2.0, 0.0, 0.0), [length / 3.5, width / 1.7, 1.8]),
        Start::Anywhere => (Pose::default(), [length / 1.7, width / 1.7, 1.8]),
    };
    (pose, Matrix3::from_diagonal(&Vector3::from(sigmas).map(|s| s * s)))
}

/// Variances of a step's (x, y, heading) where scale and bias are not estimated: their error counts as noise.
pub(crate) fn step_variance(odometry: &OdometryNoise, motion: &Pose, dt: f64) -> Vector3<f64> {
    let step = motion.x.hypot(motion.y);
    let position = 1.5 * odometry.slip * odometry.slip * dt + (odometry.step_share * step).powi(2);
    let heading = (1.5 * odometry.heading).powi(2) * dt + (odometry.turn_share * motion.heading).powi(2);
    Vector3::new(position, position, heading)
}

impl Method for Kalman {
    fn name(&self) -> &'static str {
        "Kalman filter"
    }

    fn start(&mut self, start: Start) {
        (self.pose, self.covariance) = begin(&self.map, start);
    }

    fn predict(&mut self, motion: &Pose, dt: f64) {
        let (s, c) = self.pose.heading.sin_cos();
        let mut f = Matrix3::identity();
        f[(0, 2)] = -s * motion.x - c * motion.y;
        f[(1, 2)] = c * motion.x - s * motion.y;
        self.pose = self.pose.then(motion);
        let q = Matrix3::from_diagonal(&step_variance(&self.settings.odometry, motion, dt));
        self.covariance = f * self.covariance * f.transpose() + q;
    }

    fn update(&mut self, frame: &Frame) {
        let filter = &self.settings.filter;
        nearest_first(&frame.landmarks, &self.settings.noise, filter.most_sights, &mut self.sights);
        self.association.find(&self.map, &self.sights, &self.pose, &self.covariance, 1.0, filter.gate);
        for (sight, landmark) in self.sights.iter().zip(&self.association.landmark) {
            let Some(landmark) = *landmark else { continue };
            let expected = Expected::of(&self.pose, self.map.landmarks()[landmark].1);
            let mut step = Vector3::zeros();
            for (slope, residual, sigma) in [
                (expected.range_slope, sight.range - expected.range, sight.range_sigma),
                (expected.bearing_slope, wrap(sight.bearing - expected.bearing), sight.bearing_sigma),
            ] {
                let slope = Vector3::from(slope);
                let spread = self.covariance * slope;
                let gain = spread / (slope.dot(&spread) + filter.information_divisor * sigma * sigma);
                step += gain * (residual - slope.dot(&step));
                self.covariance -= gain * spread.transpose();
            }
            self.pose = Pose::new(self.pose.x + step[0], self.pose.y + step[1], self.pose.heading + step[2]);
        }
        self.covariance = 0.5 * (self.covariance + self.covariance.transpose());
    }

    fn pose(&self) -> Pose {
        self.pose
    }

    fn covariance(&self) -> Option<Matrix3<f64>> {
        Some(self.covariance)
    }
}
