//! Reads Acclaim's ASF (skeleton) and AMC (motion) files, as CMU's database has them.
//!
//! Source: the format as described in "Acclaim ASF/AMC" (J. Lander, Working with Motion Capture File Formats, 1998)
//! and used by CMU (<http://mocap.cs.cmu.edu>).
//!
//! - Lengths: one unit of the file is `1 / units.length` inches, so metres are `length * 0.0254 / units.length`:
//!   0.056444 at CMU's 0.45. Angles by `units.angle`, overridden by the AMC's `:DEGREES` or `:RADIANS`.
//! - Axes: y is up in the file; its x, y, z are our y, z, x.
//! - A bone turns by `C R C^-1` relative to its parent. `C` comes from the bone's `axis`, `R` from the frame's angles;
//!   for the letters XYZ both are `Rz Ry Rx`: the first letter is applied first. The order of `R` is that of `dof`.
//! - Root: values come in the order of `order`; `R` is applied in the order of the letters of `axis`, `C` comes from
//!   `orientation`. The translation is added to `position`.
//! - A bone ends at `direction * length` and its children start there; the root has no length, its children start
//!   at its origin.
//!
//! Not done: `:skin`, masses and limits are skipped; degrees of freedom that translate or stretch a bone are refused.
//! Every frame must give every bone that can move; frames are numbered without a gap.

mod motion;
mod skeleton;

use std::path::Path;

use crate::MotionError;
use crate::clip::{Clip, Skeleton};
use crate::text;

/// Frames a second of CMU's database; an AMC file does not say.
pub const CMU_RATE: f64 = 120.0;

/// Reads the skeleton of an ASF file.
///
/// # Errors
///
/// [`MotionError`] with file and line: unreadable, or not what the format asks for.
pub fn load_skeleton(path: &Path) -> Result<Skeleton, MotionError> {
    Ok(skeleton::parse(path, &text::read(path)?)?.skeleton)
}

/// Reads the clip of an AMC file at `rate` frames a second, with the skeleton of an ASF file.
///
/// # Errors
///
/// [`MotionError`] with file and line: unreadable, not what the format asks for, or not of this skeleton;
/// [`MotionError::Argument`] if `rate` is not finite and positive.
pub fn load_clip(skeleton_path: &Path, clip_path: &Path, rate: f64) -> Result<Clip, MotionError> {
    if !(rate.is_finite() && rate > 0.0) {
        return Err(MotionError::argument("rate", rate.to_string(), "frames a second, positive"));
    }
    let rig = skeleton::parse(skeleton_path, &text::read(skeleton_path)?)?;
    let frames = motion::parse(clip_path, &text::read(clip_path)?, &rig, rate)?;
    Ok(Clip { skeleton: rig.skeleton, rate, frames })
}
