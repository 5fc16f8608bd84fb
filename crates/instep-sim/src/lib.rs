//! The world in which a kick is measured: a robot with the limits of its motors, a pitch, a ball whose impacts can be
//! trusted, sensors that are as late and as noisy as told, and the trial that reports what happened.
//!
//! - [`settings`]: every constant of the physics, with unit, range and effect.
//! - [`contact_law`]: how contact time and restitution become MuJoCo's stiffness and damping.
//! - [`World`]: steps the physics, finely while the ball is near a foot; enforces torque and speed limits. One robot, or any
//!   number of them on a field with [`goal`]s.
//! - [`sensors`]: what a controller may see.
//! - [`ball`]: the balls that robots play, and what slows them.
//! - [`impact`]: what happened between robot and ball; [`audit`]: whether to believe it.
//! - [`trial`]: one kick from start to finish, measured, run again at finer steps and recorded.
//! - [`start`]: how a trial's start differs from what its controller expects.
//! - [`rate`]: a share of trials with its 95 % interval.
//!
//! A world is one thread's; run trials side by side with one world each. The same trial and seed give the same bytes
//! on any number of threads. Nothing here plans or controls.

pub mod audit;
pub mod ball;
pub mod contact_law;
mod error;
pub mod goal;
pub mod impact;
mod model;
pub mod rate;
pub mod sensors;
pub mod settings;
mod sights;
pub mod start;
pub mod trial;
mod world;

pub use error::SimError;
pub use rate::{NamedRate, Rate};
pub use world::{BallState, Entrant, Steps, View, World};
