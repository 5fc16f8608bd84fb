//! The node from outside: its clients, its robot and its enemies. Everything runs over the loopback interface, each
//! test in a ROS domain of its own.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "clippy.toml allows these in test functions; here the helpers are tests too"
)]

mod client;
mod cyclone;
mod decode;
mod interfaces;
mod soak;
mod support;
mod watchdog;
