//! When things happen in a kick (paper 1, section II-A.1), found from the human's feet.
//!
//! - Impact: the greatest speed of the ball of a foot, which must stand out against all other foot motion of the clip.
//! - Plant: the start of the other foot's stance that holds the impact.
//! - Swing: before the impact the kicking thigh is farthest back at one instant (end of the wind-up); the swing starts
//!   when it has come forward by a small part of its way to the impact. In a quick kick that is about when the other
//!   foot lands, and may be a frame or two earlier.
//! - Lock: the start of the last stretch before the impact in which the ankle keeps its angle, but not before the
//!   swing starts. Humans lock late (0.03 to 0.1 s before the impact in CMU's clips).
//!
//! No ball was tracked, so the impact is an inference; [`strike_time`] and [`kick_direction`] look at it more closely.

mod strike;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::MotionError;
use crate::clip::{BonePoses, Clip};
use crate::contact::ContactSchedule;
use crate::landmark::{Landmark, Landmarks, Segment};
use crate::track::{path, speeds};

pub use strike::{PeakSpeeds, kick_direction, peak_speeds, strike_time};

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
    /// The ankle counts as locked while it is less than this away from its angle at impact, rad; 0.02 to 0.5. Larger
    /// locks earlier.
    pub lock_angle: f64,
    /// Least time from lock to impact, s; 0 to 0.1. Where the ankle turns until later, it is locked this early anyway.
    pub min_lock: f64,
    /// Part of the thigh's way forward after which the swing has started; 0 to 0.5. Larger starts it later and is
    /// surer of its start.
    pub swing_onset: f64,
    /// How long before the impact the wind-up is looked for, s; 0.2 to 2.
    pub windup: f64,
}

impl Default for KickSettings {
    fn default() -> Self {
        Self {
            min_speed: 3.0,
            min_ratio: 1.15,
            smoothing: SMOOTHING,
            lock_angle: 0.2,
            min_lock: 0.03,
            swing_onset: 0.05,
            windup: 0.6,
        }
    }
}

impl KickSettings {
    /// Checks that every field is in its range.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] with the field's path.
    pub fn validate(&self) -> Result<(), MotionError> {
        let fields = [
            ("min_speed", self.min_speed, 0.1, 20.0),
            ("min_ratio", self.min_ratio, 1.0, 5.0),
            ("smoothing", self.smoothing, 0.0, 0.2),
            ("lock_angle", self.lock_angle, 0.01, 1.0),
            ("min_lock", self.min_lock, 0.0, 0.2),
            ("swing_onset", self.swing_onset, 0.0, 0.5),
            ("windup", self.windup, 0.1, 3.0),
        ];
        for (name, value, least, most) in fields {
            if !(least..=most).contains(&value) {
                let expected = format!("{least} to {most}");
                return Err(MotionError::argument(format!("kick.{name}"), value.to_string(), expected));
            }
        }
        Ok(())
    }
}

impl KickPhases {
    /// Checks that all times are finite, that the plant comes before the impact, and the swing before the lock before
    /// the impact. Whether the support foot is planted before the swing starts is left open: humans do both.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] with the field's path.
    pub fn validate(&self) -> Result<(), MotionError> {
        // Comparisons that are false for NaN, so that NaN fails.
        let order = [
            ("t_plant", self.t_plant, self.t_plant < self.t_impact, "a time before t_impact"),
            ("t_swing", self.t_swing, self.t_swing <= self.t_lock, "a time not after t_lock"),
            ("t_lock", self.t_lock, self.t_lock <= self.t_impact, "a time not after t_impact"),
            ("t_impact", self.t_impact, self.t_impact.is_finite(), "a finite time"),
            ("t_plant", self.t_plant, self.t_plant.is_finite(), "a finite time"),
            ("t_swing", self.t_swing, self.t_swing.is_finite(), "a finite time"),
        ];
        match order.into_iter().find(|(_, _, right, _)| !right) {
            Some((name, value, _, expected)) => {
                Err(MotionError::argument(format!("phases.{name}"), value.to_string(), expected))
            }
            None => Ok(()),
        }
    }
}

/// The window over which speeds of CMU's clips are usually averaged: five frames at 120 Hz, s.
pub const SMOOTHING: f64 = 5.0 / 120.0;

/// Finds the kick of a clip. Single-frame spikes do no harm.
///
/// # Errors
///
/// [`MotionError::NoKick`] where no foot motion stands out, [`MotionError::NoStance`] where the other foot does not
/// stand, [`MotionError::Argument`] for settings out of range, a clip that fails [`Clip::validate`] or a schedule of
/// another clip.
pub fn find_kick(
    clip: &Clip,
    landmarks: &Landmarks,
    contacts: &ContactSchedule,
    settings: &KickSettings,
) -> Result<KickPhases, MotionError> {
    settings.validate()?;
    clip.validate()?;
    let count = clip.frames.len();
    if let Some(foot) = contacts.feet.iter().find(|foot| foot.stance.len() != count) {
        let found = format!("{} frames", foot.stance.len());
        return Err(MotionError::argument("contacts", found, format!("{count}, as the clip has")));
    }
    let (kick_foot, impact) = fastest_foot(clip, landmarks, settings)?;
    let plant = plant(clip, landmarks, contacts, kick_foot, impact)?;
    let swing = swing_start(clip, landmarks, kick_foot, impact, settings);
    let t_impact = clip.time(impact);
    let t_swing = clip.time(swing);
    let locked = clip.time(ankle_lock(clip, landmarks, kick_foot, impact, settings.lock_angle));
    let t_lock = locked.max(t_swing).min(t_impact - settings.min_lock).max(0.0);
    let t_swing = t_swing.min(t_lock);
    Ok(KickPhases { kick_foot, t_plant: clip.time(plant), t_swing, t_lock, t_impact })
}

