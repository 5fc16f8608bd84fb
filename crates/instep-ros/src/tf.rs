//! A small TF buffer: the transforms of the last seconds by frame, and the transform between two frames at a time.
//!
//! As tf2 does it (Foote, tf: The transform library, TePRA 2013): a tree by child frame, each frame with its samples
//! in time; between two samples translation is interpolated linearly, rotation spherically. Bounded in frames and
//! samples, whatever is sent. A time later than the newest sample takes that one, up to [`TOLERANCE`]: a ball that was
//! seen this very moment should not be refused because odometry comes at 50 Hz. Nothing here waits for a transform.

use std::collections::{HashMap, VecDeque};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::msg::TransformStamped;

/// How long samples are kept, ns.
const KEPT: i64 = 10_000_000_000;
/// Samples a frame at most.
const SAMPLES: usize = 4096;
/// Frames at most.
const FRAMES: usize = 512;
/// Length of a frame's name at most.
const NAME: usize = 256;
/// A rotation may be off unit length by this much.
const UNIT: f64 = 0.01;
/// How far beyond the samples a time may lie, ns.
const TOLERANCE: i64 = 200_000_000;

/// Why there is no transform.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TfError {
    /// Nobody has told where this frame is.
    #[error("the frame \"{frame}\" is not known to TF{known}")]
    Unknown {
        /// The frame.
        frame: String,
        /// Some that are, in words.
        known: String,
    },
    /// Both frames are known, but not where one is in the other.
    #[error("TF does not connect the frames \"{source_frame}\" and \"{target}\"")]
    Apart {
        /// From here.
        source_frame: String,
        /// To there.
        target: String,
    },
    /// The time is outside what is kept.
    #[error("\"{frame}\" is known from {first:.3} s to {last:.3} s; the time asked is {asked:.3} s")]
    Time {
        /// The frame.
        frame: String,
        /// As asked, s.
        asked: f64,
        /// Oldest sample, s.
        first: f64,
        /// Newest sample, s.
        last: f64,
    },
}

/// Why a transform was not taken in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BadTransform {
    /// A name is empty or far too long, or a frame is its own parent.
    #[error("the frame names are empty, too long or the same")]
    Name,
    /// A number is NaN or infinite, or the rotation is no unit quaternion.
    #[error("the transform is not a rigid motion")]
    Value,
    /// The buffer is full.
    #[error("there are too many frames")]
    Full,
}

#[derive(Debug, Clone)]
struct Frame {
    parent: String,
    /// One sample that always holds.
    fixed: bool,
    /// Time in ns and parent_from_frame, by time.
    samples: VecDeque<(i64, Isometry3<f64>)>,
}

/// The transforms of the last seconds.
#[derive(Debug, Clone, Default)]
pub struct TfBuffer {
    frames: HashMap<String, Frame>,
}

