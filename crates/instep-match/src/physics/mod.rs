//! Matches in physics (paper 4, section V-D): whole players on their own senses in one MuJoCo world.
//!
//! [`PhysicsMatch`] is a game with the game simulator's referee; [`fig12h`] the paper's last experiment: one robot, three
//! opponents that stand anywhere, a ball in view. Whoever plays is an [`instep_player::Player`] and sees what its robot's
//! sensors tell, and what its camera shows ([`Sight`]).

mod arena;
mod camera;
mod eyes;
pub mod fig12h;
mod game;
mod record;
mod seat;

pub use game::{Outfit, PhysicsMatch};
pub use record::Motion;
pub use seat::Seat;

/// How players see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sight {
    /// Their cameras are rendered, and the shipped detector looks at every frame.
    #[default]
    Camera,
    /// What a detector would find is drawn from the truth, with its errors: many times as fast.
    Simulated,
}
