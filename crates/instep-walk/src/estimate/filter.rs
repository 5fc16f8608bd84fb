//! Contact-aided right-invariant extended Kalman filter (Hartley, Ghaffari, Eustice, Grizzle 2019, arXiv 1904.09251).
//!
//! State: orientation R, velocity v, position p of the inertial sensor in the world, contact points d_i that stand on the
//! ground, and the biases of gyro and accelerometer. The error is eta = X^ X^-1 = exp(xi), so that propagation and measurement are
//! linear in xi whatever the state (their theorems 1 and 2); only the biases bring the state back in.
//!
//! Covariance is of a fixed size: a point that does not stand has zeros, and gets its block when it comes down (their
//! section VI). Nothing is allocated. Yaw and place are not observable and drift. The filter is told which points stand and does not
//! find out by itself; of those it throws out what has slipped.

use nalgebra::{Const, Matrix3, MatrixViewMut, SMatrix, SVector, Vector3};

use super::group::{gamma, skew};

/// Contact points that the state has room for: heel and toe of each foot.
pub const CONTACTS: usize = 4;
/// Length of the error xi: R, v, p, d_i, gyro bias, accelerometer bias, three each.
pub const ERROR: usize = 15 + 3 * CONTACTS;
/// Squared Mahalanobis distance of an innovation from which its point has slipped: one in 10^6 of those that stand (chi-square
/// with three degrees of freedom).
const GATE: f64 = 30.0;
/// First rows of the error's parts.
const TURN: usize = 0;
const VELOCITY: usize = 3;
const POSITION: usize = 6;
const POINTS: usize = 9;
const GYRO_BIAS: usize = POINTS + 3 * CONTACTS;
const ACCELEROMETER_BIAS: usize = GYRO_BIAS + 3;

/// A square matrix of the error's size.
type Square = SMatrix<f64, ERROR, ERROR>;

/// How good the senses are: densities of white noise (per square root of Hz) and standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of the gyro, rad/s/sqrt(Hz).
    pub gyro: f64,
    /// Of the accelerometer, m/s^2/sqrt(Hz).
    pub accelerometer: f64,
    /// Of the gyro's bias, rad/s^2/sqrt(Hz).
    pub gyro_bias: f64,
    /// Of the accelerometer's bias, m/s^3/sqrt(Hz).
    pub accelerometer_bias: f64,
    /// How a standing point creeps, m/s/sqrt(Hz).
    pub slip: f64,
    /// Standard deviation of a contact point's place by the encoders, m on each axis.
    pub kinematics: f64,
}

/// A contact point as the legs tell it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Whether it stands on the ground.
    pub stands: bool,
    /// Its place in the inertial sensor's frame, m.
    pub point: Vector3<f64>,
}

/// The filter.
#[derive(Debug, Clone)]
pub struct ContactEkf {
    noise: Noise,
    gravity: Vector3<f64>,
    /// `world_from_imu`.
    pub rotation: Matrix3<f64>,
    /// Of the inertial sensor in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Of the inertial sensor in the world, m.
    pub position: Vector3<f64>,
    /// Standing points in the world, m.
    points: [Vector3<f64>; CONTACTS],
    stands: [bool; CONTACTS],
    /// Of the gyro, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Of the accelerometer, m/s^2.
    pub accelerometer_bias: Vector3<f64>,
    covariance: Square,
}

impl ContactEkf {
    /// At `rotation` (`world_from_imu`), `velocity` (m/s) and `position` (m), with the standard deviations `spread` of turn (rad),
    /// velocity (m/s), position (m), gyro bias (rad/s) and accelerometer bias (m/s^2) on each axis.
    #[must_use]
    pub fn new(
        noise: Noise,
        rotation: Matrix3<f64>,
        velocity: Vector3<f64>,
        position: Vector3<f64>,
        spread: [f64; 5],
    ) -> Self {
        let mut covariance = Square::zeros();
        for (at, sigma) in [TURN, VELOCITY, POSITION, GYRO_BIAS, ACCELEROMETER_BIAS].into_iter().zip(spread) {
            block_mut(&mut covariance, at, at).fill_diagonal(sigma * sigma);
        }
        Self {
            noise,
            gravity: Vector3::new(0.0, 0.0, -crate::settings::GRAVITY),
            rotation,
            velocity,
            position,
            points: [Vector3::zeros(); CONTACTS],
            stands: [false; CONTACTS],
            gyro_bias: Vector3::zeros(),
            accelerometer_bias: Vector3::zeros(),
            covariance,
        }
    }

    /// Covariance of the right-invariant error, ordered as [`ERROR`] says.
    #[must_use]
    pub fn covariance(&self) -> &Square {
        &self.covariance
    }

