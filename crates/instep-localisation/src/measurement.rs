//! A sight as range and bearing, with the noise that is expected of it, and what a pose predicts for it.

use instep_field::{LandmarkClass, Pose, wrap};

use crate::{Noise, Sight};

/// A sight in polar form.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polar {
    pub(crate) class: LandmarkClass,
    /// m
    pub(crate) range: f64,
    /// rad
    pub(crate) bearing: f64,
    /// m
    pub(crate) range_sigma: f64,
    /// rad
    pub(crate) bearing_sigma: f64,
}

impl Polar {
    pub(crate) fn of(sight: &Sight, noise: &Noise) -> Polar {
        let [x, y] = sight.position;
        let range = x.hypot(y);
        let (range_sigma, bearing_sigma) = match sight.covariance {
            Some([xx, xy, yy]) => {
                let [c, s] = [x / range, y / range];
                let along = c * c * xx + 2.0 * c * s * xy + s * s * yy;
                let across = s * s * xx - 2.0 * c * s * xy + c * c * yy;
                (along.sqrt(), across.sqrt() / range)
            }
            None => (noise.range_sigma(range), noise.bearing_sigma(range)),
        };
        Polar { class: sight.class, range, bearing: y.atan2(x), range_sigma, bearing_sigma }
    }

    /// In the robot's frame, m, after the range has been divided by `scale`.
    pub(crate) fn point(&self, scale: f64) -> [f64; 2] {
        let (s, c) = self.bearing.sin_cos();
        [self.range / scale * c, self.range / scale * s]
    }
}

/// Range and bearing of a landmark from a pose, with their slopes along (x, y, heading).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Expected {
    pub(crate) range: f64,
    pub(crate) bearing: f64,
    pub(crate) range_slope: [f64; 3],
    pub(crate) bearing_slope: [f64; 3],
}

impl Expected {
    pub(crate) fn of(pose: &Pose, landmark: [f64; 2]) -> Expected {
        let [dx, dy] = [landmark[0] - pose.x, landmark[1] - pose.y];
        // Nearer than a centimetre there is no direction; the slopes stay finite.
        let range = dx.hypot(dy).max(0.01);
        let square = range * range;
        Expected {
            range,
            bearing: wrap(dy.atan2(dx) - pose.heading),
            range_slope: [-dx / range, -dy / range, 0.0],
            bearing_slope: [dy / square, -dx / square, -1.0],
        }
    }
}

/// Cauchy's weight for a squared normalised residual, with corner `c`.
pub(crate) fn cauchy(square: f64, c: f64) -> f64 {
    1.0 / (1.0 + square / (c * c))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slopes against central differences.
    #[test]
    fn slopes_are_those_of_the_values() {
        let pose = Pose::new(1.2, -0.7, 2.6);
        let landmark = [-4.0, 3.0];
        let e = Expected::of(&pose, landmark);
        for (k, d) in [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]].into_iter().enumerate() {
            let at = |sign: f64| {
                Expected::of(
                    &Pose::new(pose.x + sign * d[0], pose.y + sign * d[1], pose.heading + sign * d[2]),
                    landmark,
                )
            };
            let (a, b) = (at(1.0), at(-1.0));
            assert!(((a.range - b.range) / 2e-6 - e.range_slope[k]).abs() < 1e-8);
            assert!((wrap(a.bearing - b.bearing) / 2e-6 - e.bearing_slope[k]).abs() < 1e-8);
        }
    }

    #[test]
    fn a_given_covariance_is_turned_into_range_and_bearing() {
        let noise = Noise::default();
        let sight = Sight {
            class: LandmarkClass::L,
            position: [0.0, 4.0],
            confidence: 1.0,
            covariance: Some([0.01, 0.0, 0.04]),
        };
        let polar = Polar::of(&sight, &noise);
        assert!((polar.range_sigma - 0.2).abs() < 1e-12 && (polar.bearing_sigma - 0.1 / 4.0).abs() < 1e-12);
    }
}
