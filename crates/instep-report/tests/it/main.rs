//! Tests of the crate as its users see it.
#![expect(clippy::unwrap_used, reason = "a helper of a test that unwraps fails with the line it stands on")]

mod html;
mod mcap;
