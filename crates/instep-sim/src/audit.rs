//! Whether a ball speed may be believed.
//!
//! A simulated contact can give a ball more energy than the foot had. Three tests (facts/physics-of-the-kick.md):
//! kinetic energy may not grow across the impact by more than the work of motors and gravity; the effective
//! restitution may not pass 0.85; and a re-run from just before the impact at a tenth of the time step may change the
//! ball's speed by 2 % at most. A kick that fails one is reported as invalid.

use serde::Serialize;

use crate::impact::Impact;

/// Largest effective restitution that is believed.
pub const MAX_RESTITUTION: f64 = 0.85;
/// Largest relative change of the ball's speed in the re-run.
pub const MAX_STEP_ERROR: f64 = 0.02;
/// Energy that may appear from nowhere, as a share of the kinetic energy before: the integration error.
pub const MAX_ENERGY_GAIN: f64 = 0.01;

/// Why a ball speed is not believed.
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case", tag = "fault")]
pub enum Fault {
    /// The robot did not touch the ball.
    #[error("the robot did not touch the ball")]
    NoImpact,
    /// The trial ended before the impact did.
    #[error("the trial ended while the ball was still in contact")]
    Unfinished,
    /// Energy appeared from nowhere.
    #[error("kinetic energy grew by {gain:.3} J more than motors and gravity gave (at most {limit:.3} J)")]
    Energy {
        /// Energy from nowhere, J.
        gain: f64,
        /// What is tolerated, J.
        limit: f64,
    },
    /// The ball left faster than a real ball could.
    #[error("effective restitution {restitution:.3} is above {MAX_RESTITUTION}")]
    Restitution {
        /// Effective restitution.
        restitution: f64,
    },
    /// The result depends on the time step.
    #[error("the ball leaves at {coarse:.3} m/s, but at {fine:.3} m/s with a tenth of the step (more than 2 % apart)")]
    StepSize {
        /// Ball speed as reported, m/s.
        coarse: f64,
        /// Ball speed in the re-run, m/s; 0 when the re-run missed the ball.
        fine: f64,
    },
}

/// The audit of one kick.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Audit {
    /// Everything that speaks against the kick; empty for a valid one.
    pub faults: Vec<Fault>,
    /// Kinetic energy gained across the impact beyond the work of motors and gravity, J; negative is lost.
    pub energy_gain: Option<f64>,
    /// Ball speed of the re-run at a tenth of the step, m/s.
    pub rerun_ball_speed: Option<f64>,
}

impl Audit {
    /// Judges `impact` beside the same impact re-run at a tenth of the step.
    #[must_use]
    pub fn new(impact: Option<&Impact>, rerun: Option<&Impact>, finished: bool) -> Self {
        let Some(impact) = impact else {
            return Self { faults: vec![Fault::NoImpact], energy_gain: None, rerun_ball_speed: None };
        };
        let mut faults = Vec::new();
        if !finished {
            faults.push(Fault::Unfinished);
        }
        let gain = impact.kinetic_after - impact.kinetic_before - impact.motor_work - impact.gravity_work;
        let limit = MAX_ENERGY_GAIN * impact.kinetic_before;
        // Written so that a NaN fails.
        if !matches!(gain.partial_cmp(&limit), Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal)) {
            faults.push(Fault::Energy { gain, limit });
        }
        if !matches!(impact.restitution.partial_cmp(&MAX_RESTITUTION), Some(o) if o.is_le()) {
            faults.push(Fault::Restitution { restitution: impact.restitution });
        }
        let (coarse, fine) = (impact.ball_speed(), rerun.map_or(0.0, Impact::ball_speed));
        if !matches!(((coarse - fine).abs() / coarse).partial_cmp(&MAX_STEP_ERROR), Some(o) if o.is_le()) {
            faults.push(Fault::StepSize { coarse, fine });
        }
        Self { faults, energy_gain: Some(gain), rerun_ball_speed: rerun.map(Impact::ball_speed) }
    }

    /// "valid" or "invalid".
    #[must_use]
    pub fn verdict(&self) -> &'static str {
        if self.faults.is_empty() { "valid" } else { "invalid" }
    }

    /// What speaks against the kick, in words; empty for a valid one.
    #[must_use]
    pub fn reason(&self) -> String {
        self.faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    }
}
