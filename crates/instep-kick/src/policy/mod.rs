//! A network that was trained to follow one reference, and to hit a ball with it (paper 1).
//!
//! - [`follower`]: observation and command about a [`crate::track::Track`]; [`odometry`]: where the base is.
//! - [`network`]: the network as it runs; [`file`](mod@file): the file that holds all of it.
//! - [`PolicyKick`]: the controller that runs it from its track's start.
//!
//! Nothing here learns: `instep-learn` does. It takes no requests yet: a policy knows one ball, one direction and one
//! start, and cannot give a run-up up.

pub mod file;
pub mod follower;
pub mod network;
pub mod odometry;
mod run;

pub use file::{Policy, PolicyHeader};
pub use follower::{Follower, FollowerSettings};
pub use network::{Activation, Layer, Network, Normalizer};
pub use run::PolicyKick;
