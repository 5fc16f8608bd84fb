//! What can go wrong when a report or a recording is made.

use std::path::PathBuf;

/// Why a report or a recording could not be made. Nothing half-written is left behind.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file asked for.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Two parts of the report contradict each other: `place` says where, `wrong` what, `wanted` what would be right.
    #[error("{place}: {wrong}; wanted {wanted}")]
    Inconsistent {
        /// Which part of the report, such as `replay.actors[0] "Prestoe"`.
        place: String,
        /// What was found.
        wrong: String,
        /// What would be right.
        wanted: String,
    },
    /// A time that a recording cannot hold: ROS stamps count signed 32-bit seconds, and a trial starts at 0.
    #[error("{topic}: time {time} s cannot be recorded; wanted a finite time from 0 to 2147483647 s")]
    Time {
        /// The topic of the message.
        topic: &'static str,
        /// The time that was given, seconds.
        time: f64,
    },
    /// A message could not be turned into CDR.
    #[error("{topic}: message cannot be encoded: {source}")]
    Encode {
        /// The topic of the message.
        topic: &'static str,
        /// What the encoder said.
        source: cdr_encoding::Error,
    },
    /// The MCAP writer refused.
    #[error("recording: {0}")]
    Mcap(#[from] mcap::McapError),
}
