//! Tests of the crate as its users see it: files in, motion out.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "clippy.toml allows these in test functions; here the helpers are tests too"
)]

mod allocation;
mod broken_files;
mod cmu;
mod formats;
mod kick;
mod reference;
mod spline;
mod synthetic;
