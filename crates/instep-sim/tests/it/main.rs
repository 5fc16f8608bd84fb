//! Integration tests of the world, one binary.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops at the first surprise"
)]

#[path = "../rig/mod.rs"]
mod rig;

mod ball;
mod determinism;
mod limits;
mod many;
mod senses;
mod sensors;
mod trial;

use std::path::PathBuf;
use std::sync::Arc;

use instep_robot::Robot;

/// A robot of the repository.
fn robot(name: &str) -> Arc<Robot> {
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "..", "robots", name].iter().collect();
    Arc::new(Robot::load(&folder).unwrap())
}
