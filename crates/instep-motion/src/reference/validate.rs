//! What a reference must hold before anybody follows it; the first fault is told with the field's path.

use super::{Knot, Reference};
use crate::MotionError;

/// How far the norm of an orientation may be from 1: what six printed digits leave.
const UNIT: f64 = 1e-5;

fn wrong(field: impl Into<String>, found: impl ToString, expected: impl Into<String>) -> MotionError {
    MotionError::argument(field, found.to_string(), expected)
}

/// All numbers of a field are finite.
fn finite<'a>(field: impl Fn() -> String, values: impl IntoIterator<Item = &'a f64>) -> Result<(), MotionError> {
    match values.into_iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((i, value)) => Err(wrong(format!("{}[{i}]", field()), value, "a finite number")),
        None => Ok(()),
    }
}

impl Reference {
    /// Checks the layout's version, rate, phases, names and every knot: lengths, finite numbers, unit orientations.
    ///
    /// # Errors
    ///
    /// [`MotionError::Argument`] with the path of the first field that is wrong, such as `knots[3].joints[2]`.
    pub fn validate(&self) -> Result<(), MotionError> {
        if self.format != Self::FORMAT {
            return Err(wrong("format", self.format, format!("{}, the one this version knows", Self::FORMAT)));
        }
        if !(self.rate.is_finite() && self.rate > 0.0) {
            return Err(wrong("rate", self.rate, "knots a second, positive"));
        }
        finite(|| "ball".to_owned(), &self.ball)?;
        finite(|| "source.clip_start".to_owned(), [&self.source.clip_start])?;
        self.phases.validate()?;
        for (field, names) in [("joint_names", &self.joint_names), ("contact_names", &self.contact_names)] {
            if let Some(i) = (0..names.len()).find(|i| names[*i].is_empty() || names[..*i].contains(&names[*i])) {
                return Err(wrong(format!("{field}[{i}]"), format!("{:?}", names[i]), "a name of its own"));
            }
        }
        if self.knots.len() < 2 {
            return Err(wrong("knots", self.knots.len(), "two at least"));
        }
        self.knots.iter().enumerate().try_for_each(|(i, knot)| self.validate_knot(i, knot))
    }

    fn validate_knot(&self, i: usize, knot: &Knot) -> Result<(), MotionError> {
        let field = |name: &str| format!("knots[{i}].{name}");
        let (joints, contacts) = (self.joint_names.len(), self.contact_names.len());
        let lengths = [
            ("joints", knot.joints.len(), joints, false),
            ("joint_velocities", knot.joint_velocities.len(), joints, false),
            ("contacts", knot.contacts.len(), contacts, false),
            ("forces", knot.forces.len(), contacts, true),
            ("torques", knot.torques.len(), joints, true),
        ];
        for (name, found, expected, may_be_empty) in lengths {
            if found != expected && !(may_be_empty && found == 0) {
                let or = if may_be_empty { " or none" } else { "" };
                return Err(wrong(field(name), format!("{found} values"), format!("{expected}{or}")));
            }
        }
        // Between knots of which only one has forces or torques there is nothing to interpolate.
        for (name, found, first) in [
            ("forces", knot.forces.len(), self.knots[0].forces.len()),
            ("torques", knot.torques.len(), self.knots[0].torques.len()),
        ] {
            if found != first {
                return Err(wrong(field(name), format!("{found} values"), format!("{first}, as in the first knot")));
            }
        }
        let numbers: [(&str, &[f64]); 9] = [
            ("base_position", &knot.base_position),
            ("base_orientation", &knot.base_orientation),
            ("base_velocity", &knot.base_velocity),
            ("base_angular_velocity", &knot.base_angular_velocity),
            ("joints", &knot.joints),
            ("joint_velocities", &knot.joint_velocities),
            ("torques", &knot.torques),
            ("com", &knot.com),
            ("momentum", &knot.momentum),
        ];
        for (name, values) in numbers {
            finite(|| field(name), values)?;
        }
        for (j, force) in knot.forces.iter().enumerate() {
            finite(|| field(&format!("forces[{j}]")), force)?;
        }
        let norm = knot.base_orientation.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(1.0 - UNIT..=1.0 + UNIT).contains(&norm) {
            return Err(wrong(field("base_orientation"), format!("norm {norm}"), "norm 1"));
        }
        Ok(())
    }
}
