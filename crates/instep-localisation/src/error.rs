//! What can be wrong with what is handed to a localiser. Being lost is not an error: see [`crate::Status`].

use std::path::Path;

/// Input that cannot be used. Whatever was refused has changed nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LocalisationError {
    /// A map with nothing to see on it.
    #[error("field {field}: no landmarks; expected at least two, or nothing can be localised on it")]
    NoLandmarks {
        /// The field's name.
        field: String,
    },
    /// A number that cannot be.
    #[error("{place}: {found}; expected {expected}")]
    Value {
        /// Where: the sight, line or step, with its time.
        place: String,
        /// What is there.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// Time that runs backwards.
    #[error("{place}: time {found} s comes after {before} s; expected times that do not fall")]
    Backwards {
        /// Which input.
        place: &'static str,
        /// Its time, s.
        found: f64,
        /// The time that came before, s.
        before: f64,
    },
    /// A sight so old that the odometry of its moment is no longer kept.
    #[error("frame of {found} s: older than the odometry that is kept (from {kept} s)")]
    TooOld {
        /// The frame's time, s.
        found: f64,
        /// The oldest odometry, s.
        kept: f64,
    },
    /// A file cannot be read, or is not what it should be.
    #[error("{file}: {detail}")]
    File {
        /// The file.
        file: String,
        /// What the system or the reader said, with the line where there is one.
        detail: String,
    },
    /// No scenario of that name.
    #[error("no scenario is called \"{name}\"; expected one of {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
}

impl LocalisationError {
    pub(crate) fn file(path: &Path, detail: impl std::fmt::Display) -> Self {
        Self::File { file: path.display().to_string(), detail: detail.to_string() }
    }
}
