//! Imitation learning (paper 1, sections II-B and II-C): from a reference to a policy that follows it, and then to one
//! that hits a ball, on the cores of a laptop.
//!
//! - [`settings`]: every weight, with the paper's symbol.
//! - [`environment`]: one robot that follows a track in its world; [`reward`]: equations (34) to (38); [`termination`]:
//!   reference-guided early termination, (39) and (40), and why episodes end.
//! - [`mlp`] and [`adam`]: the networks and their optimiser, by hand; [`ppo`]: proximal policy optimisation behind the seam
//!   [`Learner`], which knows no robot.
//! - [`rollout`]: environments stepped side by side; [`train`]: the loop; [`checkpoint`]: what it can go on from.
//! - [`evaluate`]: what a policy is worth, in seeded trials; [`onnx`]: a policy for other people's programs.
//!
//! Same settings and seed, same policy, on any number of threads. Nothing here prints.

pub mod adam;
pub mod checkpoint;
pub mod environment;
mod error;
pub mod evaluate;
pub mod mlp;
pub mod onnx;
pub mod ppo;
pub mod reward;
pub mod rollout;
pub mod settings;
pub mod termination;
pub mod train;

pub use error::LearnError;
pub use ppo::Learner;
pub use settings::LearnSettings;
