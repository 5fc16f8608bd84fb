//! State estimation of a legged robot: [`filter`] on the matrix Lie group of [`group`].
//!
//! What it needs of a robot is where its contact points are in the inertial sensor's frame; it knows no model, no file and no
//! simulator.

pub mod filter;
pub mod group;

pub use filter::{Contact, ContactEkf, Noise};
