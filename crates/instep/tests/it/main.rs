//! Tests through the program itself: what a user types and what comes back.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "clippy.toml allows these in test functions; here the helpers are tests too"
)]

mod bad_input;
mod docs;
mod engine;
mod kick;
mod learn;
mod retarget;
mod robot;
mod see;
mod support;
mod tune;
