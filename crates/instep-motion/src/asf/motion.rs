//! The AMC file: one line a bone and frame.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};

use super::skeleton::{Joint, Rig, RootValue, angle_unit};
use crate::MotionError;
use crate::clip::Frame;
use crate::text::{FileAxis, Line, last_line, lines, number, z_up};

/// A frame while its lines come in.
struct Open {
    number: u64,
    frame: Frame,
    /// Which bones have had their line.
    seen: Vec<bool>,
}

/// Parses the text of the AMC file `file`, made for `rig`.
pub(super) fn parse(file: &Path, text: &str, rig: &Rig, rate: f64) -> Result<Vec<Frame>, MotionError> {
    let names: HashMap<&str, usize> =
        rig.skeleton.bones.iter().enumerate().map(|(i, bone)| (bone.name.as_str(), i)).collect();
    let mut radians = rig.radians;
    let mut frames = Vec::new();
    let mut open: Option<Open> = None;
    for line in lines(text, Some('#')) {
        let wrong = |found: String, expected: String| MotionError::syntax(file, line.number, found, expected);
        let word = line.words[0];
        if let Some(keyword) = word.strip_prefix(':') {
            if let Some(unit) = angle_unit(keyword) {
                radians = unit;
            } else if keyword.eq_ignore_ascii_case("samples-per-second") {
                let stated = number(file, line.number, line.words.get(1).copied().unwrap_or_default())?;
                if (stated - rate).abs() > 1e-6 * rate {
                    return Err(wrong(format!("{stated} frames a second"), format!("{rate}, as asked for")));
                }
            }
            continue;
        }
        if let (Ok(number), 1) = (word.parse::<u64>(), line.words.len()) {
            if let Some(done) = open.take() {
                if number != done.number.wrapping_add(1) {
                    return Err(wrong(format!("frame {number} after {}", done.number), "the next number".to_owned()));
                }
                frames.push(done.close(file, line.number, rig)?);
            }
            open = Some(Open::new(number, rig));
            continue;
        }
        let Some(open) = open.as_mut() else {
            return Err(wrong(format!("{word:?} before the first frame"), "the number of a frame".to_owned()));
        };
        let Some(&bone) = names.get(word) else {
            return Err(wrong(format!("{word:?}"), "a bone of the skeleton or the number of a frame".to_owned()));
        };
        if std::mem::replace(&mut open.seen[bone], true) {
            return Err(wrong(format!("{word} twice in frame {}", open.number), "each bone once".to_owned()));
        }
        open.take(file, &line, rig, bone, radians)?;
    }
    let end = last_line(text);
    let Some(last) = open else {
        return Err(MotionError::syntax(file, end, "no frames", "the number of a frame and a line for each bone"));
    };
    frames.push(last.close(file, end, rig)?);
    Ok(frames)
}

impl Open {
    fn new(number: u64, rig: &Rig) -> Self {
        let count = rig.joints.len();
        let frame = Frame { root: rig.root_position, rotations: vec![UnitQuaternion::identity(); count] };
        Self { number, frame, seen: vec![false; count] }
    }

    /// Takes the line of bone `bone`.
    fn take(&mut self, file: &Path, line: &Line<'_>, rig: &Rig, bone: usize, radians: f64) -> Result<(), MotionError> {
        let joint = &rig.joints[bone];
        let wanted = if bone == 0 { rig.root_order.len() } else { joint.dofs.len() };
        let given = &line.words[1..];
        if given.len() != wanted {
            let expected = format!("{wanted}, as the skeleton says");
            return Err(MotionError::syntax(file, line.number, format!("{} values", given.len()), expected));
        }
        let (mut shift, mut angles) = (Vector3::zeros(), Vector3::zeros());
        for (i, word) in given.iter().enumerate() {
            let value = number(file, line.number, word)?;
            let target = if bone == 0 { rig.root_order[i] } else { RootValue::Rotation(joint.dofs[i]) };
            match target {
                RootValue::Translation(axis) => shift[axis.index()] = value,
                RootValue::Rotation(axis) => angles[axis.index()] = value * radians,
            }
        }
        if bone == 0 {
            self.frame.root += z_up(shift) * rig.metres;
        }
        self.frame.rotations[bone] = joint.rotation(angles);
        Ok(())
    }

