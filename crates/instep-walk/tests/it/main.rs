//! Integration tests of walking, one binary.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops at the first surprise"
)]

#[path = "../rig/mod.rs"]
mod rig;

mod allocation;
mod gait;
mod in_gait;
mod senses;
