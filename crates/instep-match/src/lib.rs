//! Matches by the thousand: game simulator, rules and referee, GameController (paper 4, section V-C).
//!
//! A [`Match`] is one seeded game: robots that walk within their speeds, a ball that rolls, rebounds and is kicked with
//! the measured error of a kick engine, sights with field of view, noise and delay, and a [`Referee`] with the rule book
//! of a league. Players decide by [`instep_behaviour::Player`], the same that runs on a robot, and see nothing but their
//! beliefs. [`series`] plays many games on all cores; the same seed gives the same results on any number of threads.
//!
//! The world is the frame of [`instep_field::Side::Home`]: m, s, rad. It is flat: balls roll and do not fly.

mod ball;
mod book;
mod error;
mod game;
pub mod gamecontroller;
pub mod invariants;
pub mod physics;
mod record;
mod referee;
mod robot;
pub mod scenario;
pub mod series;
mod settings;
mod sight;
mod steer;
mod tally;

pub use ball::Ball;
pub use book::RuleBook;
pub use error::MatchError;
pub use game::{Match, TeamSetup};
pub use record::{Frame, Recording, RobotFrame};
pub use referee::{Event, EventKind, Penalty, Referee, Team};
pub use robot::{Robot, Status};
pub use settings::{BodySettings, MatchSettings, SightSettings};
pub use tally::{Result, Tally};