/// tf2 ignores a leading slash.
fn bare(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl TfBuffer {
    /// Takes in one transform of `/tf`, or of `/tf_static` if `fixed`.
    ///
    /// # Errors
    /// When it cannot be a transform, or the buffer is full; the buffer stays as it was.
    pub fn insert(&mut self, transform: &TransformStamped, fixed: bool) -> Result<(), BadTransform> {
        let (child, parent) = (bare(&transform.child_frame_id), bare(&transform.header.frame_id));
        if child.is_empty() || parent.is_empty() || child == parent || child.len().max(parent.len()) > NAME {
            return Err(BadTransform::Name);
        }
        let t = &transform.transform.translation;
        let r = &transform.transform.rotation;
        let rotation = Quaternion::new(r.w, r.x, r.y, r.z);
        let finite = t.array().iter().all(|v| v.abs() < 1e9);
        // Written so that a NaN fails.
        if !finite || !((rotation.norm() - 1.0).abs() < UNIT) {
            return Err(BadTransform::Value);
        }
        let pose = Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), UnitQuaternion::new_normalize(rotation));
        if !self.frames.contains_key(child) && self.frames.len() >= FRAMES {
            return Err(BadTransform::Full);
        }
        let frame = self.frames.entry(child.to_owned()).or_insert_with(|| Frame {
            parent: parent.to_owned(),
            fixed,
            samples: VecDeque::new(),
        });
        if frame.parent != parent || frame.fixed != fixed {
            (frame.parent, frame.fixed) = (parent.to_owned(), fixed);
            frame.samples.clear();
        }
        let time = transform.header.stamp.nanoseconds();
        if fixed {
            frame.samples.clear();
        }
        let newest = frame.samples.back().map_or(i64::MIN, |(t, _)| *t);
        if newest != i64::MIN && newest.abs_diff(time) > KEPT.unsigned_abs() {
            // The sender's clock jumped: what was before means nothing now.
            frame.samples.clear();
        }
        let after = frame.samples.partition_point(|(t, _)| *t <= time);
        frame.samples.insert(after, (time, pose));
        let newest = frame.samples.back().map_or(time, |(t, _)| *t);
        while frame.samples.len() > SAMPLES || frame.samples.front().is_some_and(|(t, _)| newest - t > KEPT) {
            frame.samples.pop_front();
        }
        Ok(())
    }

    /// `target_from_source` at `time` (ns since 1970); `None`: each frame's newest sample.
    ///
    /// # Errors
    /// When a frame is unknown, the frames are not connected, or the time is not covered.
    pub fn lookup(&self, target: &str, source: &str, time: Option<i64>) -> Result<Isometry3<f64>, TfError> {
        let (target, source) = (bare(target), bare(source));
        if target == source {
            return Ok(Isometry3::identity());
        }
        for frame in [source, target] {
            if !self.frames.contains_key(frame) && !self.frames.values().any(|f| f.parent == frame) {
                return Err(TfError::Unknown { frame: frame.to_owned(), known: self.known() });
            }
        }
        // Every ancestor of the source, with ancestor_from_source.
        let mut ancestors = vec![(source, Isometry3::identity())];
        self.climb(source, time, |parent, pose| {
            ancestors.push((parent, pose));
            false
        })?;
        if let Some((_, pose)) = ancestors.iter().find(|(frame, _)| *frame == target) {
            return Ok(*pose);
        }
        let mut found = None;
        self.climb(target, time, |parent, ancestor_from_target| {
            found = ancestors
                .iter()
                .find(|(frame, _)| *frame == parent)
                .map(|(_, ancestor_from_source)| ancestor_from_target.inverse() * ancestor_from_source);
            found.is_some()
        })?;
        found.ok_or_else(|| TfError::Apart { source_frame: source.to_owned(), target: target.to_owned() })
    }

    /// Goes from `frame` to its ancestors, telling each with ancestor_from_frame, until told to stop.
    fn climb<'a>(
        &'a self,
        frame: &'a str,
        time: Option<i64>,
        mut tell: impl FnMut(&'a str, Isometry3<f64>) -> bool,
    ) -> Result<(), TfError> {
        let (mut at, mut pose) = (frame, Isometry3::identity());
        // A loop of frames ends here.
        for _ in 0..self.frames.len() {
            let Some(known) = self.frames.get(at) else { break };
            pose = known.at(at, time)? * pose;
            at = &known.parent;
            if tell(at, pose) {
                break;
            }
        }
        Ok(())
    }

    fn known(&self) -> String {
        if self.frames.is_empty() {
            return ", which knows no frame at all yet".into();
        }
        let mut names: Vec<&str> = self.frames.iter().flat_map(|(child, f)| [child.as_str(), &f.parent]).collect();
        names.sort_unstable();
        names.dedup();
        let more = if names.len() > 8 { ", ..." } else { "" };
        names.truncate(8);
        format!("; known: {}{more}", names.join(", "))
    }
}

