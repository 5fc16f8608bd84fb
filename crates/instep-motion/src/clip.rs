//! A human clip: a skeleton and its frames, independent of the file format it was read from; its forward kinematics
//! and its resampling.
//!
//! Frames of reference: the world has z up and its ground near z = 0 (as recorded; [`crate::contact`] estimates it);
//! the heading is the recorder's. Each bone has a frame at the joint where it starts, and in the skeleton's zero pose
//! all of these frames are aligned with the world, so a bone's world rotation *is* its rotation away from the zero
//! pose. What that zero pose looks like is the file's business: CMU's ASF stands with the legs spread by 20 degrees,
//! the arms out to the sides and the feet flat.
//!
//! Forward kinematics is the plain recursion from the root: `world_from_bone = world_from_parent * parent_from_bone`,
//! `origin = parent_origin + world_from_parent * bone.origin`.

use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};

use crate::{MotionError, asf, bvh};

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

/// How far the norm of a rotation may be from 1.
const UNIT: f64 = 1e-6;

impl BonePoses {
    /// The point `local` (m, in the frame of bone `bone`) in the world, m.
    ///
    /// # Panics
    ///
    /// If `bone` is not an index of the skeleton that these poses came from.
    #[must_use]
    pub fn point(&self, bone: usize, local: &Vector3<f64>) -> Vector3<f64> {
        self.origins[bone] + self.rotations[bone] * local
    }
}

impl Skeleton {
    /// Index of the bone called exactly `name`.
    #[must_use]
    pub fn index(&self, name: &str) -> Option<usize> {
        self.bones.iter().position(|bone| bone.name == name)
    }

    /// The poses of the zero pose: root at the origin, every frame aligned with the world.
    #[must_use]
    pub fn zero_poses(&self) -> BonePoses {
        let frame = Frame { root: Vector3::zeros(), rotations: vec![UnitQuaternion::identity(); self.bones.len()] };
        let mut poses = BonePoses::default();
        self.poses_into(&frame, &mut poses);
        poses
    }

    /// Forward kinematics of one frame. Allocates only while `poses` has not yet the capacity.
    ///
    /// # Panics
    ///
    /// If the frame has fewer rotations than the skeleton has bones, or a parent comes after its child; both are
    /// refused by [`Clip::validate`].
    pub fn poses_into(&self, frame: &Frame, poses: &mut BonePoses) {
        poses.origins.clear();
        poses.rotations.clear();
        for (bone, rotation) in self.bones.iter().zip(&frame.rotations) {
            let (origin, world_from_bone) = match bone.parent {
                None => (frame.root, *rotation),
                Some(parent) => (poses.point(parent, &bone.origin), poses.rotations[parent] * rotation),
            };
            poses.origins.push(origin);
            poses.rotations.push(world_from_bone);
        }
    }

    /// Checks that there is a root, that parents come before children, that names differ and that all is finite.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] with the bone and what is wrong with it.
    pub fn validate(&self) -> Result<(), MotionError> {
        if self.bones.is_empty() {
            return Err(MotionError::argument("skeleton", "no bones", "at least a root"));
        }
        for (i, bone) in self.bones.iter().enumerate() {
            let place = || format!("skeleton.bones[{i}] {:?}", bone.name);
            match bone.parent {
                None if i > 0 => return Err(MotionError::argument(place(), "no parent", "only bone 0 without one")),
                Some(parent) if parent >= i => {
                    return Err(MotionError::argument(
                        place(),
                        format!("parent {parent}"),
                        format!("a parent below {i}"),
                    ));
                }
                _ => {}
            }
            if !bone.origin.iter().chain(bone.tip.iter()).all(|v| v.is_finite()) {
                return Err(MotionError::argument(place(), "an origin or tip that is not finite", "metres"));
            }
            if self.bones[..i].iter().any(|other| other.name == bone.name) {
                return Err(MotionError::argument(place(), "a name used twice", "a name for each bone"));
            }
        }
        Ok(())
    }
}

