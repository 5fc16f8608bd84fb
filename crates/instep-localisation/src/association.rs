//! Which sight is which landmark: greedy, one to one, within a class, nearest first by Mahalanobis distance.

use instep_field::{Pose, wrap};
use nalgebra::Matrix3;

use crate::map::Map;
use crate::measurement::{Expected, Polar};

/// Room that is kept between calls, so that a call allocates nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Association {
    /// Squared distance, sight, landmark.
    near: Vec<(f64, usize, usize)>,
    taken: Vec<bool>,
    /// The landmark of each sight.
    pub(crate) landmark: Vec<Option<usize>>,
}

impl Association {
    /// Room for `sights` on `map`.
    pub(crate) fn with_capacity(map: &Map, sights: usize) -> Association {
        Association {
            near: Vec::with_capacity(sights * map.landmarks().len()),
            taken: Vec::with_capacity(map.landmarks().len()),
            landmark: Vec::with_capacity(sights),
        }
    }

    /// Fills [`Association::landmark`]. `covariance` is that of (x, y, heading); `scale` what ranges are multiplied
    /// by; `gate` the greatest squared distance (2 degrees of freedom).
    pub(crate) fn find(
        &mut self,
        map: &Map,
        sights: &[Polar],
        pose: &Pose,
        covariance: &Matrix3<f64>,
        scale: f64,
        gate: f64,
    ) {
        self.near.clear();
        self.landmark.clear();
        self.landmark.resize(sights.len(), None);
        self.taken.clear();
        self.taken.resize(map.landmarks().len(), false);
        let position_variance = covariance[(0, 0)] + covariance[(1, 1)];
        for (i, sight) in sights.iter().enumerate() {
            // A range alone that is outside the gate spares the rest: most landmarks of a class.
            let widest = gate * (position_variance + sight.range_sigma * sight.range_sigma);
            for k in map.of_class(sight.class) {
                let landmark = map.landmarks()[k].1;
                let range = (landmark[0] - pose.x).hypot(landmark[1] - pose.y);
                if (sight.range - scale * range).powi(2) > scale * scale * widest {
                    continue;
                }
                let expected = Expected::of(pose, landmark);
                let square = squared_distance(sight, &expected, covariance, scale);
                if square < gate {
                    self.near.push((square, i, k));
                }
            }
        }
        self.near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        for &(_, i, k) in &self.near {
            if self.landmark[i].is_none() && !self.taken[k] {
                self.landmark[i] = Some(k);
                self.taken[k] = true;
            }
        }
    }
}

/// Squared Mahalanobis distance of a sight from where the pose expects it, the pose's own uncertainty included.
fn squared_distance(sight: &Polar, expected: &Expected, covariance: &Matrix3<f64>, scale: f64) -> f64 {
    let dr = sight.range - scale * expected.range;
    let db = wrap(sight.bearing - expected.bearing);
    let (hr, hb) = (expected.range_slope, expected.bearing_slope);
    let form = |a: [f64; 3], b: [f64; 3]| {
        (0..3).map(|i| a[i] * (0..3).map(|j| covariance[(i, j)] * b[j]).sum::<f64>()).sum::<f64>()
    };
    let rr = form(hr, hr) + sight.range_sigma * sight.range_sigma;
    let rb = form(hr, hb);
    let bb = form(hb, hb) + sight.bearing_sigma * sight.bearing_sigma;
    (bb * dr * dr - 2.0 * rb * dr * db + rr * db * db) / (rr * bb - rb * rb)
}
