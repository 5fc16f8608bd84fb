//! KickBench: engines x robots x scenarios x seeds to one table.
//!
//! - [`scenario`]: data files that say where balls lie, which kicks are asked, and what the world does meanwhile.
//! - [`engines`]: which engines there are, and what a robot brings to its trials.
//! - [`cell`]: one engine, robot, scenario and seed, run and measured.
//! - [`reach`]: the reachability grid of the adaptive kick, measured in the world.
//! - [`in_gait`]: the kick within a step as an engine; [`walking`]: one walk, run and measured;
//!   [`walk_bench`]: robots by walking scenarios.
//! - [`walking_body`]: a robot that walks where navigation sends it, believing what localisation tells it.
//! - [`run`]: all cells on all cores, with a file to resume from.
//! - [`directions`]: how far the ball goes off the asked direction, and whether the engine knew.
//! - [`table`] and [`page`]: Markdown, CSV, JSON and HTML.
//!
//! One world a thread; but for the times that plans and ticks take the same cells give the same results on any number of threads. Engines see
//! requests and sensors only.

pub mod adopt;
pub mod cell;
pub mod cpu;
pub mod directions;
pub mod engines;
mod error;
pub mod in_gait;
pub mod page;
pub mod reach;
pub mod run;
mod run_up;
pub mod scenario;
pub mod table;
pub mod walk_bench;
pub mod walk_up;
pub mod walking;
pub mod walking_body;

pub use engines::{LEADING, Subject, engines};
pub use error::BenchError;
pub use run::Bench;
pub use scenario::Scenario;
