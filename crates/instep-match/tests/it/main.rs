//! Integration tests of matches, one binary.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

mod gamecontroller;
mod invariants;
mod physics;
mod rules;
