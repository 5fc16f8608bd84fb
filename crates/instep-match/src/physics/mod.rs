//! Matches in physics (paper 4, section V-D): whole players on their own senses in one MuJoCo world.
//!
//! [`PhysicsMatch`] is a game with the game simulator's referee; [`fig12h`] the paper's last experiment: one robot, three
//! opponents that stand anywhere, a ball in view. Whoever plays is an [`instep_player::Player`] and sees what its robot's
//! sensors tell; the cameras' detections are simulated (`eyes`).

mod arena;
mod eyes;
pub mod fig12h;
mod game;
mod record;
mod seat;

pub use game::{Outfit, PhysicsMatch};
pub use record::Motion;
pub use seat::Seat;
