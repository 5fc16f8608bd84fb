//! Reads Biovision's BVH files.
//!
//! Source: the format as described in "Biovision BVH" (J. Lander, Working with Motion Capture File Formats, 1998).
//!
//! - Axes: y is up in the file; its x, y, z are our y, z, x. The unit of length is not in the file and must be given.
//! - A joint's channels may come in any order and any number. Rotations are in degrees and apply in the order listed,
//!   the first outermost: `Zrotation Xrotation Yrotation` is `Rz Rx Ry`.
//! - Position channels replace the joint's OFFSET, axis by axis. On the root they make its path. On other joints they
//!   are accepted where they do not change over the clip by more than a millimetre, since our bones have a fixed
//!   length: the first frame then gives the joint's place.
//! - A bone ends at its End Site, else where its first child starts.
//! - `1 / Frame Time` within 0.01 % of a whole number is that number: files print few digits.
//!
//! Not done: several roots, scale channels; both are refused.

mod hierarchy;

use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};

use crate::MotionError;
use crate::clip::{Bone, Clip, Frame, Skeleton};
use crate::text::{self, Line, number, z_up};
use hierarchy::{Channel, Joint};

/// Metres in a centimetre, the usual unit.
pub const CENTIMETRE: f64 = 0.01;

/// Metres in a unit of the BVH conversions of CMU's database, which keep the ASF's unit: inches over 0.45.
pub const CMU: f64 = 0.0254 / 0.45;

/// How far the position channels of a joint other than the root may wander, m.
const STILL: f64 = 1e-3;

/// Reads the clip of a BVH file in which one unit is `metres_per_unit` metres ([`CENTIMETRE`], 1, [`CMU`]).
///
/// # Errors
///
/// [`MotionError`] with file and line: unreadable, or not what the format asks for; [`MotionError::Argument`] if
/// `metres_per_unit` is not finite and positive.
pub fn load_clip(path: &Path, metres_per_unit: f64) -> Result<Clip, MotionError> {
    if !(1e-9..=1e9).contains(&metres_per_unit) {
        let expected = "a positive number, such as 0.01 for centimetres";
        return Err(MotionError::argument("metres_per_unit", metres_per_unit.to_string(), expected));
    }
    let text = text::read(path)?;
    let mut lines = text::lines(&text, None).peekable();
    let end = text::last_line(&text);
    let joints = hierarchy::parse(path, &mut lines, end)?;
    let (rate, rows) = motion(path, &mut lines, end, &joints)?;
    clip(path, &joints, &rows, rate, metres_per_unit)
}

/// One frame's values, with its line.
struct Row {
    line: usize,
    values: Vec<f64>,
}

/// The MOTION part: frames a second and the frames' values.
fn motion<'a>(
    file: &Path,
    lines: &mut impl Iterator<Item = Line<'a>>,
    end: usize,
    joints: &[Joint],
) -> Result<(f64, Vec<Row>), MotionError> {
    let mut next = |expected: &str| {
        lines.next().ok_or_else(|| MotionError::syntax(file, end, "the end of the file", expected.to_owned()))
    };
    let frames = next("Frames: and their number")?;
    let count = match frames.words[..] {
        ["Frames:", count] => count.parse::<usize>().ok().filter(|count| *count > 0),
        _ => None,
    };
    let Some(count) = count else {
        return Err(MotionError::syntax(file, frames.number, frames.words.join(" "), "Frames: and a positive number"));
    };
    let time = next("Frame Time: and seconds")?;
    let step = match time.words[..] {
        ["Frame", "Time:", step] => number(file, time.number, step)?,
        _ => 0.0,
    };
    if !(1e-6..=1e3).contains(&step) {
        return Err(MotionError::syntax(file, time.number, time.words.join(" "), "Frame Time: and seconds"));
    }
    let rate = 1.0 / step;
    let rate = if (rate - rate.round()).abs() < 1e-4 * rate { rate.round() } else { rate };
    let wanted: usize = joints.iter().map(|joint| joint.channels.len()).sum();
    let mut rows = Vec::new();
    for line in lines {
        if rows.len() == count {
            let expected = format!("the end of the file after {count} frames");
            return Err(MotionError::syntax(file, line.number, "one more line", expected));
        }
        if line.words.len() != wanted {
            let found = format!("{} values", line.words.len());
            return Err(MotionError::syntax(file, line.number, found, format!("{wanted}, one a channel")));
        }
        let values = line.words.iter().map(|word| number(file, line.number, word));
        rows.push(Row { line: line.number, values: values.collect::<Result<_, _>>()? });
    }
    if rows.len() < count {
        let expected = format!("{count}, as Frames: says");
        return Err(MotionError::syntax(file, end, format!("{} frames", rows.len()), expected));
    }
    Ok((rate, rows))
}

/// Place of one joint relative to its parent, file units and axes, and its rotation.
fn local(joint: &Joint, values: &[f64]) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let (mut place, mut rotation) = (joint.offset, UnitQuaternion::identity());
    for (channel, value) in joint.channels.iter().zip(values) {
        match channel {
            Channel::Position(axis) => place[axis.index()] = *value,
            Channel::Rotation(axis) => rotation *= axis.rotation(value.to_radians()),
        }
    }
    (place, rotation)
}

