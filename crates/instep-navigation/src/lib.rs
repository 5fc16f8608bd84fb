//! How do I get there: visibility graphs that count turns and collision-free predictive control (paper 4, IV-D; Hou et al.,
//! arXiv 2504.02184).
//!
//! [`Navigator`] is the whole: a [`View`] and a [`Goal`] in, a [`Command`] out. Inside, [`davg`] finds the way, [`reference`]
//! puts it in time, [`nonlinear`] or [`linearised`] follow it by the [`model`] of the robot. [`scenario`] and [`trial`]
//! measure it on a [`PointRobot`] or on any other [`trial::Body`]. Knows no joints, no cameras and not why it goes there; opens no
//! file, reads no clock.

pub mod davg;
mod error;
pub mod linearised;
pub mod model;
mod navigator;
pub mod nonlinear;
mod obstacle;
mod point_robot;
pub mod polygon;
pub mod problem;
pub mod reference;
pub mod scenario;
mod settings;
pub mod trial;

pub use error::NavigationError;
pub use navigator::{Cause, Command, Goal, Navigator, Replaced, Status, Target, View};
pub use obstacle::Obstacle;
pub use point_robot::PointRobot;
pub use reference::Facing;
pub use settings::{Model, RobotLimits, Settings, Tracker};
