//! Why a clip could not be retargeted at all. A reference that misses a bar is a result, not an error.

use instep_motion::MotionError;

/// A clip, a robot or settings that retargeting cannot start from.
#[derive(Debug, thiserror::Error)]
pub enum RetargetError {
    /// The clip has no kick, no stance, or a skeleton whose bones are not known.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The robot's file does not say where a landmark lies.
    #[error(
        "robot \"{robot}\": landmark.{landmark} is missing in its robot.toml; expected the link and point that follow it"
    )]
    Landmark {
        /// The robot.
        robot: String,
        /// The landmark.
        landmark: String,
    },
    /// A setting cannot be.
    #[error("{field}: {found}; expected {expected}")]
    Setting {
        /// The field.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// The solver's linear system could not be factored: the problem holds something that is not a number.
    #[error("the kinematic stage broke down in iteration {iteration}: {what}")]
    Breakdown {
        /// Iteration, counted from 1.
        iteration: usize,
        /// What was found.
        what: &'static str,
    },
}