    /// Carries the state over `period` (s) with what gyro (rad/s) and accelerometer (specific force, m/s^2) read, held over it.
    pub fn propagate(&mut self, gyro: &Vector3<f64>, accelerometer: &Vector3<f64>, period: f64) {
        self.add_process_noise(period);
        let transition = self.transition(period);
        self.covariance = transition * self.covariance * transition.transpose();

        let turn = (gyro - self.gyro_bias) * period;
        let force = accelerometer - self.accelerometer_bias;
        let acceleration = self.rotation * gamma(1, &turn) * force + self.gravity;
        self.position +=
            self.velocity * period + (self.rotation * gamma(2, &turn) * force + 0.5 * self.gravity) * (period * period);
        self.velocity += acceleration * period;
        self.rotation *= gamma(0, &turn);
    }

    /// exp(A `period`) of the error, exactly for the state as it is: A^4 = 0.
    fn transition(&self, period: f64) -> Square {
        let mut phi = Square::identity();
        let t = [period, period * period / 2.0, period.powi(3) / 6.0];
        let gravity = skew(&self.gravity);
        let turned = gravity * self.rotation;
        let moved = |v: &Vector3<f64>| skew(v) * self.rotation;
        let (velocity, position) = (moved(&self.velocity), moved(&self.position));
        block_mut(&mut phi, VELOCITY, TURN).copy_from(&(gravity * t[0]));
        block_mut(&mut phi, POSITION, TURN).copy_from(&(gravity * t[1]));
        block_mut(&mut phi, POSITION, VELOCITY).fill_diagonal(t[0]);
        block_mut(&mut phi, TURN, GYRO_BIAS).copy_from(&(self.rotation * -t[0]));
        block_mut(&mut phi, VELOCITY, GYRO_BIAS).copy_from(&(velocity * -t[0] - turned * t[1]));
        block_mut(&mut phi, POSITION, GYRO_BIAS).copy_from(&(position * -t[0] - velocity * t[1] - turned * t[2]));
        block_mut(&mut phi, VELOCITY, ACCELEROMETER_BIAS).copy_from(&(self.rotation * -t[0]));
        block_mut(&mut phi, POSITION, ACCELEROMETER_BIAS).copy_from(&(self.rotation * -t[1]));
        for i in (0..CONTACTS).filter(|&i| self.stands[i]) {
            block_mut(&mut phi, POINTS + 3 * i, GYRO_BIAS).copy_from(&(moved(&self.points[i]) * -t[0]));
        }
        phi
    }

    /// Adds what noise brings in `period`: Ad_X cov Ad_X^T, in which isotropic noise loses the rotation.
    fn add_process_noise(&mut self, period: f64) {
        let noise = &self.noise;
        let density = |sigma: f64| sigma * sigma * period;
        let mut gyro = SMatrix::<f64, ERROR, 3>::zeros();
        gyro.fixed_view_mut::<3, 3>(TURN, 0).fill_with_identity();
        gyro.fixed_view_mut::<3, 3>(VELOCITY, 0).copy_from(&skew(&self.velocity));
        gyro.fixed_view_mut::<3, 3>(POSITION, 0).copy_from(&skew(&self.position));
        let mut diagonal = SVector::<f64, ERROR>::zeros();
        diagonal.fixed_rows_mut::<3>(VELOCITY).fill(density(noise.accelerometer));
        diagonal.fixed_rows_mut::<3>(GYRO_BIAS).fill(density(noise.gyro_bias));
        diagonal.fixed_rows_mut::<3>(ACCELEROMETER_BIAS).fill(density(noise.accelerometer_bias));
        for i in (0..CONTACTS).filter(|&i| self.stands[i]) {
            gyro.fixed_view_mut::<3, 3>(POINTS + 3 * i, 0).copy_from(&skew(&self.points[i]));
            diagonal.fixed_rows_mut::<3>(POINTS + 3 * i).fill(density(noise.slip));
        }
        self.covariance += gyro * gyro.transpose() * density(noise.gyro);
        for (i, value) in diagonal.iter().enumerate() {
            self.covariance[(i, i)] += value;
        }
    }

    /// The sensor does not turn about the vertical: what the gyro reads of that (rad/s) over `period` (s) is its bias, its noise, and a sway of
    /// the density `sway` (rad/s/sqrt(Hz)). Gravity shows the other two axes; feet that creep never show this one.
    pub fn rest(&mut self, gyro: &Vector3<f64>, sway: f64, period: f64) {
        let vertical: Vector3<f64> = self.rotation.row(2).transpose();
        let base: SVector<f64, ERROR> = self.covariance.fixed_columns::<3>(GYRO_BIAS) * vertical;
        let noise = (self.noise.gyro.powi(2) + sway * sway) / period;
        let gain = base / (vertical.dot(&base.fixed_rows::<3>(GYRO_BIAS)) + noise);
        self.covariance -= gain * base.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        self.retract(&(gain * vertical.dot(&(gyro - self.gyro_bias))));
    }

