//! Engine `policy` (paper 1): a network that was trained to follow one reference, and to hit a ball with it.
//!
//! - [`track`]: the motion that is followed; [`follower`]: observation and command about it; [`odometry`]: where the base is.
//! - [`network`]: the network as it runs; [`file`](mod@file): the file that holds all of it.
//! - [`PolicyKick`]: the engine.
//!
//! Nothing here learns: `instep-learn` does.

mod engine;
pub mod file;
pub mod follower;
pub mod network;
pub mod odometry;
pub mod track;

pub use engine::PolicyKick;
pub use file::{Policy, PolicyHeader};
pub use follower::{Follower, FollowerSettings};
pub use network::{Activation, Layer, Network, Normalizer};
pub use track::{Track, TrackState};
