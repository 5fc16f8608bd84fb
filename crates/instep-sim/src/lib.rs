//! The world in which a kick is measured: a robot with the limits of its motors, a pitch, a ball whose impacts can be
//! trusted, sensors that are as late and as noisy as told, and the trial that reports what happened.
//!
//! - [`settings`]: every constant of the physics, with unit, range and effect.
//! - [`contact_law`]: how contact time and restitution become MuJoCo's stiffness and damping.
//! - [`World`]: steps the physics, finely while the ball is near a foot; enforces torque and speed limits.
//! - [`sensors`]: what a controller may see.
//! - [`impact`]: what happened between foot and ball; [`audit`]: whether to believe it.
//! - [`trial`]: one kick from start to finish, measured and recorded.
//!
//! A world is one thread's; run trials side by side with one world each. The same trial and seed give the same bytes
//! on any number of threads. Nothing here plans or controls.

pub mod audit;
pub mod contact_law;
mod error;
pub mod impact;
mod model;
pub mod sensors;
pub mod settings;
mod sights;
pub mod trial;
mod world;

pub use error::SimError;
pub use world::{BallState, Snapshot, World};
