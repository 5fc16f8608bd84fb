//! Human motion in, robot motion out: the data that everything else in Instep passes along.
//!
//! - [`clip`]: a human clip, that is a [`clip::Skeleton`] and its frames, whatever file it came from;
//!   [`asf`] and [`bvh`] read the two usual formats.
//! - [`landmark`]: which bone of a skeleton is the pelvis, a knee, a toe; where those are at each frame.
//! - [`despike`]: single-frame spikes of a recording taken out; [`jump`]: places where the whole figure jumps.
//! - [`text`]: text as other people's editors leave it.
//! - [`contact`] and [`phase`]: when each foot stands, which foot kicks, and the kick's phase times.
//! - [`mod@reference`]: a robot's motion by joint name, with its contacts, forces and phases: what a retargeter
//!   writes, a learner tracks and a kick engine plays.
//! - [`spline`]: cubic, quintic and two-cubic via-point polynomials.
//!
//! Everything public is in SI units and radians, in REP 103 axes (x forward, y left, z up); readers convert.
//! This crate knows no robot, no simulator and no clock. Files are opened only by functions named `load` or `save`.

pub mod asf;
pub mod bvh;
pub mod clip;
pub mod contact;
pub mod despike;
mod error;
pub mod jump;
pub mod landmark;
pub mod phase;
pub mod reference;
pub mod spline;
pub mod text;
mod track;

pub use error::MotionError;
