//! A fixed-lag smoother: the poses of the last two seconds' frames, found together from sights and odometry; what is
//! older is summed up in a prior on the oldest of them.
//!
//! Source: Dellaert, Kaess, Factor Graphs for Robot Perception (2017), 5.3 (marginalisation). The normal equations of a
//! chain are block tridiagonal and are solved by one sweep forth and one back. Sights are associated anew at each
//! Gauss-Newton step, under Cauchy's weights.

use std::collections::VecDeque;
use std::sync::Arc;

use instep_field::{Pose, wrap};
use nalgebra::{Matrix3, Vector3};

use crate::association::Association;
use crate::kalman::{begin, step_variance};
use crate::localiser::{Method, Start};
use crate::map::Map;
use crate::measurement::{Expected, Polar, cauchy};
use crate::window::nearest_first;
use crate::{Frame, Settings};

/// Frames that are found together: 2 s at 20 Hz.
const FRAMES: usize = 40;
/// Gauss-Newton steps for each frame.
const STEPS: usize = 2;

/// One frame: its pose, its sights, and the odometry since the frame before.
#[derive(Debug, Clone, Default)]
struct Node {
    pose: Pose,
    sights: Vec<Polar>,
    motion: Pose,
    variance: Vector3<f64>,
}

/// One row of the normal equations.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    diagonal: Matrix3<f64>,
    /// With the next pose.
    next: Matrix3<f64>,
    gradient: Vector3<f64>,
}

/// The fixed-lag smoother.
#[derive(Debug, Clone)]
pub struct FixedLag {
    map: Arc<Map>,
    settings: Settings,
    nodes: VecDeque<Node>,
    /// What is known of the oldest pose: where, information, and its slope there.
    prior: (Pose, Matrix3<f64>, Vector3<f64>),
    blocks: Vec<Block>,
    association: Association,
    /// Odometry since the newest frame.
    motion: Pose,
    variance: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl FixedLag {
    /// A smoother that has not been started.
    pub fn new(map: Arc<Map>, settings: Settings) -> FixedLag {
        FixedLag {
            association: Association::with_capacity(&map, settings.filter.most_sights),
            map,
            settings,
            nodes: VecDeque::with_capacity(FRAMES + 1),
            prior: (Pose::default(), Matrix3::identity(), Vector3::zeros()),
            blocks: vec![Block::default(); FRAMES + 1],
            motion: Pose::default(),
            variance: Vector3::zeros(),
            covariance: Matrix3::identity(),
        }
    }

    /// Normal equations at the present poses.
    fn linearise(&mut self) {
        let filter = &self.settings.filter;
        self.blocks.iter_mut().for_each(|b| *b = Block::default());
        let (at, information, slope) = &self.prior;
        if let Some(first) = self.nodes.front() {
            self.blocks[0].diagonal += information;
            self.blocks[0].gradient += information * offset(at, &first.pose) + slope;
        }
        // The gate wants the pose's own uncertainty; the newest one's stands for all.
        let covariance = self.covariance;
        for (i, node) in self.nodes.iter().enumerate() {
            self.association.find(&self.map, &node.sights, &node.pose, &covariance, 1.0, filter.gate);
            for (sight, landmark) in node.sights.iter().zip(&self.association.landmark) {
                let Some(landmark) = *landmark else { continue };
                let expected = Expected::of(&node.pose, self.map.landmarks()[landmark].1);
                let rows = [
                    (expected.range_slope, expected.range - sight.range, sight.range_sigma),
                    (expected.bearing_slope, wrap(expected.bearing - sight.bearing), sight.bearing_sigma),
                ];
                let square = rows.iter().map(|(_, r, s)| (r / s).powi(2)).sum::<f64>();
                let weight = cauchy(square, filter.cauchy) / filter.information_divisor;
                for (slope, residual, sigma) in rows {
                    let slope = Vector3::from(slope);
                    let information = weight / (sigma * sigma);
                    self.blocks[i].diagonal += information * slope * slope.transpose();
                    self.blocks[i].gradient += information * residual * slope;
                }
            }
        }
        for (i, (a, b)) in self.nodes.iter().zip(self.nodes.iter().skip(1)).enumerate() {
            let seen = a.pose.relative(&b.pose);
            let residual = offset(&b.motion, &seen);
            let (s, c) = a.pose.heading.sin_cos();
            let to = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
            let mut from = -to;
            (from[(0, 2)], from[(1, 2)]) = (seen.y, -seen.x);
            let information = Matrix3::from_diagonal(&b.variance.map(|v| 1.0 / v.max(1e-12)));
            let (f, t) = (from.transpose() * information, to.transpose() * information);
            self.blocks[i].diagonal += f * from;
            self.blocks[i].next += f * to;
            self.blocks[i].gradient += f * residual;
            self.blocks[i + 1].diagonal += t * to;
            self.blocks[i + 1].gradient += t * residual;
        }
    }

    /// One Gauss-Newton step for all poses; the newest one's covariance falls out of the forward sweep.
    fn solve(&mut self) -> Option<()> {
        let n = self.nodes.len();
        for i in 1..n {
            let Block { diagonal, next, gradient } = self.blocks[i - 1];
            let factor = next.transpose() * diagonal.try_inverse()?;
            self.blocks[i].diagonal -= factor * next;
            self.blocks[i].gradient -= factor * gradient;
        }
        self.covariance = self.blocks[n - 1].diagonal.try_inverse()?;
        let mut step = Vector3::zeros();
        for i in (0..n).rev() {
            let Block { diagonal, next, gradient } = self.blocks[i];
            step = -(diagonal.try_inverse()? * (gradient + next * step));
            let pose = &mut self.nodes[i].pose;
            *pose = Pose::new(pose.x + step[0], pose.y + step[1], pose.heading + step[2]);
        }
        Some(())
    }

    /// The oldest pose goes; what it and the odometry from it say about the next becomes the prior.
    fn marginalise(&mut self) {
        self.linearise();
        let Block { diagonal, next, gradient } = self.blocks[0];
        let (Some(second), Some(inverse)) = (self.nodes.get(1), diagonal.try_inverse()) else { return };
        // Of the second block only what the odometry from the first put there.
        let (s, c) = self.nodes[0].pose.heading.sin_cos();
        let to = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let information = Matrix3::from_diagonal(&second.variance.map(|v| 1.0 / v.max(1e-12)));
        let residual = offset(&second.motion, &self.nodes[0].pose.relative(&second.pose));
        let factor = next.transpose() * inverse;
        let left = to.transpose() * information * to - factor * next;
        let slope = to.transpose() * information * residual - factor * gradient;
        self.prior = (second.pose, 0.5 * (left + left.transpose()), slope);
        self.nodes.pop_front();
    }
}

/// `b - a` with the heading wrapped.
fn offset(a: &Pose, b: &Pose) -> Vector3<f64> {
    Vector3::new(b.x - a.x, b.y - a.y, wrap(b.heading - a.heading))
}

impl Method for FixedLag {
    fn name(&self) -> &'static str {
        "fixed-lag smoother"
    }

