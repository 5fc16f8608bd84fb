//! Which parts of a robot can touch which: found by trying.
//!
//! Joints are drawn evenly from their ranges, from a seeded generator, and the pairs of capsules counted that overlap. A pair on one link,
//! on neighbours, or one that overlaps nearly always (the model's own joints) is left out; pairs of the two legs are always kept.

use std::sync::Arc;

use mujoco_rs::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::stand::Poser;
use crate::{Robot, closest_points};

/// Poses that are drawn.
const POSES: usize = 1500;
/// A pair that overlaps in fewer poses than this is left out, and one that does so in more than the rest, too.
const OFTEN: [usize; 2] = [1, POSES * 6 / 10];

/// Pairs of geoms.
pub(super) struct Pairs {
    pub(super) pairs: Vec<[usize; 2]>,
}

impl Pairs {
    /// All pairs of capsules that are neither on one link nor on neighbours.
    pub(super) fn candidates(model: &Arc<MjModel>, geoms: &[usize]) -> Self {
        let link = |geom: usize| usize::try_from(model.geom_bodyid()[geom]).unwrap_or(0);
        let parent = |link: usize| usize::try_from(model.body_parentid()[link]).unwrap_or(0);
        let mut pairs = Vec::new();
        for (i, &a) in geoms.iter().enumerate() {
            for &b in &geoms[i + 1..] {
                let (x, y) = (link(a), link(b));
                // Two hinges on one place are one joint: the link between has no extent.
                let near = |x: usize, y: usize| parent(x) == y || parent(parent(x)) == y;
                if x != y && !near(x, y) && !near(y, x) {
                    pairs.push([a, b]);
                }
            }
        }
        Self { pairs }
    }

    /// Those of the pairs that touch in some poses and that the standing pose `stand` (joint angles) keeps apart by `gap` (m).
    pub(super) fn touching(self, robot: &Robot, stand: &[f64], gap: f64) -> Self {
        let mut poser = Poser::new(robot.model());
        let mut counts = vec![0; self.pairs.len()];
        let mut rng = ChaCha8Rng::seed_from_u64(22);
        for _ in 0..POSES {
            let q: Vec<f64> = robot
                .joints
                .iter()
                .map(|joint| joint.range[0] + (joint.range[1] - joint.range[0]) * rng.random::<f64>())
                .collect();
            poser.pose(&q);
            for (count, pair) in counts.iter_mut().zip(&self.pairs) {
                *count += usize::from(gap_of(&poser, pair) < 0.0);
            }
        }
        poser.pose(stand);
        let [least, most] = OFTEN;
        let legs = |pair: &[usize; 2]| {
            let side = |geom: usize| robot.legs.iter().position(|leg| leg.strike.contains(&geom));
            matches!((side(pair[0]), side(pair[1])), (Some(a), Some(b)) if a != b)
        };
        let pairs = self
            .pairs
            .into_iter()
            .zip(counts)
            .filter(|(pair, count)| legs(pair) || (least..=most).contains(count))
            .map(|(pair, _)| pair)
            .filter(|pair| gap_of(&poser, pair) > gap)
            .collect();
        Self { pairs }
    }

    /// Least gap of all pairs in the pose of `poser`, m.
    pub(super) fn least_gap(&self, poser: &Poser) -> f64 {
        self.pairs.iter().map(|pair| gap_of(poser, pair)).fold(f64::INFINITY, f64::min)
    }
}

fn gap_of(poser: &Poser, [a, b]: &[usize; 2]) -> f64 {
    let ((a, ra), (b, rb)) = (poser.capsule(*a), poser.capsule(*b));
    closest_points(a, b).distance() - ra - rb
}
