//! What can prevent a trial from being run at all. How a kick went is never an error: see [`crate::trial::Trial`].

use instep_robot::RobotError;

/// A world or trial that cannot be set up or went numerically wrong.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// The robot's model could not be read again for the world.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A setting has a value that cannot be.
    #[error("{field}: {found}; expected {expected}")]
    Setting {
        /// Path of the field, like `ball.mass`.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// MuJoCo refused the world that was built around the robot.
    #[error("MuJoCo cannot use the world built around {robot}: {detail}")]
    World {
        /// The robot's name.
        robot: String,
        /// MuJoCo's message.
        detail: String,
    },
    /// A robot cannot stand where it is to start.
    #[error("robot {robot} ({name}): {found}; expected {expected}")]
    Place {
        /// Which, from 0, in the order in which they enter.
        robot: usize,
        /// Its name.
        name: String,
        /// Where it would stand.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// The start state does not fit the robot.
    #[error("start state: {found}; expected {expected}")]
    State {
        /// What was given.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A command or the physics went to infinity or became no number.
    #[error("the simulation diverged at {time:.3} s: {what} is not a finite number")]
    Diverged {
        /// When, in the trial's time, s.
        time: f64,
        /// What was not finite.
        what: &'static str,
    },
}
