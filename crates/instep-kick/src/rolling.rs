//! How fast the ball rolls, as far as a camera's sights of it tell while the robot stands: a straight line through them by least
//! squares.
//!
//! The errors of successive sights are alike (a first-order Gauss-Markov process, as `instep-robot`'s [`Camera`] has it), so the
//! scatter about the line says nothing of the line's error: that follows from the camera. A speed that such errors alone
//! could make is none. Neither the deceleration nor a robot that moves is allowed for.

use instep_robot::control::BallObservation;
use instep_robot::senses::Camera;
use nalgebra::Vector2;

/// Fewer sights than this have no line.
const LEAST: usize = 4;
/// A speed counts from so many of its standard deviations on.
const SURE: f64 = 3.0;

/// The ball's velocity on the ground (m/s, axes of the robot's heading) by `sights`, newest last, of `camera` at `height` (m)
/// above the ground; zero where they cannot tell it from a ball at rest.
#[must_use]
pub fn ball_velocity(sights: &[BallObservation], camera: &Camera, height: f64) -> [f64; 2] {
    let count = sights.len();
    if count < LEAST {
        return [0.0; 2];
    }
    let place = |sight: &BallObservation| Vector2::new(sight.position[0], sight.position[1]);
    let middle = sights.iter().map(|sight| sight.time).sum::<f64>() / count as f64;
    let spread: f64 = sights.iter().map(|sight| (sight.time - middle).powi(2)).sum();
    if spread <= 0.0 {
        return [0.0; 2];
    }
    let weight = |sight: &BallObservation| (sight.time - middle) / spread;
    let velocity: Vector2<f64> = sights.iter().map(|sight| place(sight) * weight(sight)).sum();
    // Variance of the slope for errors whose correlation falls off exponentially, in terms of that of one sight.
    let alike = |a: &BallObservation, b: &BallObservation| match camera.correlation {
        time if time > 0.0 => (-(a.time - b.time).abs() / time).exp(),
        _ => f64::from(u8::from(a.time == b.time)),
    };
    let variance: f64 =
        sights.iter().flat_map(|a| sights.iter().map(move |b| weight(a) * weight(b) * alike(a, b))).sum();
    let distance = sights.iter().map(|sight| place(sight).norm()).sum::<f64>() / count as f64;
    let of_one = camera.angle_error * distance.hypot(height).powi(2) / height;
    if velocity.norm() < SURE * of_one * variance.max(0.0).sqrt() {
        return [0.0; 2];
    }
    velocity.into()
}

#[cfg(test)]
mod tests {
    use instep_robot::LinkPoint;
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    fn camera(angle_error: f64) -> Camera {
        Camera {
            at: LinkPoint { link: 0, point: Vector3::zeros() },
            link_from_camera: UnitQuaternion::identity(),
            field_of_view: [1.0; 2],
            period: 1.0 / 30.0,
            latency: [0.03, 0.06],
            angle_error,
            correlation: 0.5,
        }
    }

    /// Sights at 30 Hz of a ball that rolls from `start`, each of which is off by `error` of its number.
    fn sights(start: [f64; 2], velocity: [f64; 2], error: impl Fn(usize) -> f64) -> Vec<BallObservation> {
        let at = |i: usize| {
            let time = i as f64 / 30.0;
            let place = [0, 1].map(|k| start[k] + velocity[k] * time + error(i));
            BallObservation { time, position: [place[0], place[1], 0.05] }
        };
        (0..16).map(at).collect()
    }

    #[test]
    fn a_rolling_balls_velocity_is_the_slope_of_its_sights() {
        let found = ball_velocity(&sights([1.0, 0.2], [-0.8, 0.1], |_| 0.01), &camera(0.008), 0.5);
        assert!((found[0] + 0.8).abs() < 1e-9 && (found[1] - 0.1).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_drift_that_the_cameras_error_can_make_is_no_speed() {
        // 1 cm in half a second, 0.5 m away: within three deviations of a camera with 8 mrad, far beyond those of one with 0.5.
        let drifting = sights([0.5, 0.0], [0.0; 2], |i| 0.01 * i as f64 / 15.0);
        assert_eq!(ball_velocity(&drifting, &camera(0.008), 0.5), [0.0; 2]);
        let [x, y] = ball_velocity(&drifting, &camera(0.0005), 0.5);
        assert!((x - 0.02).abs() < 1e-9 && (y - 0.02).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn too_few_sights_and_sights_at_one_instant_tell_nothing() {
        let rolling = sights([1.0, 0.0], [-1.0, 0.0], |_| 0.0);
        assert_eq!(ball_velocity(&rolling[..3], &camera(0.008), 0.5), [0.0; 2]);
        let same = [rolling[0]; 5];
        assert_eq!(ball_velocity(&same, &camera(0.008), 0.5), [0.0; 2]);
    }

    #[test]
    fn the_slopes_deviation_is_that_of_correlated_errors() {
        // The threshold against the deviation over many draws of the same process.
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let keep = (-(1.0 / 30.0) / 0.5f64).exp();
        let (height, distance) = (0.5f64, 0.8f64);
        let of_one = 0.008 * (distance * distance + height * height) / height;
        let count = 4000;
        let beyond = (0..count).filter(|_| {
            let mut error = normal();
            let errors: Vec<f64> = (0..16)
                .map(|_| {
                    error = keep * error + (1.0 - keep * keep).sqrt() * normal();
                    error * of_one
                })
                .collect();
            let seen: Vec<_> = (0..16)
                .map(|i| BallObservation { time: i as f64 / 30.0, position: [distance + errors[i], 0.0, 0.05] })
                .collect();
            ball_velocity(&seen, &camera(0.008), height) != [0.0; 2]
        });
        // Three deviations of a normal error: 0.27 %.
        let share = beyond.count() as f64 / f64::from(count);
        assert!((0.0005..0.007).contains(&share), "{share}");
    }
}
