//! What the foot does at the ball: its greatest speeds, when it meets the ball, and where it sends it.
//!
//! The peak of the foot's speed is not quite the impact. In all five of CMU's clips of subject 10 the ankle, fast until
//! then, loses a tenth to a fifth of its speed within one frame, 0.017 to 0.033 s after the ball of the foot is fastest.
//! There the foot is at its lowest and goes level, in all five within 0.1 m of one place of the recording room, and it
//! heads within 7 degrees of the room's forward axis (our x; mean -1.5 degrees). At the peak of speed that heading is
//! still -14 to -2 degrees (mean -8). So this is taken for the moment at which the foot meets the ball. No ball was
//! tracked, so it too is an inference.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::KickPhases;
use crate::MotionError;
use crate::clip::{BonePoses, Clip};
use crate::landmark::{Landmark, Landmarks};
use crate::track::{path, speeds};

/// A fall of the ankle's speed that muscles do not make, m/s^2: CMU's are 140 to 230 at the ball, below 60 elsewhere.
const BRAKED: f64 = 100.0;

/// How long after [`KickPhases::t_impact`] the ball may be met, s.
const SEARCH: f64 = 0.06;

/// Time before the ball is met over which the foot's direction is taken, s.
const APPROACH: f64 = 0.01;

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

/// The greatest speeds of the kicking foot within 0.1 s of the impact, averaged over `smoothing` seconds
/// ([`super::SMOOTHING`]), after spikes are dropped.
///
/// # Panics
///
/// If `clip` has no frame.
#[must_use]
pub fn peak_speeds(clip: &Clip, landmarks: &Landmarks, phases: &KickPhases, smoothing: f64) -> PeakSpeeds {
    let near = clip.frame_at(phases.t_impact - 0.1)..=clip.frame_at(phases.t_impact + 0.1);
    let peak = |landmark: Landmark| {
        let path = path(clip, |poses| landmarks.position(poses, landmark));
        speeds(&path, clip.rate, smoothing)[near.clone()].iter().copied().fold(0.0, f64::max)
    };
    let side = phases.kick_foot;
    PeakSpeeds {
        ankle: peak(Landmark::Ankle(side)),
        ball: peak(Landmark::ToeBase(side)),
        toe_tip: peak(Landmark::ToeTip(side)),
    }
}

/// When the foot meets the ball, s, seen from the ankle: the first frame within 0.06 s after `t_impact` at which its
/// speed falls by more than 100 m/s^2 and does not come back. `None` where no such fall is seen (no ball, or a clip
/// that was smoothed).
///
/// # Panics
///
/// If `clip` has no frame.
#[must_use]
pub fn strike_time(clip: &Clip, landmarks: &Landmarks, phases: &KickPhases) -> Option<f64> {
    let ankles = path(clip, |poses| landmarks.position(poses, Landmark::Ankle(phases.kick_foot)));
    let steps: Vec<f64> = ankles.windows(2).map(|p| (p[1] - p[0]).norm() * clip.rate).collect();
    let (first, last) = (clip.frame_at(phases.t_impact).max(1), clip.frame_at(phases.t_impact + SEARCH));
    let braked = |frame: &usize| {
        let (before, at, after) = (steps.get(frame - 1)?, steps.get(*frame)?, steps.get(frame + 1)?);
        ((before - at) * clip.rate > BRAKED && after < before).then_some(clip.time(*frame))
    };
    (first..=last).find_map(|frame| braked(&frame))
}

/// The horizontal direction in which the ball leaves, a unit vector with z = 0 in the clip's world.
///
/// Estimated as the way of the instep (midway between ankle and ball of the foot, where the ball is struck) in the
/// last 0.01 s before [`strike_time`]; where that is not seen, in 0.01 s to both sides of `t_impact`. The foot swings
/// on an arc, so a moment that is wrong by a frame at 120 Hz turns this by 2 to 4 degrees.
///
/// # Errors
///
/// [`MotionError::Argument`] if the foot goes less than 5 mm sideways in that time.
///
/// # Panics
///
/// If `clip` has no frame.
pub fn kick_direction(clip: &Clip, landmarks: &Landmarks, phases: &KickPhases) -> Result<Vector3<f64>, MotionError> {
    let side = phases.kick_foot;
    let instep = |t: f64| {
        let mut poses = BonePoses::default();
        clip.skeleton.poses_into(&clip.interpolated(t), &mut poses);
        (landmarks.position(&poses, Landmark::Ankle(side)) + landmarks.position(&poses, Landmark::ToeBase(side))) / 2.0
    };
    let (from, to) = match strike_time(clip, landmarks, phases) {
        Some(strike) => (strike - APPROACH, strike),
        None => (phases.t_impact - APPROACH, phases.t_impact + APPROACH),
    };
    let way = instep(to) - instep(from);
    Vector3::new(way.x, way.y, 0.0).try_normalize(0.005).ok_or_else(|| {
        let found = format!("{:.4} m sideways from {from:.3} to {to:.3} s", way.xy().norm());
        MotionError::argument(format!("way of the {side} foot at the impact"), found, "0.005 m at least")
    })
}
