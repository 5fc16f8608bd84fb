//! What the engines for legged kicks share: one robot as they know it, its feet, the curves of its motions, its
//! feed-forward torques, its closed loops, the drive that turns wanted poses into joint commands, and the forecast that tells
//! what it can do.

pub(crate) mod balance;
pub(crate) mod body;
pub(crate) mod drive;
pub mod foot;
pub(crate) mod forecast;
pub(crate) mod inclination;
pub(crate) mod motion;
pub(crate) mod path;
mod settings;
pub(crate) mod timeline;
pub(crate) mod torque;
pub(crate) mod watch;

pub use inclination::Inclination;
pub use settings::{Feedback, Limits, Pid, Stance, Times};
