//! Every number of the methods, each once, with its unit and its source. The defaults are what measured best
//! (`docs/locate.md`); `validate` refuses what cannot be.

use serde::{Deserialize, Serialize};

use crate::LocalisationError;

/// All settings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// What a detector's errors are taken to be.
    pub noise: Noise,
    /// What the odometry's errors are taken to be.
    pub odometry: OdometryNoise,
    /// The landmark filter.
    pub filter: FilterSettings,
    /// Pose hypotheses from pairs of landmarks.
    pub hypotheses: HypothesisSettings,
    /// Clusters of hypotheses over several frames.
    pub global: GlobalSettings,
}

/// What a detector's errors are taken to be: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Upper ends of the distance classes but the last, m (paper 4, V-A-3).
    pub range_ends: [f64; 4],
    /// Range error as a share of the range, for each class (paper 4, V-A-3).
    pub range_shares: [f64; 5],
    /// Range error that is there at any distance, m. Larger trusts near landmarks less.
    pub range_floor: f64,
    /// Bearing error, rad.
    pub bearing: f64,
    /// Error across the line of sight that is there at any distance, m: close by, a bearing says little.
    pub across_floor: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Noise {
            range_ends: [2.0, 4.0, 6.0, 8.0],
            range_shares: [0.01, 0.03, 0.05, 0.08, 0.10],
            range_floor: 0.03,
            bearing: 1.3_f64.to_radians(),
            across_floor: 0.01,
        }
    }
}

impl Noise {
    /// The share of a range that its error has.
    pub fn range_share(&self, range: f64) -> f64 {
        let class = self.range_ends.iter().filter(|&&end| range >= end).count();
        self.range_shares[class]
    }

    /// m
    pub(crate) fn range_sigma(&self, range: f64) -> f64 {
        self.range_share(range) * range + self.range_floor
    }

    /// rad
    pub(crate) fn bearing_sigma(&self, range: f64) -> f64 {
        self.bearing.hypot(self.across_floor / range)
    }
}

/// What the odometry's errors are taken to be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OdometryNoise {
    /// Slip, m/sqrt(s): wanders in each direction.
    pub slip: f64,
    /// Error of each step as a share of it, as if steps of 50 ms.
    pub step_share: f64,
    /// Heading, rad/sqrt(s).
    pub heading: f64,
    /// Heading, as a share of the turn.
    pub turn_share: f64,
    /// Scale error of steps ahead, one standard deviation.
    pub scale_ahead: f64,
    /// Scale error of steps sideways.
    pub scale_sideways: f64,
    /// How long a scale error lasts, s.
    pub scale_time: f64,
    /// Gyro bias, rad/s.
    pub gyro_bias: f64,
    /// How long a gyro bias lasts, s.
    pub gyro_time: f64,
}

impl Default for OdometryNoise {
    fn default() -> Self {
        OdometryNoise {
            slip: 0.035,
            step_share: 0.12,
            heading: 0.004,
            turn_share: 0.01,
            scale_ahead: 0.06,
            scale_sideways: 0.10,
            scale_time: 60.0,
            gyro_bias: 0.003,
            gyro_time: 100.0,
        }
    }
}

/// The landmark filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FilterSettings {
    /// How often a frame's sights are associated, each time at the result of the time before; at least 1.
    pub associations: usize,
    /// Gauss-Newton steps after each association, at least 1.
    pub iterations: usize,
    /// Greatest squared Mahalanobis distance of a sight from its landmark (2 degrees of freedom).
    pub gate: f64,
    /// Corner of Cauchy's weight, in standard deviations. Smaller trusts outliers less.
    pub cauchy: f64,
    /// A frame's information is divided by this: errors of successive frames are alike. 1 for independent errors.
    pub information_divisor: f64,
    /// Standard deviation of the common error of all ranges, as a share.
    pub range_scale: f64,
    /// How long it lasts, s.
    pub range_scale_time: f64,
    /// Sights of a frame that are used, nearest first.
    pub most_sights: usize,
}

impl Default for FilterSettings {
    fn default() -> Self {
        FilterSettings {
            associations: 2,
            iterations: 3,
            gate: 11.8,
            cauchy: 2.0,
            information_divisor: 2.0,
            range_scale: 0.02,
            range_scale_time: 20.0,
            most_sights: 16,
        }
    }
}

/// Pose hypotheses from pairs of landmarks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HypothesisSettings {
    /// Shortest distance of two sights that make a pair, m: a short base line gives a poor heading.
    pub least_base: f64,
    /// Distances in sight and map may differ by this, m,
    pub tolerance: f64,
    /// and by this many standard deviations of the sights.
    pub sigmas: f64,
    /// Farthest outside the lines that a pose is believed, m.
    pub margin: f64,
    /// Sights of a frame that make pairs, nearest first: pairs grow with the square.
    pub most_sights: usize,
    /// Hypotheses of a frame that are kept.
    pub most: usize,
}

impl Default for HypothesisSettings {
    fn default() -> Self {
        HypothesisSettings { least_base: 0.7, tolerance: 0.05, sigmas: 2.0, margin: 1.0, most_sights: 8, most: 80 }
    }
}

