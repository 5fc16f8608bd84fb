//! Takes jumps out of a clip: places where the whole figure is suddenly somewhere else.
//!
//! Problem: public conversions put the rest pose before the first frame (as those of CMU's clips to BVH do), recordings are cut and
//! joined, and a system that loses its actor throws the whole figure away for some frames. None of that is motion, and the fastest
//! "kick" of such a clip is the jump.
//!
//! A step between two frames is a jump where the figure's points (joints and bone ends) move, in the root mean square, at more than
//! [`SPEED`] and more than [`RATIO`] times as far as in the steps around it. A hard kick is neither: it moves one leg, and it begins and
//! ends over several frames. Jumps cut the clip into stretches; the longest is kept. From there outwards a stretch that goes on where
//! the last one ended, at most [`BRIDGE`] later, is joined to it, the frames between them interpolated; what lies beyond is left out.
//!
//! Not done: single bones that are thrown ([`crate::despike`]); a choice among stretches by what happens in them.

use std::ops::Range;

use nalgebra::Vector3;

use crate::clip::{BonePoses, Clip, Frame, slerp};
use crate::track::median;

/// Speed (root mean square over the figure's points) from which a step can be a jump, m/s.
pub const SPEED: f64 = 3.0;
/// How many times the median of the steps around it such a step must be.
pub const RATIO: f64 = 4.0;
/// Longest time that is interpolated, s.
pub const BRIDGE: f64 = 0.15;
/// Steps to each side that a step is compared with.
const AROUND: usize = 6;
/// Shortest stretch that is motion on its own, in frames.
const SHORTEST: usize = 5;

/// What was done about a jump.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mended {
    /// These frames were left out.
    LeftOut(Range<usize>),
    /// These frames were replaced by what lies between their neighbours.
    Bridged(Range<usize>),
}

/// A clip without jumps.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuous {
    /// What is left.
    pub clip: Clip,
    /// Index in the original of the first frame of `clip`.
    pub start: usize,
    /// What was done, in time order; frames counted from 0 in the original.
    pub mended: Vec<Mended>,
}

impl std::fmt::Display for Mended {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (frames, what) = match self {
            Self::LeftOut(frames) => (frames, "left out: the figure jumps there"),
            Self::Bridged(frames) => (frames, "bridged: the figure jumps away and back there"),
        };
        match frames.len() {
            1 => write!(out, "frame {} {what}", frames.start + 1),
            _ => write!(out, "frames {} to {} {what}", frames.start + 1, frames.end),
        }
    }
}

/// `clip` without jumps; the same clip where it has none.
#[must_use]
pub fn without_jumps(clip: &Clip) -> Continuous {
    let points = all_points(clip);
    let steps: Vec<f64> = points.windows(2).map(|pair| distance(&pair[0], &pair[1])).collect();
    let mut stretches: Vec<Range<usize>> = Vec::new();
    let mut start = 0;
    for step in 0..steps.len() {
        if is_jump(&steps, step, clip.rate) {
            stretches.push(start..step + 1);
            start = step + 1;
        }
    }
    stretches.push(start..clip.frames.len());
    // The first of the longest ones, so that the choice does not hang on the order of equal keys.
    let longest = stretches.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
    let Some(main) = stretches.iter().position(|stretch| stretch.len() == longest) else {
        return Continuous { clip: clip.clone(), start: 0, mended: Vec::new() };
    };
    let mut kept = stretches[main].clone();
    let mut gaps: Vec<Range<usize>> = Vec::new();
    for later in &stretches[main + 1..] {
        if goes_on(&points, &steps, clip.rate, kept.end - 1, later.start) && later.len() >= SHORTEST.min(longest) {
            gaps.push(kept.end..later.start);
            kept.end = later.end;
        }
    }
    for earlier in stretches[..main].iter().rev() {
        if goes_on(&points, &steps, clip.rate, earlier.end - 1, kept.start) && earlier.len() >= SHORTEST.min(longest) {
            gaps.push(earlier.end..kept.start);
            kept.start = earlier.start;
        }
    }
    gaps.sort_by_key(|gap| gap.start);
    let mut whole = clip.clone();
    for gap in &gaps {
        bridge(&mut whole, gap);
    }
    whole.frames.truncate(kept.end);
    whole.frames.drain(..kept.start);
    let mut mended = Vec::new();
    if kept.start > 0 {
        mended.push(Mended::LeftOut(0..kept.start));
    }
    mended.extend(gaps.into_iter().map(Mended::Bridged));
    if kept.end < clip.frames.len() {
        mended.push(Mended::LeftOut(kept.end..clip.frames.len()));
    }
    Continuous { clip: whole, start: kept.start, mended }
}

