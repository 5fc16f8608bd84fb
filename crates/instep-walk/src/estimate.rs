//! State estimation of a legged robot: [`filter`] on the matrix Lie group of [`group`], which [`estimator`] feeds with a robot's
//! senses.
//!
//! The filter needs of a robot where its contact points are in the inertial sensor's frame; it knows no model, no file and no
//! simulator.

pub mod estimator;
pub mod filter;
pub mod group;

pub use estimator::Estimator;
pub use filter::{Contact, ContactEkf, Noise};
