//! Reads Biovision's BVH files.

use std::path::Path;

use crate::MotionError;
use crate::clip::Clip;

/// Metres in a centimetre, the usual unit.
pub const CENTIMETRE: f64 = 0.01;

/// Metres in a unit of the BVH conversions of CMU's database, which keep the ASF's unit: inches over 0.45.
pub const CMU: f64 = 0.0254 / 0.45;

/// Reads the clip of a BVH file in which one unit is `metres_per_unit` metres.
///
/// # Errors
///
/// [`MotionError`] with file and line: unreadable, or not what the format asks for.
pub fn load_clip(path: &Path, metres_per_unit: f64) -> Result<Clip, MotionError> {
    let _ = (path, metres_per_unit);
    unimplemented!("body follows")
}

/// The error for a BVH that was asked for without its unit.
pub(crate) fn unit_missing(path: &Path) -> MotionError {
    MotionError::content(path, "unit", "not given", "metres in one unit")
}