    fn start(&mut self, start: Start) {
        let (pose, covariance) = begin(&self.map, start);
        self.nodes.clear();
        self.prior = (pose, covariance.try_inverse().unwrap_or_else(Matrix3::identity), Vector3::zeros());
        self.covariance = covariance;
        (self.motion, self.variance) = (Pose::default(), Vector3::zeros());
    }

    fn predict(&mut self, motion: &Pose, dt: f64) {
        self.motion = self.motion.then(motion);
        self.variance += step_variance(&self.settings.odometry, motion, dt);
    }

    fn update(&mut self, frame: &Frame) {
        let pose = self.pose();
        let mut sights = Vec::with_capacity(self.settings.filter.most_sights);
        if self.nodes.len() == FRAMES {
            self.marginalise();
        }
        let filter = &self.settings.filter;
        nearest_first(&frame.landmarks, &self.settings.noise, filter.most_sights, &mut sights);
        let first = self.nodes.is_empty();
        if first {
            self.prior.0 = pose;
        }
        self.nodes.push_back(Node { pose, sights, motion: self.motion, variance: self.variance });
        (self.motion, self.variance) = (Pose::default(), Vector3::zeros());
        for _ in 0..STEPS {
            self.linearise();
            if self.solve().is_none() {
                break;
            }
        }
    }

    fn pose(&self) -> Pose {
        self.nodes.back().map_or(self.prior.0, |n| n.pose).then(&self.motion)
    }

    fn covariance(&self) -> Option<Matrix3<f64>> {
        Some(self.covariance)
    }
}
