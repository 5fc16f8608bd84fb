//! One binary for all integration tests of this crate.

mod senses;
mod support;
