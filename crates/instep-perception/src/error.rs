//! What can be wrong with what seeing is given.

use std::path::Path;

/// An image, a label, a model, a camera or a depth map that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PerceptionError {
    /// A file cannot be read or written, or does not hold what it should.
    #[error("{file}: {detail}")]
    File {
        /// The file.
        file: String,
        /// What is wrong in it, with the line or key where there is one, and what would be right.
        detail: String,
    },
    /// A number that cannot be.
    #[error("{field}: {found}; expected {expected}")]
    Value {
        /// The path of the value.
        field: String,
        /// What is there.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// An image of another size than the network's or the camera's.
    #[error("image of {found_width} x {found_height} pixels; expected {width} x {height}")]
    Size {
        /// Found, pixels.
        found_width: usize,
        /// Found, pixels.
        found_height: usize,
        /// Expected, pixels.
        width: usize,
        /// Expected, pixels.
        height: usize,
    },
}

impl PerceptionError {
    /// About a file.
    pub fn file(path: &Path, detail: impl std::fmt::Display) -> Self {
        Self::File { file: path.display().to_string(), detail: detail.to_string().trim_end().to_owned() }
    }
}