    /// The frame, if every bone that can move has had its line; `line` is where it ends.
    fn close(self, file: &Path, line: usize, rig: &Rig) -> Result<Frame, MotionError> {
        let missing = (0..self.seen.len()).find(|&i| !self.seen[i] && (i == 0 || !rig.joints[i].dofs.is_empty()));
        match missing {
            None => Ok(self.frame),
            Some(i) => {
                let found = format!("frame {} ends without {}", self.number, rig.skeleton.bones[i].name);
                Err(MotionError::syntax(file, line, found, "a line for each bone with degrees of freedom"))
            }
        }
    }
}

impl Joint {
    /// `C R C^-1`, `R` applied in the order of the degrees of freedom.
    fn rotation(&self, angles: Vector3<f64>) -> UnitQuaternion<f64> {
        let r = self
            .dofs
            .iter()
            .fold(UnitQuaternion::identity(), |r, axis: &FileAxis| axis.rotation(angles[axis.index()]) * r);
        self.axis * r * self.axis.inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::super::skeleton;
    use super::*;

    const RIG: &str = "\
:units
  length 1
  angle deg
:root
  order RX TY TX TZ RY RZ
  axis XYZ
  position 0 10 0
  orientation 0 0 0
:bonedata
  begin
    name arm
    direction 0 1 0
    length 10
    axis 0 90 0 XYZ
    dof rx
  end
:hierarchy
  begin
    root arm
  end
";

    fn frames(amc: &str) -> Result<Vec<Frame>, MotionError> {
        let rig = skeleton::parse(Path::new("a.asf"), RIG).unwrap();
        parse(Path::new("a.amc"), amc, &rig, 120.0)
    }

    #[test]
    fn root_values_in_any_order_and_inches() {
        let frame = &frames("1\nroot 90 1 2 3 0 90\narm 0\n").unwrap()[0];
        // Inches: file x 2, y 10 + 1, z 3.
        assert!((frame.root - Vector3::new(3.0, 2.0, 11.0) * 0.0254).norm() < 1e-12);
        // Rz(90) Rx(90): the file's y goes to z, z stays z: our z goes to x.
        assert!((frame.rotations[0] * Vector3::z() - Vector3::x()).norm() < 1e-12);
    }

    #[test]
    fn a_bone_turns_about_its_own_axis_in_degrees_or_radians() {
        // The axis turned by 90 degrees about y takes x to -z: the bone turns about the file's -z, y goes to x.
        let expected = Vector3::y();
        let half_turn = std::f64::consts::FRAC_PI_2;
        for text in ["1\nroot 0 0 0 0 0 0\narm 90\n", &format!(":RADIANS\n1\nroot 0 0 0 0 0 0\narm {half_turn}\n")] {
            let got = frames(text).unwrap()[0].rotations[1] * Vector3::z();
            assert!((got - expected).norm() < 1e-12, "{got}");
        }
    }

    #[test]
    fn frames_that_lack_a_bone_or_repeat_one_are_refused() {
        let say = |text: &str| frames(text).unwrap_err().to_string();
        assert!(say("1\nroot 0 0 0 0 0 0\n2\n").contains("a.amc:3: frame 1 ends without arm"));
        assert!(say("1\narm 0\narm 0\n").contains("a.amc:3: arm twice in frame 1"));
        assert!(say("arm 0\n").contains("a.amc:1: \"arm\" before the first frame"));
        assert!(say(":DEGREES\n").contains("a.amc:1: no frames"));
        assert!(say(":SAMPLES-PER-SECOND 60\n").contains("60 frames a second; expected 120"));
    }
}
