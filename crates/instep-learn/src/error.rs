//! What can go wrong while learning.

use std::path::PathBuf;

use instep_kick::KickError;
use instep_sim::SimError;

/// An error of this crate.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// A setting that cannot be.
    #[error("{field}: {found}; expected {expected}")]
    Setting {
        /// The field's path, like `ppo.gamma`.
        field: String,
        /// Its value.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A file that cannot be read, or is not what it should be.
    #[error("{}: {detail}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        detail: String,
    },
    /// Something that is not a number where training needs one. Nothing was learned from it.
    #[error(
        "training stopped at {steps} steps: {what} is {value}; the last checkpoint is good, go on from it with other settings"
    )]
    NotFinite {
        /// What it is.
        what: String,
        /// Its value.
        value: f64,
        /// Steps until then.
        steps: u64,
    },
    /// Reference, policy and robot do not fit.
    #[error(transparent)]
    Kick(#[from] KickError),
    /// The world.
    #[error(transparent)]
    Sim(#[from] SimError),
}

impl LearnError {
    pub(crate) fn file(file: &std::path::Path, detail: impl ToString) -> Self {
        Self::File { file: file.to_owned(), detail: detail.to_string() }
    }
}
