//! What can be wrong with a field that is handed in.

use std::path::Path;

/// A field that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// A file cannot be read, or is not a field.
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
        /// The file, or the name of the field where there is no file.
        file: String,
        /// The path of the value in the file.
        field: String,
        /// What is there.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// No field of that name is known.
    #[error("no field is called \"{name}\"; expected one of {known}, or the path of a TOML file")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
}

impl FieldError {
    pub(crate) fn file(path: &Path, detail: impl std::fmt::Display) -> Self {
        Self::File { file: path.display().to_string(), detail: detail.to_string().trim_end().to_owned() }
    }
}
