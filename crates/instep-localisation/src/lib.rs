//! Where am I: CLAP, the methods that it is compared with, and the landmark filter that is shipped.
//!
//! A [`Map`] is made of a field, a [`Method`] of a map and [`Settings`], and a [`Localiser`] feeds it with stamped
//! [`Step`]s of odometry and [`Frame`]s of sights and gives the pose of now. Simulated and recorded runs are
//! [`stream::Stream`]s; [`evaluate`] measures a method along one. This crate knows no camera and no behaviour; it opens
//! no file but in `load`.

mod association;
mod clap;
mod cluster;
mod error;
pub mod evaluate;
mod filter;
mod fixed_lag;
mod hypotheses;
mod kalman;
mod localiser;
mod map;
mod measurement;
mod monte_carlo;
mod observation;
pub mod scenario;
mod settings;
pub mod stream;
mod window;

use std::sync::Arc;

pub use clap::Clap;
pub use cluster::Cluster;
pub use error::LocalisationError;
pub use filter::LandmarkFilter;
pub use fixed_lag::FixedLag;
pub use kalman::Kalman;
pub use localiser::{Localiser, Method, Start, Status};
pub use map::Map;
pub use monte_carlo::MonteCarlo;
pub use observation::{Frame, LineSight, Sight, Step};
pub use settings::{FilterSettings, GlobalSettings, HypothesisSettings, Noise, OdometryNoise, Settings};
pub use window::Candidate;

/// All methods, the shipped one first. `seed` is for those that draw random numbers.
pub fn methods(map: &Arc<Map>, settings: &Settings, seed: u64) -> Vec<Box<dyn Method>> {
    vec![
        Box::new(LandmarkFilter::new(map.clone(), *settings)),
        Box::new(Clap::new(map.clone(), *settings)),
        Box::new(MonteCarlo::new(map.clone(), *settings, seed)),
        Box::new(Kalman::new(map.clone(), *settings)),
        Box::new(FixedLag::new(map.clone(), *settings)),
    ]
}
