//! Walking of legged robots (paper 4, sections III and IV-F): from senses to joint commands.
//!
//! - [`Walker`]: the whole, as a [`instep_robot::control::Controller`].
//! - [`StateEstimate`]: what walking knows of its robot, the seam between estimator and controller.
//! - [`gait`]: stands, starts ([`start`]), steps, stops; [`footsteps`] chooses where to, [`swing`] how, [`whole_body`] with which
//!   torques, by the quadratic program of [`instep_qp`].
//! - [`pattern`]: the walk of robots whose drives are position servos.
//! - [`ball`]: where a resting ball is, from sights of it on the way.
//! - [`plmk`]: when a kick is locked onto a step, and where it strikes; [`in_gait`] walks up and has it done.
//! - [`settings`]: all numbers, with defaults that follow from the robot's size.
//!
//! Maths only: no simulator, no clock, no camera, no field. A tick allocates nothing.

pub mod approach;
pub mod ball;
mod error;
pub mod estimate;
pub mod footsteps;
pub mod gait;
pub mod in_gait;
pub mod offsets;
pub mod pattern;
pub mod plmk;
pub mod settings;
pub mod start;
mod state;
pub mod swing;
mod walker;
pub mod whole_body;

pub use error::WalkError;
pub use gait::Gait;
pub use settings::{Velocity, WalkSettings};
pub use state::StateEstimate;
pub use walker::Walker;