/// Joints and bone ends at each frame, m.
fn all_points(clip: &Clip) -> Vec<Vec<Vector3<f64>>> {
    let mut poses = BonePoses::default();
    (0..clip.frames.len())
        .map(|frame| {
            clip.poses_into(frame, &mut poses);
            let tips = clip.skeleton.bones.iter().enumerate().map(|(i, bone)| poses.point(i, &bone.tip));
            poses.origins.iter().copied().chain(tips).collect()
        })
        .collect()
}

/// Root mean square of the distances between the same points, m.
fn distance(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (b - a).norm_squared()).sum();
    (sum / a.len().max(1) as f64).sqrt()
}

/// Median of the steps around `step` without itself, m.
fn usual(steps: &[f64], step: usize) -> f64 {
    let around = step.saturating_sub(AROUND)..(step + AROUND + 1).min(steps.len());
    median(around.filter(|&other| other != step).map(|other| steps[other]).collect())
}

fn is_jump(steps: &[f64], step: usize, rate: f64) -> bool {
    steps[step] * rate > SPEED && steps[step] > RATIO * usual(steps, step)
}

/// Whether the motion at frame `later` is where that of frame `last` could have come to.
fn goes_on(points: &[Vec<Vector3<f64>>], steps: &[f64], rate: f64, last: usize, later: usize) -> bool {
    let frames = later - last;
    let usual =
        usual(steps, last).max(usual(steps, later.min(steps.len().saturating_sub(1)))).max(SPEED / RATIO / rate);
    (frames - 1) as f64 <= BRIDGE * rate && distance(&points[last], &points[later]) <= RATIO * usual * frames as f64
}

/// Replaces the frames of `gap`, which has a frame before and after it, by what lies between those.
fn bridge(clip: &mut Clip, gap: &Range<usize>) {
    let (before, after) = (clip.frames[gap.start - 1].clone(), clip.frames[gap.end].clone());
    for frame in gap.clone() {
        let s = (frame - gap.start + 1) as f64 / (gap.len() + 1) as f64;
        clip.frames[frame] = Frame {
            root: before.root.lerp(&after.root, s),
            rotations: before.rotations.iter().zip(&after.rotations).map(|(p, q)| slerp(p, q, s)).collect(),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Bone, Skeleton};
    use nalgebra::UnitQuaternion;

    /// Two bones at 100 Hz: a body that walks at 1.5 m/s and a leg that swings, at up to 20 rad/s.
    fn walking() -> Clip {
        let body = Bone { name: "body".into(), parent: None, origin: Vector3::zeros(), tip: Vector3::z() * 0.6 };
        let leg = Bone { name: "leg".into(), parent: Some(0), origin: Vector3::zeros(), tip: Vector3::z() * -0.9 };
        let frame = |i: usize| {
            let t = i as f64 / 100.0;
            let swing = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), (20.0 * t).sin());
            Frame { root: Vector3::new(1.5 * t, 0.0, 0.9), rotations: vec![UnitQuaternion::identity(), swing] }
        };
        Clip { skeleton: Skeleton { bones: vec![body, leg] }, rate: 100.0, frames: (0..80).map(frame).collect() }
    }

    fn rest() -> Frame {
        Frame { root: Vector3::zeros(), rotations: vec![UnitQuaternion::identity(); 2] }
    }

    #[test]
    fn a_kick_is_no_jump() {
        let clip = walking();
        assert_eq!(without_jumps(&clip), Continuous { clip: clip.clone(), start: 0, mended: vec![] });
    }

    /// Issue 22: public conversions of CMU's clips begin with the rest pose.
    #[test]
    fn issue_22_rest_poses_at_both_ends_are_left_out() {
        let clip = walking();
        let mut longer = clip.clone();
        longer.frames.insert(0, rest());
        longer.frames.extend([rest(), rest()]);
        let found = without_jumps(&longer);
        assert_eq!(found.mended, [Mended::LeftOut(0..1), Mended::LeftOut(81..83)]);
        assert_eq!((found.clip, found.start), (clip, 1));
        assert_eq!(found.mended[0].to_string(), "frame 1 left out: the figure jumps there");
    }

    #[test]
    fn frames_thrown_away_in_the_middle_are_bridged() {
        let clip = walking();
        let mut thrown = clip.clone();
        thrown.frames[40..43].fill(rest());
        let found = without_jumps(&thrown);
        assert_eq!(found.mended, [Mended::Bridged(40..43)]);
        let way = (found.clip.frames[41].root - clip.frames[41].root).norm();
        assert!(way < 1e-9, "{way}");
        assert_eq!(found.clip.frames.len(), clip.frames.len());
    }

    #[test]
    fn what_goes_on_elsewhere_is_left_out() {
        let mut cut = walking();
        for frame in &mut cut.frames[..30] {
            frame.root.y += 2.0;
        }
        let found = without_jumps(&cut);
        assert_eq!((found.mended, found.start), (vec![Mended::LeftOut(0..30)], 30));
    }
}
