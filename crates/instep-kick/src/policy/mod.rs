//! A network that was trained to follow one reference, and to hit a ball with it (paper 1).
//!
//! - [`follower`]: observation and command about a [`crate::track::Track`]; [`odometry`]: where the base is.
//! - [`network`]: the network as it runs; [`file`](mod@file): the file that holds all of it.
//! - [`PolicyKick`]: the controller that runs it from its track's start; [`LearnedKick`]: the engine that takes requests for
//!   the one kick that it knows, with [`PolicySettings`].
//!
//! Nothing here learns: `instep-learn` does.

mod engine;
pub mod file;
pub mod follower;
pub mod network;
pub mod odometry;
mod run;
mod settings;

pub use engine::{LearnedKick, PERIOD};
pub use file::{Policy, PolicyHeader};
pub use follower::{Follower, FollowerSettings};
pub use network::{Activation, Layer, Network, Normalizer};
pub use run::PolicyKick;
pub use settings::PolicySettings;
