//! One binary for all integration tests of this crate.

mod hostile;
mod server;
mod support;
