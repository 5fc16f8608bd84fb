//! What a person looks at: one-file HTML replays with plots, and MCAP recordings.
//!
//! This crate knows nothing about simulators, robots or kicks. It takes plain numbers:
//!
//! - a [`Report`] (summary, 3-D [`Replay`], [`Plot`]s, a [`Matrix`], [`Table`]s) becomes one HTML file that opens in any browser
//!   without a network and without third-party script;
//! - a [`mcap::Recording`] becomes an MCAP file of ROS 2 messages that Rerun, Foxglove, PlotJuggler and `rosbags` open.
//!
//! Lengths are metres, times are seconds from the start of the trial, angles are radians, z points up, and quaternions
//! are `[w, x, y, z]`. The same input gives the same bytes: no clock, no random number, no hash order.

mod color;
mod error;
mod file;
mod html;
mod matrix;
pub mod mcap;
mod picture;
mod plot;
mod replay;
mod report;

pub use color::Color;
pub use error::ReportError;
pub use matrix::{Matrix, MatrixCell, MatrixRow, Measure};
pub use picture::Picture;
pub use plot::{Axis, Limit, Plot, Region, Samples, Series};
pub use replay::{Actor, Arrow, ArrowFrame, Camera, Event, Finish, Marking, Part, Pitch, Pose, Replay, Shape};
pub use report::{Align, Cell, Column, Report, SummaryItem, Table, Verdict};
