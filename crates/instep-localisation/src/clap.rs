//! CLAP as paper 4 prints it (IV-C): the mean of the hypotheses round the prediction; and over several frames the
//! centroid nearest to the pose, which takes its place when both differ too much.
//!
//! Source: paper 4, eq (5) and IV-C-2; Fernandez et al., arXiv 2509.08495. The radius, the threshold and which
//! centroids count are not in the paper; they are the constants here. A frame without a hypothesis in the radius leaves
//! the pose to the odometry. It knows no covariance. Kept as a measure of what the shipped filter gains.

use std::sync::Arc;

use instep_field::{Pose, wrap};

use crate::localiser::{Method, Start};
use crate::map::Map;
use crate::measurement::Polar;
use crate::window::{Window, nearest_first};
use crate::{Frame, Settings};

/// Hypotheses this near to the prediction are averaged, m and rad.
const RADIUS: f64 = 0.7;
const ANGLE: f64 = 0.5;
/// The pose is reset when the centroid is farther than this, m and rad.
const RESET_DISTANCE: f64 = 1.0;
const RESET_ANGLE: f64 = 0.5;
/// Centroids with at least this share of the most members are possible states.
const POSSIBLE: f64 = 0.5;

/// CLAP as printed.
#[derive(Debug, Clone)]
pub struct Clap {
    map: Arc<Map>,
    settings: Settings,
    pose: Pose,
    window: Window,
    sights: Vec<Polar>,
    resets: usize,
}

impl Clap {
    /// A method that has not been started.
    pub fn new(map: Arc<Map>, settings: Settings) -> Clap {
        let window = Window::new(&map, &settings);
        Clap { map, settings, pose: Pose::default(), window, sights: Vec::with_capacity(64), resets: 0 }
    }
}

impl Method for Clap {
    fn name(&self) -> &'static str {
        "CLAP as printed"
    }

    fn start(&mut self, start: Start) {
        self.window.clear();
        self.resets = 0;
        self.pose = match start {
            Start::Near { pose, .. } => pose,
            Start::OwnHalf => Pose::new(-self.map.half()[0] / 2.0, 0.0, 0.0),
            Start::Anywhere => Pose::default(),
        };
    }

    fn predict(&mut self, motion: &Pose, _dt: f64) {
        self.pose = self.pose.then(motion);
        self.window.step(motion);
    }

    fn update(&mut self, frame: &Frame) {
        nearest_first(&frame.landmarks, &self.settings.noise, self.settings.filter.most_sights, &mut self.sights);
        self.window.push(&self.map, &self.sights);
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for pose in self.window.newest() {
            let turn = wrap(pose.heading - self.pose.heading);
            if pose.distance(&self.pose) < RADIUS && turn.abs() < ANGLE {
                sum = [sum[0] + pose.x, sum[1] + pose.y, sum[2] + turn];
                count += 1.0;
            }
        }
        if count > 0.0 {
            self.pose = Pose::new(sum[0] / count, sum[1] / count, self.pose.heading + sum[2] / count);
        }
    }

    fn check(&mut self) {
        let pose = self.pose;
        let clusters = self.window.clusters();
        let most = clusters.first().map_or(0, |c| c.members);
        let possible = clusters.iter().filter(|c| c.members as f64 >= POSSIBLE * most as f64);
        let nearest = possible.map(|c| c.pose).min_by(|a, b| a.distance(&pose).total_cmp(&b.distance(&pose)));
        let Some(nearest) = nearest else { return };
        if nearest.distance(&pose) > RESET_DISTANCE || wrap(nearest.heading - pose.heading).abs() > RESET_ANGLE {
            self.pose = nearest;
            self.resets += 1;
        }
    }

    fn pose(&self) -> Pose {
        self.pose
    }

    fn resets(&self) -> usize {
        self.resets
    }
}
