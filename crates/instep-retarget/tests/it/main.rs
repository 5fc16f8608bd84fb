//! Integration tests of retargeting, one binary.

mod kinematic;
