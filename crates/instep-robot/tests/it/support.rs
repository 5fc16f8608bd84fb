//! What several tests need: the shipped robots, random states, and comparison of matrices.

use std::path::PathBuf;

use instep_robot::Robot;
use proptest::prelude::*;

/// The shipped robots.
pub(crate) const ROBOTS: [&str; 4] = ["prestoe", "nao", "wolfgang", "artemis"];

/// The folder of a shipped robot.
pub(crate) fn robot_folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots").join(name)
}

/// A file of the tests' own.
pub(crate) fn data_file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A shipped robot.
pub(crate) fn load(name: &str) -> Robot {
    Robot::load(&robot_folder(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// Deterministic numbers in [-1, 1] without a dependency: a linear congruential generator (Knuth's MMIX constants).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(crate) fn vector(&mut self, length: usize, scale: f64) -> Vec<f64> {
        (0..length).map(|_| self.next() * scale).collect()
    }

    /// A position `q` of `robot` within its joint ranges.
    pub(crate) fn position(&mut self, robot: &Robot) -> Vec<f64> {
        let mut q = self.vector(7, 1.0);
        let norm = q[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        q[3..].iter_mut().for_each(|x| *x /= norm);
        for joint in &robot.joints {
            let [least, greatest] = joint.range;
            q.push(least + (greatest - least) * 0.5 * (1.0 + self.next()));
        }
        q
    }
}

/// A unit quaternion (w, x, y, z), for proptest.
pub(crate) fn quaternion() -> impl Strategy<Value = [f64; 4]> {
    prop::array::uniform4(-1.0..1.0f64).prop_filter_map("a quaternion near zero", |q| {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        (norm > 0.1).then(|| q.map(|x| x / norm))
    })
}

/// The largest difference of two lists, relative to the largest number in them (at least 1).
pub(crate) fn difference(ours: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(ours.len(), theirs.len(), "lists of the same length");
    let scale = theirs.iter().fold(1.0f64, |m, x| m.max(x.abs()));
    ours.iter().zip(theirs).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / scale
}
