//! What a localiser is told: steps of odometry and frames of sights, all with the time at which they were true.

use instep_field::{LandmarkClass, Pose};
use serde::{Deserialize, Serialize};

use crate::LocalisationError;

/// A landmark as a detector reports it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// What it seems to be.
    pub class: LandmarkClass,
    /// On the ground in the robot's frame (x ahead, y left) at the frame's time, m.
    pub position: [f64; 2],
    /// The detector's, in (0, 1].
    #[serde(default = "one")]
    pub confidence: f64,
    /// `[xx, xy, yy]` of the position, m^2; without it the settings' noise for the distance is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[f64; 3]>,
}

/// A piece of a white line, by its ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineSight {
    /// One end on the ground in the robot's frame, m.
    pub from: [f64; 2],
    /// The other end, m.
    pub to: [f64; 2],
}

/// What one camera frame showed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// When the picture was taken, not when it arrived, s.
    pub time: f64,
    /// Landmarks.
    #[serde(default)]
    pub landmarks: Vec<Sight>,
    /// Pieces of lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<LineSight>,
}

/// A step of odometry: how the robot moved since the step before, by its legs and its gyro.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// At its end, s.
    pub time: f64,
    /// `before_from_now`, m and rad.
    pub motion: Pose,
}

fn one() -> f64 {
    1.0
}

impl Frame {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`LocalisationError::Value`] for the first that cannot: not finite, a range of zero, a confidence outside
    /// (0, 1], a covariance that is none.
    pub fn validate(&self) -> Result<(), LocalisationError> {
        let refuse = |place: String, found: String, expected| Err(LocalisationError::Value { place, found, expected });
        if !self.time.is_finite() {
            return refuse("frame".to_owned(), format!("time {} s", self.time), "a finite time");
        }
        for (i, sight) in self.landmarks.iter().enumerate() {
            let place = || format!("frame of {} s: landmarks[{i}]", self.time);
            let [x, y] = sight.position;
            let range = x.hypot(y);
            if !(range.is_finite() && range > 1e-6) {
                return refuse(place(), format!("position [{x}, {y}] m"), "a finite position with a range above zero");
            }
            if !(sight.confidence > 0.0 && sight.confidence <= 1.0) {
                return refuse(place(), format!("confidence {}", sight.confidence), "above 0, at most 1");
            }
            if let Some([xx, xy, yy]) = sight.covariance
                && !(xx > 0.0 && yy > 0.0 && xx * yy > xy * xy && xx.is_finite() && yy.is_finite())
            {
                return refuse(place(), format!("covariance [{xx}, {xy}, {yy}]"), "a positive definite one, m^2");
            }
        }
        for (i, line) in self.lines.iter().enumerate() {
            let [[ax, ay], [bx, by]] = [line.from, line.to];
            let length = (bx - ax).hypot(by - ay);
            if !(length.is_finite() && length > 1e-3 && ax.hypot(ay) > 1e-6 && bx.hypot(by) > 1e-6) {
                let place = format!("frame of {} s: lines[{i}]", self.time);
                let found = format!("from [{ax}, {ay}] to [{bx}, {by}] m");
                return refuse(place, found, "two different finite points away from the robot's origin");
            }
        }
        Ok(())
    }
}

impl Step {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`LocalisationError::Value`] for what is not finite.
    pub fn validate(&self) -> Result<(), LocalisationError> {
        if self.time.is_finite() && self.motion.is_finite() {
            return Ok(());
        }
        let Pose { x, y, heading } = self.motion;
        Err(LocalisationError::Value {
            place: format!("odometry of {} s", self.time),
            found: format!("motion ({x}, {y}, {heading})"),
            expected: "finite numbers, m and rad",
        })
    }
}
