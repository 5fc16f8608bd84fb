//! Tests of the kick engines against the robots that ship.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod allocation;
mod bound;
mod cancel;
mod catch;
mod faults;
mod follow;
mod issue_304;
mod kinematics;
mod learned;
mod policy;
mod preview;
mod refusals;
mod riccati;
mod rig;
