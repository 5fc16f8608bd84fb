//! Integration tests of instep-robot, one binary.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "helpers of tests may fail a test and print its figures"
)]

mod adopt;
mod check;
mod control;
mod differences;
mod drive;
mod fuzz;
mod geometry;
mod nao;
mod oracle;
mod prestoe;
mod stands;
mod support;
mod wolfgang;
