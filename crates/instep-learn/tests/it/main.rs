//! Training from end to end, small.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod training;