impl Frame {
    /// Parent from this frame at `time`.
    fn at(&self, name: &str, time: Option<i64>) -> Result<Isometry3<f64>, TfError> {
        let (Some(first), Some(last)) = (self.samples.front(), self.samples.back()) else {
            return Err(TfError::Unknown { frame: name.to_owned(), known: String::new() });
        };
        let Some(time) = time.filter(|_| !self.fixed) else { return Ok(last.1) };
        if time < first.0 - TOLERANCE || time > last.0 + TOLERANCE {
            let seconds = |t: i64| t as f64 * 1e-9;
            let (asked, first, last) = (seconds(time), seconds(first.0), seconds(last.0));
            return Err(TfError::Time { frame: name.to_owned(), asked, first, last });
        }
        let after = self.samples.partition_point(|(t, _)| *t <= time);
        Ok(match (after.checked_sub(1).and_then(|i| self.samples.get(i)), self.samples.get(after)) {
            (Some((t0, a)), Some((t1, b))) => {
                let share = (time - t0) as f64 / (t1 - t0) as f64;
                // Half a turn between two samples has no shortest way; then the earlier one holds.
                a.try_lerp_slerp(b, share, 1e-9).unwrap_or(*a)
            }
            (Some((_, only)), None) | (None, Some((_, only))) => *only,
            (None, None) => last.1,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::msg::{Header, Quaternion as Turn, Time, Transform, Vector3};

    fn transform(parent: &str, child: &str, seconds: f64, x: f64, yaw: f64) -> TransformStamped {
        TransformStamped {
            header: Header { stamp: Time::from_nanoseconds((seconds * 1e9) as i64), frame_id: parent.into() },
            child_frame_id: child.into(),
            transform: Transform {
                translation: Vector3::new([x, 0.0, 0.0]),
                rotation: Turn { x: 0.0, y: 0.0, z: (0.5 * yaw).sin(), w: (0.5 * yaw).cos() },
            },
        }
    }

    #[test]
    fn frames_are_chained_through_their_common_ancestor_and_interpolated() {
        let mut tf = TfBuffer::default();
        tf.insert(&transform("map", "odom", 0.0, 1.0, 0.0), true).unwrap();
        for (time, x) in [(100.0, 2.0), (101.0, 4.0)] {
            tf.insert(&transform("odom", "/base_footprint", time, x, FRAC_PI_2), false).unwrap();
        }
        tf.insert(&transform("map", "camera", 100.5, 0.0, 0.0), false).unwrap();
        // The robot is at map x 1 + 3 and looks to map y; the camera's origin lies 4 m to the robot's left.
        let at = tf.lookup("base_footprint", "camera", Some(100_500_000_000)).unwrap();
        assert!((at.translation.vector - nalgebra::Vector3::new(0.0, 4.0, 0.0)).norm() < 1e-12, "{at}");
        assert!((at.rotation.euler_angles().2 + FRAC_PI_2).abs() < 1e-12);
        let newest = tf.lookup("/base_footprint", "camera", None).unwrap();
        assert!((newest.translation.y - 5.0).abs() < 1e-12);
        // Soon after the newest sample counts as now; long before and after do not.
        assert!(tf.lookup("odom", "base_footprint", Some(101_100_000_000)).is_ok());
        for time in [90_000_000_000, 103_000_000_000] {
            assert!(matches!(tf.lookup("odom", "base_footprint", Some(time)), Err(TfError::Time { .. })));
        }
        assert!(matches!(tf.lookup("base_footprint", "mars", None), Err(TfError::Unknown { .. })));
        tf.insert(&transform("moon", "lander", 100.0, 0.0, 0.0), false).unwrap();
        assert!(matches!(tf.lookup("base_footprint", "lander", None), Err(TfError::Apart { .. })));
    }

    #[test]
    fn what_is_no_transform_is_refused_and_a_loop_ends() {
        let mut tf = TfBuffer::default();
        assert_eq!(tf.insert(&transform("a", "b", 0.0, f64::NAN, 0.0), false), Err(BadTransform::Value));
        assert_eq!(tf.insert(&transform("a", "/a", 0.0, 0.0, 0.0), false), Err(BadTransform::Name));
        assert_eq!(tf.insert(&transform("", "a", 0.0, 0.0, 0.0), false), Err(BadTransform::Name));
        let mut crooked = transform("a", "b", 0.0, 0.0, 0.0);
        crooked.transform.rotation.w = 0.5;
        assert_eq!(tf.insert(&crooked, false), Err(BadTransform::Value));
        for (parent, child) in [("a", "b"), ("b", "c"), ("c", "a"), ("x", "y")] {
            tf.insert(&transform(parent, child, 0.0, 0.0, 0.0), false).unwrap();
        }
        assert!(tf.lookup("y", "a", None).is_err());
    }

    #[test]
    fn the_buffer_is_bounded() {
        let mut tf = TfBuffer::default();
        for i in 0..3 * SAMPLES {
            tf.insert(&transform("a", "b", 1e-4 * i as f64, 0.0, 0.0), false).unwrap();
        }
        assert_eq!(tf.frames["b"].samples.len(), SAMPLES);
        for i in 0..20_000 {
            tf.insert(&transform("a", "b", i as f64, 0.0, 0.0), false).unwrap();
        }
        assert!(tf.frames["b"].samples.len() <= 12);
        let refused =
            (0..2 * FRAMES).filter(|i| tf.insert(&transform("a", &format!("f{i}"), 0.0, 0.0, 0.0), false).is_err());
        assert_eq!(refused.count(), FRAMES + 1);
    }
}
