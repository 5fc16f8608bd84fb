//! When each foot stands on the ground: heights and speeds with thresholds, hysteresis and least durations
//! (paper 1, section II-A.1: "heuristics based on foot height and velocity thresholds").

use serde::{Deserialize, Serialize};

use crate::MotionError;
use crate::clip::Clip;
use crate::landmark::Landmarks;
use crate::phase::Side;

/// How contact is decided. A point (heel, ball of the foot) comes into contact when it is both low and slow, and
/// leaves when it is either high or fast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSettings {
    /// Height of the sole point above the ground below which contact can begin, m; 0.005 to 0.1. Larger finds contact
    /// earlier and in noisier clips.
    pub height_on: f64,
    /// Height above which contact ends, m; at least `height_on`.
    pub height_off: f64,
    /// Speed of the sole point below which contact can begin, m/s; 0.05 to 2. Larger finds contact earlier and keeps
    /// more foot slip.
    pub speed_on: f64,
    /// Speed above which contact ends, m/s; at least `speed_on`.
    pub speed_off: f64,
    /// Shortest contact that is believed, s; 0 to 0.5. Shorter ones are dropped.
    pub min_contact: f64,
    /// Shortest gap that is believed, s; 0 to 0.5. Shorter ones are filled.
    pub min_gap: f64,
    /// Length of the window over which speeds are averaged, s; 0 to 0.1. Longer is smoother and blurs touch-down.
    pub smoothing: f64,
    /// A frame is replaced by the line between its neighbours where a point is farther off that line than this, m;
    /// 0.005 to 0.2, see [`crate::despike`].
    pub spike: f64,
}

/// One stretch of stance, frames `start..=end`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stance {
    /// First frame in contact.
    pub start: usize,
    /// Last frame in contact.
    pub end: usize,
}

/// Contact of one foot, one entry a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FootContact {
    /// The heel stands.
    pub heel: Vec<bool>,
    /// The ball of the foot and the toes stand.
    pub toe: Vec<bool>,
    /// Either stands.
    pub stance: Vec<bool>,
    /// The same as stretches, in time order.
    pub stances: Vec<Stance>,
}

/// When each foot of a clip stands.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSchedule {
    /// Frames a second, the clip's.
    pub rate: f64,
    /// Height of the ground in the clip's world, m: the level of the sole points that stand.
    pub ground: f64,
    /// Left, then right; [`Self::foot`] reads better.
    pub feet: [FootContact; 2],
}

impl ContactSchedule {
    /// The contact of the foot on `side`.
    #[must_use]
    pub fn foot(&self, side: Side) -> &FootContact {
        &self.feet[usize::from(side == Side::Right)]
    }
}

impl FootContact {
    /// The stance that holds `frame`, if the foot stands then.
    #[must_use]
    pub fn stance_at(&self, frame: usize) -> Option<Stance> {
        self.stances.iter().copied().find(|s| (s.start..=s.end).contains(&frame))
    }
}

/// Finds the contact schedule of `clip`.
///
/// # Errors
///
/// [`MotionError::Argument`] for settings out of range or a clip that fails [`Clip::validate`].
pub fn detect(clip: &Clip, landmarks: &Landmarks, settings: &ContactSettings) -> Result<ContactSchedule, MotionError> {
    let _ = (clip, landmarks, settings);
    unimplemented!("body follows")
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            height_on: 0.03,
            height_off: 0.05,
            speed_on: 0.4,
            speed_off: 0.8,
            min_contact: 0.05,
            min_gap: 0.04,
            smoothing: 0.04,
            spike: 0.03,
        }
    }
}