/// Clusters of hypotheses over several frames, and when they overrule the pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GlobalSettings {
    /// Frames that are looked at together.
    pub frames: usize,
    /// Time between checks, s.
    pub period: f64,
    /// Clusters that are begun.
    pub clusters: usize,
    /// A radian of heading counts as this many metres.
    pub metres_per_radian: f64,
    /// Rounds of K-means; after each but the last the farthest are dropped.
    pub rounds: usize,
    /// Steps of K-means in a round.
    pub steps: usize,
    /// Share of each cluster that is dropped after a round.
    pub drop: f64,
    /// What lies nearer to its centroid is never dropped, m.
    pub keep: f64,
    /// Candidates with at least this share of the best score are alternatives (a field's twin is one).
    pub alternative: f64,
    /// The pose is in doubt when the candidate is farther away than this, m,
    pub distance: f64,
    /// or turned by more than this, rad,
    pub angle: f64,
    /// and explains this many times as much as the pose does,
    pub ratio: f64,
    /// and at least this share of all sights,
    pub share: f64,
    /// this many checks running. Then it takes the pose's place.
    pub times: usize,
}

impl Default for GlobalSettings {
    fn default() -> Self {
        GlobalSettings {
            frames: 40,
            period: 0.25,
            clusters: 8,
            metres_per_radian: 2.0,
            rounds: 5,
            steps: 2,
            drop: 0.2,
            keep: 0.2,
            alternative: 0.8,
            distance: 0.4,
            angle: 0.15,
            ratio: 1.6,
            share: 0.4,
            times: 4,
        }
    }
}

impl Settings {
    /// Checks every number.
    ///
    /// # Errors
    /// [`LocalisationError::Value`] with the path of the first that cannot be.
    pub fn validate(&self) -> Result<(), LocalisationError> {
        let Settings { noise, odometry, filter, hypotheses, global } = self;
        let positive = [
            ("noise.range_floor", noise.range_floor),
            ("noise.bearing", noise.bearing),
            ("noise.across_floor", noise.across_floor),
            ("odometry.slip", odometry.slip),
            ("odometry.heading", odometry.heading),
            ("odometry.scale_time", odometry.scale_time),
            ("odometry.gyro_time", odometry.gyro_time),
            ("filter.gate", filter.gate),
            ("filter.cauchy", filter.cauchy),
            ("filter.information_divisor", filter.information_divisor),
            ("filter.range_scale_time", filter.range_scale_time),
            ("hypotheses.tolerance", hypotheses.tolerance),
            ("global.period", global.period),
            ("global.metres_per_radian", global.metres_per_radian),
            ("global.ratio", global.ratio),
        ];
        let not_negative = [
            ("odometry.step_share", odometry.step_share),
            ("odometry.turn_share", odometry.turn_share),
            ("odometry.scale_ahead", odometry.scale_ahead),
            ("odometry.scale_sideways", odometry.scale_sideways),
            ("odometry.gyro_bias", odometry.gyro_bias),
            ("filter.range_scale", filter.range_scale),
            ("hypotheses.least_base", hypotheses.least_base),
            ("hypotheses.sigmas", hypotheses.sigmas),
            ("hypotheses.margin", hypotheses.margin),
            ("global.keep", global.keep),
            ("global.distance", global.distance),
            ("global.angle", global.angle),
        ];
        let shares =
            [("global.drop", global.drop), ("global.alternative", global.alternative), ("global.share", global.share)];
        let counts = [
            ("filter.associations", filter.associations, 16),
            ("filter.iterations", filter.iterations, 64),
            ("filter.most_sights", filter.most_sights, 64),
            ("hypotheses.most_sights", hypotheses.most_sights, 32),
            ("hypotheses.most", hypotheses.most, 4096),
            ("global.frames", global.frames, 400),
            ("global.clusters", global.clusters, crate::cluster::MOST_CLUSTERS),
            ("global.rounds", global.rounds, 64),
            ("global.steps", global.steps, 64),
            ("global.times", global.times, 64),
        ];
        let refuse = |place: &str, found: String, expected| {
            Err(LocalisationError::Value { place: place.to_owned(), found, expected })
        };
        for (place, found) in positive {
            if !(found > 0.0 && found.is_finite()) {
                return refuse(place, found.to_string(), "a finite number above 0");
            }
        }
        for (place, found) in not_negative {
            if !(found >= 0.0 && found.is_finite()) {
                return refuse(place, found.to_string(), "a finite number not below 0");
            }
        }
        for (place, found) in shares {
            if !(found > 0.0 && found < 1.0) {
                return refuse(place, found.to_string(), "above 0, below 1");
            }
        }
        for (place, found, most) in counts {
            if !(1..=most).contains(&found) {
                return refuse(place, found.to_string(), "at least 1, and no more than memory and time allow");
            }
        }
        if !noise.range_ends.is_sorted() || !noise.range_ends.iter().all(|e| e.is_finite()) {
            return refuse("noise.range_ends", format!("{:?}", noise.range_ends), "finite, rising");
        }
        if !noise.range_shares.iter().all(|&s| s > 0.0 && s < 1.0) {
            return refuse("noise.range_shares", format!("{:?}", noise.range_shares), "each above 0, below 1");
        }
        Ok(())
    }
}
