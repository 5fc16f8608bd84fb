//! What can go wrong with a file of motion, said so that its owner can mend it.

use std::path::{Path, PathBuf};

/// A file that could not be read, understood or written. Each variant names the file and the place in it.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// The file could not be opened or read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file or its folder could not be written.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A line of a text file is not what the format asks for.
    #[error("{}:{line}: {found}; expected {expected}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line number, counted from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// The file can be parsed, but what it says cannot be used.
    #[error("{}: {field}: {found}; expected {expected}", file.display())]
    Content {
        /// The file.
        file: PathBuf,
        /// The field, bone or frame.
        field: String,
        /// What it holds.
        found: String,
        /// What would be right.
        expected: String,
    },
}

impl MotionError {
    /// The line `line` of `file` is `found`, not `expected`.
    pub(crate) fn syntax(file: &Path, line: usize, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Syntax { file: file.to_owned(), line, found: found.into(), expected: expected.into() }
    }

    /// The field `field` of `file` holds `found`, not `expected`.
    pub(crate) fn content(
        file: &Path,
        field: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Content { file: file.to_owned(), field: field.into(), found: found.into(), expected: expected.into() }
    }
}
