//! When each foot stands on the ground: heights and speeds with thresholds, hysteresis and least durations
//! (paper 1, section II-A.1: "heuristics based on foot height and velocity thresholds").
//!
//! Two points of each sole are watched, the heel and the ball of the foot. Each is in contact or not by a two-state
//! machine with hysteresis; gaps and contacts too short to be real are then removed. The two feet are independent, so
//! both may be in the air (running) or on the ground.
//!
//! The ground's height is not taken from the file (CMU's is off by some centimetres, and differs by one or two from
//! step to step). It is the level at which the balls of the feet come to rest: the lower quartile of their sole
//! points' heights over all frames in which they are slow. A quartile, so that a foot held still in the air for less
//! than three quarters of the slow frames does not lift it.
//!
//! Not done: sloping or stepped ground; hands and knees on the ground; forces.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::MotionError;
use crate::clip::{BonePoses, Clip};
use crate::landmark::Landmarks;
use crate::phase::Side;
use crate::track::{path, quantile, speeds};

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

impl ContactSettings {
    /// Checks that every field is in its range and that thresholds to leave are not below those to enter.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] with the field's path.
    pub fn validate(&self) -> Result<(), MotionError> {
        let fields = [
            ("height_on", self.height_on, 0.0, 0.2),
            ("height_off", self.height_off, self.height_on, 0.5),
            ("speed_on", self.speed_on, 0.0, 5.0),
            ("speed_off", self.speed_off, self.speed_on, 10.0),
            ("min_contact", self.min_contact, 0.0, 0.5),
            ("min_gap", self.min_gap, 0.0, 0.5),
            ("smoothing", self.smoothing, 0.0, 0.2),
        ];
        for (name, value, least, most) in fields {
            if !(least..=most).contains(&value) {
                let expected = format!("{least} to {most}");
                return Err(MotionError::argument(format!("contact.{name}"), value.to_string(), expected));
            }
        }
        Ok(())
    }
}

/// Heights and speeds of one sole point, one entry a frame.
struct Track {
    heights: Vec<f64>,
    speeds: Vec<f64>,
}

/// Finds the contact schedule of `clip`. Its landmarks are best [`Landmarks::calibrated`] first.
///
/// # Errors
///
/// [`MotionError::Argument`] for settings out of range or a clip that fails [`Clip::validate`].
pub fn detect(clip: &Clip, landmarks: &Landmarks, settings: &ContactSettings) -> Result<ContactSchedule, MotionError> {
    settings.validate()?;
    clip.validate()?;
    let track = |point: &dyn Fn(&BonePoses) -> Vector3<f64>| {
        let path = path(clip, point);
        let speeds = speeds(&path, clip.rate, settings.smoothing);
        Track { heights: path.iter().map(|p| p.z).collect(), speeds }
    };
    let sides = [Side::Left, Side::Right];
    let heels = sides.map(|side| track(&|poses| landmarks.sole(poses, side).heel));
    let balls = sides.map(|side| track(&|poses| landmarks.sole(poses, side).ball));
    let ground = ground_height(&balls, settings.speed_on);
    let foot = |i: usize| {
        let [heel, toe] = [&heels[i], &balls[i]].map(|track| contacts(track, ground, clip.rate, settings));
        let stance: Vec<bool> = heel.iter().zip(&toe).map(|(h, t)| *h || *t).collect();
        let stances = stretches(&stance, true);
        FootContact { heel, toe, stance, stances }
    };
    Ok(ContactSchedule { rate: clip.rate, ground, feet: [foot(0), foot(1)] })
}

/// The level at which these points come to rest; their lowest height where they never do.
fn ground_height(tracks: &[Track], slow: f64) -> f64 {
    let frames = || tracks.iter().flat_map(|track| track.heights.iter().zip(&track.speeds));
    let resting: Vec<f64> = frames().filter(|(_, speed)| **speed < slow).map(|(height, _)| *height).collect();
    if resting.is_empty() {
        return frames().map(|(height, _)| *height).fold(f64::INFINITY, f64::min);
    }
    quantile(resting, 0.25)
}

