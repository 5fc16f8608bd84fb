//! Takes single-frame spikes out of a clip.
//!
//! Problem: a marker that is mistaken for another for one frame throws a bone to another place and back. A frame is
//! a spike where it lies off the middle between its neighbours by more than a threshold, and by more than the
//! neighbours lie apart: so a fast but steady motion is left alone. It is replaced by that middle, bone by bone.
//!
//! Not done: bad stretches of several frames, and steps that do not come back at once (CMU 10_05's kicking foot at
//! 2.52 s is such a step: it jumps by 40 degrees and takes five frames to return). Speeds inside this crate are safe
//! from both kinds, see [`crate::phase::find_kick`]; whoever follows the poses themselves should smooth them.

use nalgebra::UnitQuaternion;

use crate::clip::{Clip, slerp};

/// Threshold that suits clips of people at 60 to 120 Hz, m.
pub const POSITION: f64 = 0.02;

/// Threshold that suits clips of people at 60 to 120 Hz, rad.
pub const ANGLE: f64 = 0.1;

/// One frame that was replaced.
#[derive(Debug, Clone, PartialEq)]
pub struct Spike {
    /// The frame.
    pub frame: usize,
    /// Name of the bone whose rotation was off; `None` for the root's position.
    pub bone: Option<String>,
    /// How far off it was: rad for a rotation, m for the root's position.
    pub size: f64,
}

/// The clip with each single-frame spike of the root's position (more than `position` m off, [`POSITION`]) or of a
/// rotation (more than `angle` rad off, [`ANGLE`]) replaced by the middle of its neighbours, and what was replaced.
#[must_use]
pub fn despike(clip: &Clip, position: f64, angle: f64) -> (Clip, Vec<Spike>) {
    let mut clean = clip.clone();
    let mut spikes = Vec::new();
    for (i, triple) in clip.frames.windows(3).enumerate() {
        let [before, frame, after] = triple else { continue };
        let middle = (before.root + after.root) / 2.0;
        let size = (frame.root - middle).norm();
        if size > position && size > (after.root - before.root).norm() {
            clean.frames[i + 1].root = middle;
            spikes.push(Spike { frame: i + 1, bone: None, size });
        }
        for (j, bone) in clip.skeleton.bones.iter().enumerate() {
            let [a, b, c]: [&UnitQuaternion<f64>; 3] = [&before.rotations[j], &frame.rotations[j], &after.rotations[j]];
            let middle = slerp(a, c, 0.5);
            let size = middle.angle_to(b);
            if size > angle && size > a.angle_to(c) {
                clean.frames[i + 1].rotations[j] = middle;
                spikes.push(Spike { frame: i + 1, bone: Some(bone.name.clone()), size });
            }
        }
    }
    (clean, spikes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Bone, Frame, Skeleton};
    use nalgebra::Vector3;

    /// One bone that turns at 20 rad/s about z and moves at 3 m/s, at 100 Hz.
    fn turning() -> Clip {
        let bone = Bone { name: "root".into(), parent: None, origin: Vector3::zeros(), tip: Vector3::x() };
        let frame = |i: usize| Frame {
            root: Vector3::new(0.03 * i as f64, 0.0, 1.0),
            rotations: vec![UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.2 * i as f64)],
        };
        Clip { skeleton: Skeleton { bones: vec![bone] }, rate: 100.0, frames: (0..30).map(frame).collect() }
    }

    #[test]
    fn steady_motion_is_left_alone() {
        let clip = turning();
        assert_eq!(despike(&clip, POSITION, ANGLE), (clip, vec![]));
    }

    #[test]
    fn a_thrown_frame_is_put_back() {
        let clip = turning();
        let mut thrown = clip.clone();
        thrown.frames[10].rotations[0] *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0);
        thrown.frames[20].root.z += 0.3;
        let (clean, spikes) = despike(&thrown, POSITION, ANGLE);
        assert_eq!(spikes.iter().map(|s| (s.frame, s.bone.is_some())).collect::<Vec<_>>(), [(10, true), (20, false)]);
        assert!(clean.frames[10].rotations[0].angle_to(&clip.frames[10].rotations[0]) < 1e-9);
        assert!((clean.frames[20].root - clip.frames[20].root).norm() < 1e-12);
    }
}
