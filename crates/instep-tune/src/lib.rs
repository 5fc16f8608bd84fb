//! Tunes an engine's settings to a robot: CMA-ES over named numbers of its settings file, measured with KickBench's cases.
//!
//! - [`cmaes`]: the search, which knows nothing of kicks.
//! - [`tuning`]: the file that says which numbers, between which bounds, measured on what.
//! - [`space`]: from a point of the search to settings, by the numbers' paths in the file.
//! - [`evaluate`]: what settings are worth: cases tried in the world, falls, misses and invalid impacts penalised.
//! - [`run`]: the generations, with a checkpoint after each.
//! - [`page`]: the HTML report.
//!
//! Nothing here knows a certain engine: whatever [`instep_bench::Subject`] can make of a settings text can be tuned. Same
//! files and seed, same result, on any number of threads.

pub mod cmaes;
mod error;
pub mod evaluate;
pub mod page;
pub mod run;
pub mod space;
pub mod tuning;

pub use error::TuneError;
pub use evaluate::{Objective, Summary};
pub use run::{Generation, Run, Tuned};
pub use tuning::Tuning;
