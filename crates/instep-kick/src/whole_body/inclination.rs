//! The body-inclination stabiliser of paper 3, section 2.3: the trunk leans against the difference between the centre of
//! mass, computed from the sensors, and where it should be (proportional control).
//!
//! The paper holds the hip where the legs put it and leans the trunk; here the wanted centre of mass is shifted by the
//! output and the trunk leans with it, which inverse kinematics turns into the same motion.

use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::settings::within;
use instep_robot::ik::Goals;

/// Numbers of the body-inclination stabiliser.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inclination {
    /// Shift of the wanted centre of mass, in m, a metre of error.
    pub gain: f64,
    /// Largest shift, m.
    pub limit: f64,
    /// How much the trunk leans a metre of that shift, rad/m.
    pub lean: f64,
    /// Time constant of the low-pass on the error, s.
    pub filter: f64,
}

impl Inclination {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        within("inclination.gain", self.gain, 0.0, 10.0)?;
        within("inclination.limit", self.limit, 0.0, 0.2)?;
        within("inclination.lean", self.lean, 0.0, 50.0)?;
        within("inclination.filter", self.filter, 0.0, 1.0)
    }
}

/// State of the stabiliser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lean {
    settings: Inclination,
    /// The error after the low-pass, m.
    error: [f64; 2],
}

impl Lean {
    pub(crate) fn new(settings: Inclination) -> Self {
        Self { settings, error: [0.0; 2] }
    }

    /// The same without memory.
    pub(crate) fn fresh(&self) -> Self {
        Self::new(self.settings)
    }

    /// Moves the goals against the error of the measured centre of mass (m, support sole's frame); without one the output
    /// fades.
    pub(crate) fn apply(&mut self, measured: Option<[f64; 2]>, goals: &mut Goals, dt: f64) {
        let s = &self.settings;
        let share = dt / (s.filter + dt);
        let wanted = goals.balance;
        let mut shift = [0.0; 2];
        for k in 0..2 {
            let error = measured.map_or(0.0, |at| at[k] - wanted[k]);
            self.error[k] += share * (error - self.error[k]);
            shift[k] = (-s.gain * self.error[k]).clamp(-s.limit, s.limit);
            goals.balance[k] += shift[k];
        }
        goals.base[0] -= s.lean * shift[1];
        goals.base[1] += s.lean * shift[0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_centre_of_mass_too_far_forward_leans_the_trunk_back() {
        let mut lean = Lean::new(Inclination { gain: 0.5, limit: 0.02, lean: 5.0, filter: 0.0 });
        let upright =
            Goals { position: Vector3::zeros(), yaw_pitch: [0.0; 2], balance: [0.0; 2], height: 0.3, base: [0.0; 3] };
        let mut goals = upright;
        lean.apply(Some([0.02, 0.0]), &mut goals, 0.01);
        assert!((goals.balance[0] + 0.01).abs() < 1e-12 && (goals.base[1] + 0.05).abs() < 1e-12);
        assert!(goals.base[0].abs() < 1e-12 && goals.balance[1].abs() < 1e-12);
        // To the left: roll is positive toward the right, so the trunk leans by a positive roll.
        let mut goals = upright;
        lean.fresh().apply(Some([0.0, 1.0]), &mut goals, 0.01);
        assert!((goals.balance[1] + 0.02).abs() < 1e-12 && goals.base[0] > 0.0);
    }
}