fn clip(file: &Path, joints: &[Joint], rows: &[Row], rate: f64, scale: f64) -> Result<Clip, MotionError> {
    let mut bones: Vec<Bone> = joints
        .iter()
        .map(|joint| Bone {
            name: joint.name.clone(),
            parent: joint.parent,
            origin: if joint.parent.is_some() { z_up(joint.offset) * scale } else { Vector3::zeros() },
            tip: Vector3::zeros(),
        })
        .collect();
    let mut frames = Vec::with_capacity(rows.len());
    for row in rows {
        let mut frame = Frame { root: Vector3::zeros(), rotations: Vec::with_capacity(joints.len()) };
        let mut rest = &row.values[..];
        for (joint, bone) in joints.iter().zip(&mut bones) {
            let (values, after) = rest.split_at(joint.channels.len());
            rest = after;
            let (place, rotation) = local(joint, values);
            let place = z_up(place) * scale;
            frame.rotations.push(rotation);
            if bone.parent.is_none() {
                frame.root = place;
            } else if frames.is_empty() {
                bone.origin = place;
            } else if (place - bone.origin).norm() > STILL {
                let found = format!("{} moves by {:.4} m against its parent", bone.name, (place - bone.origin).norm());
                let expected = "position channels that change on the root only, since bones have a fixed length";
                return Err(MotionError::syntax(file, row.line, found, expected));
            }
        }
        frames.push(frame);
    }
    set_tips(joints, &mut bones, scale);
    Ok(Clip { skeleton: Skeleton { bones }, rate, frames })
}

/// End Site, else the first child's origin.
fn set_tips(joints: &[Joint], bones: &mut [Bone], scale: f64) {
    let mut set = vec![false; bones.len()];
    for (i, joint) in joints.iter().enumerate() {
        if let Some(end) = joint.end {
            bones[i].tip = z_up(end) * scale;
            set[i] = true;
        }
    }
    for i in 0..bones.len() {
        if let Some(parent) = bones[i].parent.filter(|parent| !set[*parent]) {
            bones[parent].tip = bones[i].origin;
            set[parent] = true;
        }
    }
}

/// The error for a BVH that was asked for without its unit; it says how tall the figure is, so that the unit is
/// easily chosen.
pub(crate) fn unit_missing(path: &Path) -> MotionError {
    let expected = "metres in one unit: 0.01 for centimetres, 1 for metres, 0.056444 for CMU's conversions";
    match load_clip(path, 1.0) {
        Err(error) => error,
        Ok(clip) => {
            let zero = clip.skeleton.zero_poses();
            let ends = zero.origins.iter().copied();
            let tips = clip.skeleton.bones.iter().enumerate().map(|(i, bone)| zero.point(i, &bone.tip));
            let (low, high) = ends
                .chain(tips)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (p.z.min(low), p.z.max(high)));
            let found = format!("not given; the figure is {:.1} units tall in its zero pose", high - low);
            MotionError::content(path, "unit of length", found, expected)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "HIERARCHY
ROOT hip {
  OFFSET 1 2 3
  CHANNELS 3 Xrotation Yrotation Zrotation
  JOINT arm left
  {
    OFFSET 0 10 0
    CHANNELS 6 Zrotation Yrotation Xrotation Xposition Yposition Zposition
    End Site
    {
      OFFSET 0 0 5
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 0 0  0 0 90  0 20 0
90 0 0  0 0 90  0 20 0.01
";

    fn load(text: &str) -> Result<Clip, MotionError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("arm.bvh");
        std::fs::write(&path, text).unwrap();
        load_clip(&path, CENTIMETRE)
    }

    #[test]
    fn offsets_channels_and_ends() {
        let clip = load(ARM).unwrap();
        assert_eq!(clip.rate, 30.0);
        let [hip, arm] = &clip.skeleton.bones[..] else { panic!("two bones") };
        assert_eq!((hip.name.as_str(), arm.name.as_str()), ("hip", "arm left"));
        // Position channels replace the offset; the file's y is our z. The hip ends where the arm starts.
        let close = |a: Vector3<f64>, b: [f64; 3]| (a - Vector3::from(b)).norm() < 1e-12;
        assert!(close(arm.origin, [0.0, 0.0, 0.2]) && close(hip.tip, [0.0, 0.0, 0.2]));
        assert!(close(arm.tip, [0.05, 0.0, 0.0]));
        // A root without position channels stays at its offset.
        assert!(close(clip.frames[1].root, [0.03, 0.01, 0.02]));
        // Frame 0: the arm turns by 90 degrees about the file's x: its end, along z, goes to -y.
        let tip = |frame: usize| clip.poses(frame).point(1, &arm.tip);
        assert!(close(tip(0), [0.03, 0.01, 0.02 + 0.2 - 0.05]));
        // Frame 1: the hip turns likewise: the arm's start, along y, goes to z; its end then to -z.
        assert!(close(tip(1), [0.03 + 0.2 - 0.05, 0.01, 0.02]));
    }

    #[test]
    fn the_first_channel_is_the_outermost() {
        let text = ARM.replace("0 0 0  0 0 90", "90 90 0  0 0 0");
        let clip = load(&text).unwrap();
        // Rx(90) Ry(90) takes the file's z to x and x to x: our y.
        let got = clip.frames[0].rotations[0] * Vector3::x();
        assert!((got - Vector3::y()).norm() < 1e-12, "{got}");
    }

    #[test]
    fn joints_that_move_against_their_parent_are_refused() {
        let error = load(&ARM.replace("0 20 0.01", "0 21 0")).unwrap_err().to_string();
        assert!(error.contains(":19: arm left moves by 0.0100 m against its parent"), "{error}");
    }

    #[test]
    fn rates_that_are_not_whole_are_kept() {
        let rate = load(&ARM.replace("0.0333333", "0.0417083")).unwrap().rate;
        assert!((rate - 23.976).abs() < 1e-3, "{rate}");
    }
}
