//! What can go wrong with a file of motion, said so that its owner can mend it.

use std::path::{Path, PathBuf};

use crate::phase::Side;

/// A file that could not be read, understood or written, or a motion that cannot be used. Each variant about a
/// file names the file and the place in it; the others name the quantity, what it is and what would be right.
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
    /// A value handed to a function of this crate cannot be used.
    #[error("{name}: {found}; expected {expected}")]
    Argument {
        /// The argument or the setting, with its path.
        name: String,
        /// What was handed in.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A skeleton has no bone for some of the landmarks.
    #[error("the skeleton has no bone for {}; its names are closest to {set}, where these would be {}",
        missing.join(", "), wanted.join(", "))]
    Landmarks {
        /// The landmarks without a bone.
        missing: Vec<String>,
        /// The naming convention that fits best.
        set: String,
        /// The bone names that were looked for, one entry a missing landmark.
        wanted: Vec<String>,
    },
    /// The clip holds no motion that stands out as a kick.
    #[error("no kick: the {side} foot is fastest with {speed:.2} m/s at {time:.2} s, {reason}; a kick has {expected}")]
    NoKick {
        /// The foot that is fastest.
        side: Side,
        /// Its greatest speed, m/s.
        speed: f64,
        /// When that is, s.
        time: f64,
        /// Why that is no kick.
        reason: String,
        /// What a kick has instead.
        expected: String,
    },
    /// The support foot does not stand on the ground when the other one kicks.
    #[error(
        "no stance: the {side} foot does not stand at the kick, {time:.2} s: it is {height:.3} m above the ground \
         with {speed:.2} m/s; expected a stance that begins before the kick"
    )]
    NoStance {
        /// The support foot.
        side: Side,
        /// The instant of the kick, s.
        time: f64,
        /// The lowest sole point's height above the ground, m.
        height: f64,
        /// The slowest sole point's speed, m/s.
        speed: f64,
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

    /// The argument or setting `name` is `found`, not `expected`.
    pub(crate) fn argument(name: impl Into<String>, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Argument { name: name.into(), found: found.into(), expected: expected.into() }
    }
}
