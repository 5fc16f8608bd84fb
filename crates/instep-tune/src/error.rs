//! What can prevent a tuning. How a kick went is never an error.

use std::path::Path;

/// A tuning that cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum TuneError {
    /// A file cannot be read or written, or is not what it should be.
    #[error("{file}: {detail}")]
    File {
        /// The file.
        file: String,
        /// What the system or the reader said.
        detail: String,
    },
    /// A field of the tuning file has a value that cannot be.
    #[error("{file}: {field}: {found}; expected {expected}")]
    Field {
        /// The file.
        file: String,
        /// The field's path.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// No sample of a generation has an objective that is a number.
    #[error("the objective is not a number for any of the {samples} samples of generation {generation}: {causes}")]
    NoObjective {
        /// How many samples.
        samples: usize,
        /// Which generation, counted from 1.
        generation: usize,
        /// What came of the kicks instead.
        causes: String,
    },
    /// The benchmark refused.
    #[error(transparent)]
    Bench(#[from] instep_bench::BenchError),
}

impl TuneError {
    pub(crate) fn file(path: &Path, detail: impl std::fmt::Display) -> Self {
        Self::File { file: path.display().to_string(), detail: detail.to_string() }
    }
}
