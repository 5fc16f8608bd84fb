//! From a human clip to a reference that a robot can follow: the offline half of paper 1 (section II-A).
//!
//! 1. [`rescale`]: the human's landmarks with the robot's link lengths, in the kick's own world frame.
//! 2. [`kinematic`]: inverse kinematics over the whole clip, with joint limits, smooth in time, with the stance feet
//!    standing still or with the clip's own foot slip.
//! 3. [`kinodynamic`]: the nearest motion that the robot's dynamics, motors and contacts allow, with the foot as fast as
//!    they let it, checked by full inverse dynamics.
//!
//! The mathematics open no file and read no clock; progress is told to a callback.

mod assemble;
pub mod banded;
mod error;
mod ik;
pub mod kinematic;
pub mod kinodynamic;
pub mod rescale;
mod settle;
mod stance;

pub use error::RetargetError;