impl Clip {
    /// From the first frame to the last, s (one frame less than CMU's table counts).
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.frames.len().saturating_sub(1) as f64 / self.rate
    }

    /// The time of frame `frame`, s; frame 0 is at zero.
    #[must_use]
    pub fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.rate
    }

    /// The frame nearest to the time `t` in seconds, clamped to the clip.
    #[must_use]
    pub fn frame_at(&self, t: f64) -> usize {
        // A cast of a float saturates: negative times and NaN give 0.
        ((t * self.rate).round() as usize).min(self.frames.len().saturating_sub(1))
    }

    /// Forward kinematics of the frame with index `frame`. Allocates only while `poses` has not yet the capacity.
    ///
    /// # Panics
    ///
    /// If `frame` is not below `self.frames.len()`.
    pub fn poses_into(&self, frame: usize, poses: &mut BonePoses) {
        self.skeleton.poses_into(&self.frames[frame], poses);
    }

    /// [`Self::poses_into`] with fresh memory.
    ///
    /// # Panics
    ///
    /// If `frame` is not below `self.frames.len()`.
    #[must_use]
    pub fn poses(&self, frame: usize) -> BonePoses {
        let mut poses = BonePoses::default();
        self.poses_into(frame, &mut poses);
        poses
    }

    /// The same motion at `rate` frames a second: roots linear, rotations by slerp between the two nearest frames.
    /// The last frame is the last one at or before the clip's end.
    ///
    /// Nothing is low-passed: resampling to a lower rate can alias what is faster than half of it.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] if `rate` is not finite and positive, if the clip is empty, or if the result would
    /// have more than a hundred million frames.
    pub fn resampled(&self, rate: f64) -> Result<Self, MotionError> {
        const MOST: f64 = 1e8;
        let wanted = self.duration() * rate;
        if !(rate.is_finite() && rate > 0.0 && wanted.is_finite() && wanted < MOST) {
            let expected = format!("frames a second, positive, at most {MOST:e} frames in all");
            return Err(MotionError::argument("rate", rate.to_string(), expected));
        }
        if self.frames.is_empty() {
            return Err(MotionError::argument("clip.frames", "none", "at least one frame"));
        }
        let count = (wanted + 1e-9).floor() as usize + 1;
        let frames = (0..count).map(|i| self.interpolated(i as f64 / rate)).collect();
        Ok(Self { skeleton: self.skeleton.clone(), rate, frames })
    }

    /// The pose at the time `t` in seconds, clamped to the clip: root linear, rotations by slerp.
    ///
    /// # Panics
    ///
    /// If the clip has no frame.
    #[must_use]
    pub fn interpolated(&self, t: f64) -> Frame {
        let last = self.frames.len() - 1;
        let place = (t * self.rate).clamp(0.0, last as f64);
        let i = (place as usize).min(last.saturating_sub(1));
        let (a, b, s) = (&self.frames[i], &self.frames[(i + 1).min(last)], place - i as f64);
        Frame {
            root: a.root.lerp(&b.root, s),
            rotations: a.rotations.iter().zip(&b.rotations).map(|(p, q)| slerp(p, q, s)).collect(),
        }
    }

    /// Checks the skeleton, the rate, and that each frame has a finite root and a unit rotation for each bone.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] with the path of the field and what is wrong with it.
    pub fn validate(&self) -> Result<(), MotionError> {
        self.skeleton.validate()?;
        if !(self.rate.is_finite() && self.rate > 0.0) {
            return Err(MotionError::argument("clip.rate", self.rate.to_string(), "frames a second, positive"));
        }
        if self.frames.is_empty() {
            return Err(MotionError::argument("clip.frames", "none", "at least one frame"));
        }
        for (i, frame) in self.frames.iter().enumerate() {
            let place = |field: &str| format!("clip.frames[{i}].{field}");
            if frame.rotations.len() != self.skeleton.bones.len() {
                let expected = format!("{}, one a bone", self.skeleton.bones.len());
                return Err(MotionError::argument(place("rotations"), frame.rotations.len().to_string(), expected));
            }
            if !frame.root.iter().all(|v| v.is_finite()) {
                return Err(MotionError::argument(place("root"), format!("{:?}", frame.root.as_slice()), "metres"));
            }
            for (rotation, bone) in frame.rotations.iter().zip(&self.skeleton.bones) {
                if !(1.0 - UNIT..=1.0 + UNIT).contains(&rotation.norm()) {
                    let field = place(&format!("rotations ({})", bone.name));
                    return Err(MotionError::argument(field, format!("norm {}", rotation.norm()), "norm 1"));
                }
            }
        }
        Ok(())
    }
}

/// From `a` to `b` the short way round at constant speed. By logarithm and exponential, which keep their accuracy for
/// small angles, where the usual formula by the arc cosine is off by 1e-8.
pub(crate) fn slerp(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>, s: f64) -> UnitQuaternion<f64> {
    a * UnitQuaternion::from_scaled_axis((a.inverse() * b).scaled_axis() * s)
}

/// How to read a clip whose format leaves something open.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadOptions {
    /// The ASF of an AMC. `None`: the AMC's name up to its last underscore, with `.asf`, in the same folder, as
    /// CMU names them (`10_05.amc` belongs to `10.asf`).
    pub skeleton: Option<PathBuf>,
    /// Frames a second of an AMC, which does not say; default [`asf::CMU_RATE`].
    pub amc_rate: f64,
    /// Metres in one unit of a BVH, which does not say: [`bvh::CENTIMETRE`], 1, [`bvh::CMU`]. It is never guessed:
    /// `None` is an error for a BVH, and that error tells how tall the figure is in the file's unit.
    pub bvh_metres_per_unit: Option<f64>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { skeleton: None, amc_rate: asf::CMU_RATE, bvh_metres_per_unit: None }
    }
}

/// Reads the clip at `path` by its extension, `.amc` or `.bvh` (upper or lower case).
///
/// # Errors
///
/// [`MotionError`] with the file, and where there is one the line: unreadable, not understood, of another kind, or
/// in want of an option.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Clip, MotionError> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).unwrap_or_default();
    match extension.as_str() {
        "amc" => {
            let skeleton = options.skeleton.clone().unwrap_or_else(|| asf_beside(path));
            asf::load_clip(&skeleton, path, options.amc_rate)
        }
        "bvh" => match options.bvh_metres_per_unit {
            Some(scale) => bvh::load_clip(path, scale),
            None => Err(bvh::unit_missing(path)),
        },
        other => Err(MotionError::content(path, "extension", format!("{other:?}"), ".amc or .bvh")),
    }
}

fn asf_beside(amc: &Path) -> PathBuf {
    let stem = amc.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let subject = stem.rsplit_once('_').map_or(stem.as_str(), |(subject, _)| subject);
    amc.with_file_name(format!("{subject}.asf"))
}
