//! When things happen in a kick (paper 1, section II-A.1), found from the human's feet.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::MotionError;
use crate::clip::Clip;
use crate::contact::ContactSchedule;
use crate::landmark::Landmarks;

/// Left or right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The robot's or human's left.
    Left,
    /// The robot's or human's right.
    Right,
}

impl Side {
    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}

/// The kick's instants, s, in the time of the clip or reference they belong to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KickPhases {
    /// The foot that strikes the ball.
    pub kick_foot: Side,
    /// The support foot has settled on the ground (phase b).
    pub t_plant: f64,
    /// The kicking leg starts forward: T^swing, start of phases d and e.
    pub t_swing: f64,
    /// The ankle locks: T^lock of (19).
    pub t_lock: f64,
    /// The foot meets the ball, taken as the peak of the foot's speed. The paper's T^impact, the end of the
    /// impact, is this plus the time of contact.
    pub t_impact: f64,
}

/// How a kick is told from other motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KickSettings {
    /// Least peak speed of the kicking foot, m/s; 1 to 10.
    pub min_speed: f64,
    /// How much faster the peak must be than the second fastest foot motion of the clip (more than half a second
    /// away, or the other foot at any time), as a ratio; 1 to 3.
    pub min_ratio: f64,
    /// Length of the window over which speeds are averaged, s; 0 to 0.1.
    pub smoothing: f64,
    /// The ankle counts as locked while it is less than this away from its angle at impact, rad; 0.02 to 0.5.
    pub lock_angle: f64,
}

/// Greatest speeds of the kicking foot around its impact, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PeakSpeeds {
    /// Of the ankle.
    pub ankle: f64,
    /// Of the ball of the foot.
    pub ball: f64,
    /// Of the toe tip.
    pub toe_tip: f64,
}

/// Finds the kick of a clip. Despike the clip first ([`crate::despike::despike`]).
///
/// # Errors
///
/// [`MotionError::NoKick`] where no foot motion stands out, [`MotionError::NoStance`] where the other foot does not
/// stand, [`MotionError::Argument`] for settings out of range or a schedule of another clip.
pub fn find_kick(
    clip: &Clip,
    landmarks: &Landmarks,
    contacts: &ContactSchedule,
    settings: &KickSettings,
) -> Result<KickPhases, MotionError> {
    let _ = (clip, landmarks, contacts, settings);
    unimplemented!("body follows")
}

/// The greatest speeds of the kicking foot within 0.1 s of the impact, averaged over `smoothing` seconds.
#[must_use]
pub fn peak_speeds(clip: &Clip, landmarks: &Landmarks, phases: &KickPhases, smoothing: f64) -> PeakSpeeds {
    let _ = (clip, landmarks, phases, smoothing);
    unimplemented!("body follows")
}

/// The horizontal direction in which the ball leaves, a unit vector with z = 0 in the clip's world.
///
/// # Errors
///
/// [`MotionError::Argument`] if the foot has no horizontal speed at the impact.
pub fn kick_direction(clip: &Clip, landmarks: &Landmarks, phases: &KickPhases) -> Result<Vector3<f64>, MotionError> {
    let _ = (clip, landmarks, phases);
    unimplemented!("body follows")
}

impl Default for KickSettings {
    fn default() -> Self {
        Self { min_speed: 3.0, min_ratio: 1.15, smoothing: 5.0 / 120.0, lock_angle: 0.15 }
    }
}
