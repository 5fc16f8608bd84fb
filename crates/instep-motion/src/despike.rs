//! Removes spikes of a single frame from a clip.

use crate::clip::Clip;

/// One frame that was replaced.
#[derive(Debug, Clone, PartialEq)]
pub struct Spike {
    /// The frame.
    pub frame: usize,
    /// The bone whose rotation was off, or the root for its position.
    pub bone: String,
}

/// The clip with each single-frame spike of a root position (more than `position` m off the mean of its neighbours)
/// or of a rotation (more than `angle` rad off) replaced by that mean, and what was replaced.
#[must_use]
pub fn despike(clip: &Clip, position: f64, angle: f64) -> (Clip, Vec<Spike>) {
    let _ = (clip, position, angle);
    unimplemented!("body follows")
}
