//! Players for RCSSServerMJ, the simulation league's MuJoCo server (registry package `rcsssmj`), over TCP.
//!
//! An adapter and nothing more: what plays is [`instep_player::Player`].
//!
//! - [`framing`]: messages behind their length; [`expression`]: S-expressions, parsed within bounds.
//! - [`perception`]: what the server tells; [`action`]: what it is told.
//! - [`model`]: which robot of the server is which of ours, joint by joint; [`mode`]: its play modes as states of the game.
//! - [`body`]: perceptions as senses: soles and speed from the pose that the server tells, sights from the camera's frame, all
//!   ahead of time by the server's cycle.
//! - [`speech`]: a team message in the ten bytes that the server lets pass.
//! - [`agent`]: one player, message in, message out; [`client`]: its connection, again and again; [`team`]: many of them.
//!
//! Facts about the server are of version 0.2.1 and stand, with how they were found, in the crate's README.

pub mod action;
pub mod agent;
pub mod body;
pub mod client;
mod error;
pub mod expression;
pub mod framing;
pub mod mode;
pub mod model;
pub mod perception;
mod settings;
pub mod speech;
pub mod team;

pub use agent::Agent;
pub use client::{Client, Setup, Tally};
pub use error::RcssError;
pub use settings::settings;
pub use team::{Roster, play};
