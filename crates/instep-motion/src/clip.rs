//! A human clip: a skeleton and its frames, independent of the file format it was read from.
//!
//! Frames of reference: the world has z up and its ground at z = 0 (as recorded); the heading is the
//! recorder's. Each bone has a frame at the joint where it starts, and in the skeleton's zero pose all of these
//! frames are aligned with the world, so a bone's world rotation *is* its rotation away from the zero pose.

use nalgebra::{UnitQuaternion, Vector3};

/// One bone: the body that turns about the joint where it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Bone {
    /// The file's name for it.
    pub name: String,
    /// Index of the bone it hangs on; `None` for the root. Always smaller than its own index.
    pub parent: Option<usize>,
    /// Where its joint lies in the parent's frame, m (zero for the root).
    pub origin: Vector3<f64>,
    /// Where it ends, in its own frame, m (zero for the root of an ASF, which has no length).
    pub tip: Vector3<f64>,
}

/// A tree of bones, parents before children.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// The bones; index 0 is the root.
    pub bones: Vec<Bone>,
}

/// One frame of a clip: the root's place and every joint's rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Origin of the root bone in the world, m.
    pub root: Vector3<f64>,
    /// `parent_from_bone` for each bone (`world_from_root` for the root).
    pub rotations: Vec<UnitQuaternion<f64>>,
}

/// A skeleton with its frames at a fixed rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// What moves.
    pub skeleton: Skeleton,
    /// Frames a second.
    pub rate: f64,
    /// At least one.
    pub frames: Vec<Frame>,
}

/// Where every bone is at one frame: the result of forward kinematics.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BonePoses {
    /// Origin of each bone in the world, m.
    pub origins: Vec<Vector3<f64>>,
    /// `world_from_bone`.
    pub rotations: Vec<UnitQuaternion<f64>>,
}
