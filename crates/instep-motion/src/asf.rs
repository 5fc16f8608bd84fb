//! Reads Acclaim's ASF (skeleton) and AMC (motion) files, as CMU's database has them.

use std::path::Path;

use crate::MotionError;
use crate::clip::{Clip, Skeleton};

/// Frames a second of CMU's database; an AMC file does not say.
pub const CMU_RATE: f64 = 120.0;

/// Reads the skeleton of an ASF file.
///
/// # Errors
///
/// [`MotionError`] with file and line: unreadable, or not what the format asks for.
pub fn load_skeleton(path: &Path) -> Result<Skeleton, MotionError> {
    let _ = path;
    unimplemented!("body follows")
}

/// Reads the clip of an AMC file at `rate` frames a second, with the skeleton of an ASF file.
///
/// # Errors
///
/// [`MotionError`] with file and line: unreadable, not what the format asks for, or not of this skeleton.
pub fn load_clip(skeleton_path: &Path, clip_path: &Path, rate: f64) -> Result<Clip, MotionError> {
    let _ = (skeleton_path, clip_path, rate);
    unimplemented!("body follows")
}