/// A foot's speed counts as that of the peak down to this part of it.
const NEARLY: f64 = 0.98;

/// The foot that kicks and the frame of its greatest speed.
fn fastest_foot(clip: &Clip, landmarks: &Landmarks, settings: &KickSettings) -> Result<(Side, usize), MotionError> {
    let speed_of = |side: Side| {
        let path = path(clip, |poses| landmarks.position(poses, Landmark::ToeBase(side)));
        speeds(&path, clip.rate, settings.smoothing)
    };
    let tracks = [(Side::Left, speed_of(Side::Left)), (Side::Right, speed_of(Side::Right))];
    let (mut side, mut impact, mut speed) = (Side::Right, 0, f64::NEG_INFINITY);
    for (foot, track) in &tracks {
        for (frame, &v) in track.iter().enumerate() {
            if v > speed {
                (side, impact, speed) = (*foot, frame, v);
            }
        }
    }
    // The kick's own swing lasts up to half a second before and after its peak.
    let apart = 0.5 * clip.rate;
    let rival = tracks
        .iter()
        .flat_map(|(foot, track)| track.iter().enumerate().map(move |(frame, v)| (*foot, frame, *v)))
        .filter(|(foot, frame, _)| *foot != side || frame.abs_diff(impact) as f64 > apart)
        .fold(0.0, |most: f64, (_, _, v)| most.max(v));
    let time = clip.time(impact);
    let no_kick = |reason: String, expected: String| MotionError::NoKick { side, speed, time, reason, expected };
    if speed < settings.min_speed {
        return Err(no_kick("which is slow".to_owned(), format!("{} m/s at least", settings.min_speed)));
    }
    if speed < settings.min_ratio * rival {
        let reason = format!("no more than {:.2} times the next fastest foot motion", speed / rival);
        return Err(no_kick(reason, format!("{} times at least", settings.min_ratio)));
    }
    // The peak can be flat and noisy: the middle of the stretch around it that is nearly as fast is steadier.
    let track = &tracks[usize::from(side == Side::Right)].1;
    let near = |frame: &usize| track[*frame] >= NEARLY * speed;
    let first = (0..=impact).rev().take_while(near).last().unwrap_or(impact);
    let last = (impact..track.len()).take_while(near).last().unwrap_or(impact);
    Ok((side, (first + last).div_ceil(2)))
}

/// The first frame of the support foot's stance at the impact.
fn plant(
    clip: &Clip,
    landmarks: &Landmarks,
    contacts: &ContactSchedule,
    kick_foot: Side,
    impact: usize,
) -> Result<usize, MotionError> {
    let side = kick_foot.other();
    match contacts.foot(side).stance_at(impact) {
        Some(stance) if stance.start < impact => Ok(stance.start),
        _ => {
            let now = clip.poses(impact);
            let before = clip.poses(impact.saturating_sub(1));
            let [heel, ball] = [landmarks.sole(&now, side).heel, landmarks.sole(&now, side).ball];
            let [heel0, ball0] = [landmarks.sole(&before, side).heel, landmarks.sole(&before, side).ball];
            Err(MotionError::NoStance {
                side,
                time: clip.time(impact),
                height: heel.z.min(ball.z) - contacts.ground,
                speed: (heel - heel0).norm().min((ball - ball0).norm()) * clip.rate,
            })
        }
    }
}

/// Time before the impact in which the foot is surely under way, s.
const FINAL_SWING: f64 = 0.05;

/// The frame in which the kicking thigh has started forward.
fn swing_start(clip: &Clip, landmarks: &Landmarks, side: Side, impact: usize, settings: &KickSettings) -> usize {
    let first = clip.frame_at(clip.time(impact) - settings.windup);
    // The thigh's angle, forward positive, in the vertical plane in which the foot comes to the impact.
    let foot = |frame: usize| landmarks.position(&clip.poses(frame), Landmark::Ankle(side));
    let forward = foot(impact) - foot(clip.frame_at(clip.time(impact) - FINAL_SWING));
    let forward = Vector3::new(forward.x, forward.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let mut poses = BonePoses::default();
    let angles: Vec<f64> = (first..=impact)
        .map(|frame| {
            clip.poses_into(frame, &mut poses);
            let thigh =
                landmarks.position(&poses, Landmark::Knee(side)) - landmarks.position(&poses, Landmark::Hip(side));
            thigh.dot(&forward).atan2(-thigh.z)
        })
        .collect();
    let back = (0..angles.len()).min_by(|a, b| angles[*a].total_cmp(&angles[*b])).unwrap_or(0);
    let way = angles.last().copied().unwrap_or(0.0) - angles[back];
    let onset = angles[back] + settings.swing_onset * way;
    (back..angles.len()).find(|i| angles[*i] >= onset).map_or(impact, |i| first + i)
}

/// The first frame of the stretch up to the impact in which the ankle is less than `near` rad from its angle there.
fn ankle_lock(clip: &Clip, landmarks: &Landmarks, side: Side, impact: usize, near: f64) -> usize {
    let ankle = |frame: usize| {
        let poses = clip.poses(frame);
        landmarks.rotation(&poses, Segment::Shank(side)).inverse() * landmarks.rotation(&poses, Segment::Foot(side))
    };
    let locked = ankle(impact);
    (0..impact).rev().take_while(|frame| ankle(*frame).angle_to(&locked) < near).last().unwrap_or(impact)
}
