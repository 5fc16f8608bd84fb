//! The ball's track: a Kalman filter of position and velocity, six states (paper 4, section IV-A3).
//!
//! Constant velocity with rolling friction, white acceleration as its noise. A sight farther off than the gate is thrown
//! out; after [`LOST`] of them in a row the track begins anew, for the ball was kicked or the track was wrong. Without
//! sights it goes on and its covariance grows. Frame: one that stands (the field's or an odometry's).

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

/// Deviation of the ball's acceleration, m/s^2.
const ACCELERATION: f64 = 1.5;
/// The share of its speed that a ball on turf loses in a second.
const FRICTION: f64 = 0.35;
/// Gate: 99.9 % of a chi-square of three.
const GATE: f64 = 16.27;
/// Sights thrown out in a row after which the track begins anew.
pub const LOST: u32 = 5;
/// Deviation of a new track's velocity, m/s.
const FIRST_SPEED: f64 = 1.0;

/// The track.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Position (m), velocity (m/s).
    pub state: Vector6<f64>,
    /// Covariance of [`Track::state`].
    pub covariance: Matrix6<f64>,
    /// Time since the last sight that was taken, s.
    pub unseen: f64,
    refused: u32,
}

/// What became of a sight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// It moved the track.
    Used,
    /// It was too far off.
    Refused,
    /// The track began anew from it.
    Restarted,
}

impl Track {
    /// From a first sight, m, and its covariance.
    pub fn new(position: Vector3<f64>, covariance: Matrix3<f64>) -> Self {
        let mut track = Track { state: Vector6::zeros(), covariance: Matrix6::zeros(), unseen: 0.0, refused: 0 };
        track.restart(position, covariance);
        track
    }

    fn restart(&mut self, position: Vector3<f64>, covariance: Matrix3<f64>) {
        self.state = Vector6::zeros();
        self.state.fixed_rows_mut::<3>(0).copy_from(&position);
        self.covariance = Matrix6::identity() * FIRST_SPEED * FIRST_SPEED;
        self.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&covariance);
        (self.unseen, self.refused) = (0.0, 0);
    }

    /// Goes on by `dt` seconds.
    pub fn predict(&mut self, dt: f64) {
        let keep = (-FRICTION * dt).exp();
        let reach = (1.0 - keep) / FRICTION;
        let mut step = Matrix6::identity();
        for k in 0..3 {
            step[(k, k + 3)] = reach;
            step[(k + 3, k + 3)] = keep;
        }
        self.state = step * self.state;
        let push: SMatrix<f64, 6, 3> = SMatrix::from_fn(|i, k| {
            if i == k {
                0.5 * dt * dt
            } else if i == k + 3 {
                dt
            } else {
                0.0
            }
        });
        let noise = push * push.transpose() * (ACCELERATION * ACCELERATION);
        self.covariance = step * self.covariance * step.transpose() + noise;
        self.unseen += dt;
    }

    /// Takes a sight, m, with its covariance.
    pub fn sight(&mut self, position: Vector3<f64>, covariance: Matrix3<f64>) -> Taken {
        let innovation = position - self.state.fixed_rows::<3>(0);
        let spread = self.covariance.fixed_view::<3, 3>(0, 0) + covariance;
        let inverse = spread.try_inverse().filter(|_| position.iter().all(|x| x.is_finite()));
        let Some(inverse) = inverse else { return Taken::Refused };
        if (innovation.transpose() * inverse * innovation)[0] > GATE {
            self.refused += 1;
            if self.refused >= LOST {
                self.restart(position, covariance);
                return Taken::Restarted;
            }
            return Taken::Refused;
        }
        let gain = self.covariance.fixed_view::<6, 3>(0, 0) * inverse;
        self.state += gain * innovation;
        // Joseph's form keeps it symmetric and positive.
        let mut rest = Matrix6::identity();
        let mut left = rest.fixed_view_mut::<6, 3>(0, 0);
        left -= gain;
        self.covariance = rest * self.covariance * rest.transpose() + gain * covariance * gain.transpose();
        (self.unseen, self.refused) = (0.0, 0);
        Taken::Used
    }

    /// Position, m.
    pub fn position(&self) -> Vector3<f64> {
        self.state.fixed_rows::<3>(0).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    /// A rolling ball seen at 60 Hz with 5 cm of noise, hidden for a second: within 0.3 m when it comes back, and the
    /// covariance says as much as it is off.
    #[test]
    fn a_track_goes_on_through_a_second_without_sights() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let (mut worst, mut squares) = (0.0f64, 0.0);
        for _ in 0..50 {
            let noise = Matrix3::identity() * 0.0025;
            let speed: f64 = rng.random_range(0.0..1.5);
            let angle: f64 = rng.random_range(-3.1..3.1);
            let at = |t: f64| {
                let way = speed * (1.0 - (-FRICTION * t).exp()) / FRICTION;
                Vector3::new(2.0 + way * angle.cos(), way * angle.sin(), 0.11)
            };
            let mut draw = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            let mut seen = |t: f64| at(t) + Vector3::new(draw(), draw(), draw()) * 0.05;
            let mut track = Track::new(seen(0.0), noise);
            for k in 1..=60 {
                track.predict(1.0 / 60.0);
                track.sight(seen(f64::from(k) / 60.0), noise);
            }
            let before = track.covariance[(0, 0)];
            for _ in 0..60 {
                track.predict(1.0 / 60.0);
            }
            let error = track.position() - at(2.0);
            worst = worst.max(error.norm());
            squares += error.x * error.x / track.covariance[(0, 0)];
            assert!(track.covariance[(0, 0)] > 4.0 * before && (track.unseen - 1.0).abs() < 1e-9);
        }
        assert!(worst < 0.3, "{worst}");
        assert!((0.05..1.5).contains(&(squares / 50.0)), "{squares}");
    }

    #[test]
    fn one_false_sight_is_refused_and_many_begin_anew() {
        let noise = Matrix3::identity() * 0.0025;
        let mut track = Track::new(Vector3::new(2.0, 0.0, 0.1), noise);
        for _ in 0..60 {
            track.predict(1.0 / 60.0);
            track.sight(Vector3::new(2.0, 0.0, 0.1), noise);
        }
        let far = Vector3::new(5.0, 1.0, 0.1);
        assert_eq!(track.sight(far, noise), Taken::Refused);
        assert!((track.position().x - 2.0).abs() < 0.05);
        assert_eq!(track.sight(Vector3::new(f64::NAN, 0.0, 0.0), noise), Taken::Refused);
        let last = (0..LOST).map(|_| track.sight(far, noise)).find(|t| *t == Taken::Restarted);
        assert!(last.is_some() && (track.position() - far).norm() < 1e-9);
    }
}