    /// Takes what the legs say of every contact point: those that stood and stand correct the state, new ones enter it, those
    /// that left the ground leave it. A point whose place cannot be that of a standing one has slipped: it stands anew where it is.
    pub fn correct(&mut self, contacts: &[Contact; CONTACTS]) {
        for (i, contact) in contacts.iter().enumerate() {
            match (self.stands[i], contact.stands) {
                (true, true) if !self.correct_by(i, &contact.point) => self.drop_point(i),
                (true, false) => self.drop_point(i),
                _ => {}
            }
        }
        // After the corrections, so that a new point inherits the better state.
        for (i, contact) in contacts.iter().enumerate() {
            if contact.stands && !self.stands[i] {
                self.add_point(i, &contact.point);
            }
        }
    }

    /// Innovation R h - (d - p) = xi_p - xi_d + R noise; X <- exp(-K z) X (their eqs 20 to 22, with the signs of eta = X^ X^-1).
    /// Whether the point stood still: an innovation beyond [`GATE`] corrects nothing.
    fn correct_by(&mut self, i: usize, point: &Vector3<f64>) -> bool {
        let at = POINTS + 3 * i;
        let innovation = self.rotation * point - (self.points[i] - self.position);
        let gain_base: SMatrix<f64, ERROR, 3> =
            self.covariance.fixed_columns::<3>(POSITION) - self.covariance.fixed_columns::<3>(at);
        let mut spread: Matrix3<f64> = gain_base.fixed_rows::<3>(POSITION) - gain_base.fixed_rows::<3>(at);
        spread += Matrix3::from_diagonal_element(self.noise.kinematics * self.noise.kinematics);
        // Positive definite by the encoders' noise; were that zero and all known, there would be nothing to correct.
        let Some(inverse) = spread.try_inverse() else { return true };
        if innovation.dot(&(inverse * innovation)) > GATE {
            return false;
        }
        let gain = gain_base * inverse;
        self.covariance -= gain * gain_base.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        self.retract(&(gain * -innovation));
        true
    }

    /// X <- exp(xi) X for the group's part, addition for the biases.
    fn retract(&mut self, xi: &SVector<f64, ERROR>) {
        let part = |at: usize| Vector3::from(xi.fixed_rows::<3>(at));
        let (turn, jacobian) = (gamma(0, &part(TURN)), gamma(1, &part(TURN)));
        self.rotation = turn * self.rotation;
        self.velocity = turn * self.velocity + jacobian * part(VELOCITY);
        self.position = turn * self.position + jacobian * part(POSITION);
        for i in (0..CONTACTS).filter(|&i| self.stands[i]) {
            self.points[i] = turn * self.points[i] + jacobian * part(POINTS + 3 * i);
        }
        self.gyro_bias += part(GYRO_BIAS);
        self.accelerometer_bias += part(ACCELEROMETER_BIAS);
        // One Newton step toward the nearest rotation: rounding must not pile up over hours.
        let gram = self.rotation.transpose() * self.rotation;
        self.rotation *= Matrix3::from_diagonal_element(1.5) - gram * 0.5;
    }

    /// d = p + R h, hence xi_d = xi_p + R noise (their section VI-B).
    fn add_point(&mut self, i: usize, point: &Vector3<f64>) {
        let at = POINTS + 3 * i;
        self.points[i] = self.position + self.rotation * point;
        self.stands[i] = true;
        let rows: SMatrix<f64, 3, ERROR> = self.covariance.fixed_rows::<3>(POSITION).into_owned();
        self.covariance.fixed_rows_mut::<3>(at).copy_from(&rows);
        let columns: SMatrix<f64, ERROR, 3> = self.covariance.fixed_columns::<3>(POSITION).into_owned();
        self.covariance.fixed_columns_mut::<3>(at).copy_from(&columns);
        let spread = self.noise.kinematics * self.noise.kinematics;
        for axis in at..at + 3 {
            self.covariance[(axis, axis)] += spread;
        }
    }

    /// Marginalises a point out (their section VI-A).
    fn drop_point(&mut self, i: usize) {
        let at = POINTS + 3 * i;
        self.stands[i] = false;
        self.covariance.fixed_rows_mut::<3>(at).fill(0.0);
        self.covariance.fixed_columns_mut::<3>(at).fill(0.0);
    }
}

/// The 3 x 3 block whose first row and column are given.
fn block_mut(
    matrix: &mut Square,
    row: usize,
    column: usize,
) -> MatrixViewMut<'_, f64, Const<3>, Const<3>, Const<1>, Const<ERROR>> {
    matrix.fixed_view_mut::<3, 3>(row, column)
}

#[cfg(test)]
mod tests;
