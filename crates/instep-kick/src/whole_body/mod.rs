//! What the engines for legged kicks share: one robot as they know it, its feet, the curves of its motions, its
//! feed-forward torques, its closed loops, and the drive that turns wanted poses into joint commands.

pub(crate) mod balance;
pub(crate) mod body;
pub(crate) mod drive;
pub mod foot;
pub(crate) mod inclination;
pub(crate) mod path;
mod settings;
pub(crate) mod torque;

pub use inclination::Inclination;
pub use settings::{Feedback, Limits, Pid, Stance};
