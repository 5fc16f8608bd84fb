//! What can be wrong with a robot's files, said so that its owner can mend it.

use std::path::PathBuf;

/// A robot that could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// A file is missing or cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// `robot.toml` is not TOML, or has a field that is missing, unknown or of another type.
    #[error("{}: {detail}", file.display())]
    Settings {
        /// The file.
        file: PathBuf,
        /// Line, column and cause, as the TOML reader tells them.
        detail: String,
    },
    /// A field of `robot.toml` has a value that cannot be.
    #[error("{}: {field}: {found}; expected {expected}", file.display())]
    Field {
        /// The file.
        file: PathBuf,
        /// The field's path, like `leg.left.knee`.
        field: String,
        /// What it says.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// MuJoCo refused the model.
    #[error("{}: MuJoCo cannot use this model: {detail}", file.display())]
    Model {
        /// The model file.
        file: PathBuf,
        /// MuJoCo's message.
        detail: String,
    },
    /// The model is valid, but not a robot that can kick.
    #[error("{}: {found}; expected {expected}", file.display())]
    Structure {
        /// The model file.
        file: PathBuf,
        /// What the model has.
        found: String,
        /// What would be right.
        expected: String,
    },
}
