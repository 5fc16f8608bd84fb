//! Why a robot cannot walk, or its settings cannot be.

/// An error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WalkError {
    /// A settings file that cannot be read.
    #[error("{file}: cannot be read: {detail}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        detail: String,
    },
    /// A settings file that is not what it should be.
    #[error("{file}: {detail}")]
    Parse {
        /// The file.
        file: String,
        /// Line, column and cause.
        detail: String,
    },
    /// A setting with a value that cannot be.
    #[error("{file}: {field}: {found}; expected {expected}")]
    Setting {
        /// The file.
        file: String,
        /// The field's path, like `gait.step_time`.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A robot without something that walking needs.
    #[error("the robot \"{robot}\" cannot walk: {missing}; expected {expected}")]
    Robot {
        /// The robot.
        robot: String,
        /// What is missing.
        missing: String,
        /// What would be right.
        expected: String,
    },
}