fn contacts(track: &Track, ground: f64, rate: f64, settings: &ContactSettings) -> Vec<bool> {
    let mut down = false;
    let mut contact: Vec<bool> = track
        .heights
        .iter()
        .zip(&track.speeds)
        .map(|(height, speed)| {
            let height = height - ground;
            down = if down {
                height <= settings.height_off && *speed <= settings.speed_off
            } else {
                height <= settings.height_on && *speed <= settings.speed_on
            };
            down
        })
        .collect();
    remove_short(&mut contact, false, settings.min_gap * rate);
    remove_short(&mut contact, true, settings.min_contact * rate);
    contact
}

/// Flips stretches of `value` shorter than `least` frames, except at the ends, where their true length is unknown.
fn remove_short(contact: &mut [bool], value: bool, least: f64) {
    for Stance { start, end } in stretches(contact, value) {
        if ((end + 1 - start) as f64) < least && start > 0 && end + 1 < contact.len() {
            contact[start..=end].fill(!value);
        }
    }
}

/// The stretches of `value`.
fn stretches(contact: &[bool], value: bool) -> Vec<Stance> {
    let mut found: Vec<Stance> = Vec::new();
    for (i, _) in contact.iter().enumerate().filter(|(_, c)| **c == value) {
        match found.last_mut() {
            Some(last) if last.end + 1 == i => last.end = i,
            _ => found.push(Stance { start: i, end: i }),
        }
    }
    found
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            height_on: 0.05,
            height_off: 0.07,
            speed_on: 0.5,
            speed_off: 1.0,
            min_contact: 0.05,
            min_gap: 0.04,
            smoothing: 0.02,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(points: &[(f64, f64)]) -> Track {
        Track { heights: points.iter().map(|p| p.0).collect(), speeds: points.iter().map(|p| p.1).collect() }
    }

    #[test]
    fn contact_begins_low_and_slow_and_ends_high_or_fast() {
        let settings = ContactSettings {
            height_on: 0.03,
            height_off: 0.05,
            speed_on: 0.4,
            speed_off: 0.8,
            min_contact: 0.0,
            min_gap: 0.0,
            ..ContactSettings::default()
        };
        let points = [(0.3, 3.0), (0.02, 3.0), (0.02, 0.1), (0.04, 0.6), (0.04, 0.1), (0.02, 0.9), (0.02, 0.6)];
        let got = contacts(&track(&points), 0.0, 100.0, &settings);
        assert_eq!(got, [false, false, true, true, true, false, false]);
    }

    #[test]
    fn short_gaps_are_filled_and_short_contacts_dropped_but_not_at_the_ends() {
        let mut contact = [true, false, true, true, true, false, false, false, true, false, false, false, true];
        remove_short(&mut contact, false, 2.0);
        remove_short(&mut contact, true, 2.0);
        let want = [true, true, true, true, true, false, false, false, false, false, false, false, true];
        assert_eq!(contact, want);
        assert_eq!(stretches(&contact, true), [Stance { start: 0, end: 4 }, Stance { start: 12, end: 12 }]);
    }

    #[test]
    fn ground_is_where_the_feet_rest_even_with_one_foot_held_up() {
        let standing = track(&[(0.052, 0.0); 50]);
        let held_up = track(&[(0.4, 0.0); 50]);
        assert_eq!(ground_height(&[standing, held_up], 0.4), 0.052);
        assert_eq!(ground_height(&[track(&[(0.3, 5.0), (0.2, 5.0)])], 0.4), 0.2);
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let bad = ContactSettings { height_off: 0.01, ..ContactSettings::default() };
        assert!(bad.validate().unwrap_err().to_string().starts_with("contact.height_off: 0.01"));
        let bad = ContactSettings { smoothing: f64::NAN, ..ContactSettings::default() };
        assert!(bad.validate().is_err());
        ContactSettings::default().validate().unwrap();
    }
}
