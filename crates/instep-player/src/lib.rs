//! A whole player: senses in, joint commands and messages out (paper 4's robot without its world).
//!
//! [`Player`] is everything on a robot: where am I, where are ball and others, what to do, how to get there, how to walk and
//! kick, where to look; each at its own rate, on the caller's thread, deterministically. It is ticked at the period of the
//! robot's drives with [`Senses`] and gives an [`Output`]. Whoever runs it is an adapter: the physics match, ROS, a simulation
//! league's server. It knows none of them, opens no file but in `load` functions, reads no clock and draws no random number.
//!
//! - [`place`]: the pose on the field, from odometry, landmarks and what a league tells.
//! - [`legs`]: stands, walks with a velocity, kicks within the gait, lies on the ground.
//! - [`push`]: the ball played with the walk itself, for robots without a kick.
//! - `lane`: the room that a kicking body needs between opponents.
//! - [`neck`]: which angles of the neck look where the decision wants to look.
//! - [`guard`]: which senses may be believed at all.
//!
//! Frames: the field frame of the own team (origin at the centre mark, x toward the goal that it attacks, y left) and the
//! robot frame (the base's ground projection, x ahead, y left). m, s, rad.

mod error;
pub mod guard;
mod lane;
pub mod legs;
mod message;
pub mod neck;
pub mod place;
mod player;
pub mod push;
mod record;
mod senses;
mod settings;

pub use error::PlayerError;
pub use message::{HeardBall, Message};
pub use player::{Identity, Output, Player};
pub use record::Record;
pub use senses::{BallSight, Fix, RobotSight, Senses, Sights};
pub use settings::{PlayerSettings, Tuning};
