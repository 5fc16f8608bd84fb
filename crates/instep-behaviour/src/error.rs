//! What can be wrong with a strategy, a table of kicks or a situation that is handed in.

use std::path::Path;

/// Something handed in that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BehaviourError {
    /// A file cannot be read, or does not hold what it should.
    #[error("{file}: {detail}")]
    File {
        /// The file.
        file: String,
        /// What the system or the reader said, with the line where there is one.
        detail: String,
    },
    /// A number that cannot be.
    #[error("{file}: {field}: {found}; expected {expected}")]
    Value {
        /// The file.
        file: String,
        /// The path of the value in the file.
        field: String,
        /// What is there.
        found: String,
        /// What would be right.
        expected: String,
    },
}

impl BehaviourError {
    pub(crate) fn file(path: &Path, detail: impl std::fmt::Display) -> Self {
        Self::File { file: path.display().to_string(), detail: detail.to_string().trim_end().to_owned() }
    }
}

/// Reads a whole text file.
pub(crate) fn read(path: &Path) -> Result<String, BehaviourError> {
    std::fs::read_to_string(path).map_err(|e| BehaviourError::file(path, e))
}

/// Whether `found` is a number from `low` to `high`; `file` and `field` say where it stands.
pub(crate) fn within(file: &str, field: &str, found: f64, low: f64, high: f64) -> Result<(), BehaviourError> {
    if found >= low && found <= high {
        return Ok(());
    }
    Err(BehaviourError::Value {
        file: file.to_owned(),
        field: field.to_owned(),
        found: found.to_string(),
        expected: format!("a number from {low} to {high}"),
    })
}
