//! Where a resting ball is, from sights of it on a robot that moves: odometry's frame.
//!
//! A sight tells of the time when it was seen, and the robot has gone on since: it goes into the frame by the pose of its own time. A Kalman filter
//! of a ball that rests, whose place is less certain the longer it was not seen. It knows no rolling ball and no false sights.

use instep_robot::control::Sensors;
use nalgebra::{Rotation2, Vector2};

/// How many poses are kept for sights that come late.
const POSES: usize = 512;
/// Deviation of a sight: m, and m a metre of distance.
const SIGHT: [f64; 2] = [0.01, 0.03];
/// How a ball's place gets uncertain, m^2/s.
const WANDER: f64 = 1e-4;
/// Deviation of a place that was told, m.
const TOLD: f64 = 0.05;

/// A ball at rest as it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ball {
    position: Vector2<f64>,
    variance: f64,
    seen: f64,
}

/// The memory.
#[derive(Debug, Clone)]
pub struct BallMemory {
    ball: Option<Ball>,
    /// Times and poses (x, y, heading) of the last ticks.
    poses: Vec<(f64, [f64; 3])>,
    ticks: usize,
    last_sight: f64,
}

impl Default for BallMemory {
    fn default() -> Self {
        Self { ball: None, poses: vec![(f64::NEG_INFINITY, [0.0; 3]); POSES], ticks: 0, last_sight: f64::NEG_INFINITY }
    }
}

impl BallMemory {
    /// The ball is said to be at `position`, m.
    pub fn expect(&mut self, position: Vector2<f64>) {
        self.ball = Some(Ball { position, variance: TOLD * TOLD, seen: f64::NEG_INFINITY });
    }

    /// No ball is known any more.
    pub fn forget(&mut self) {
        self.ball = None;
    }

    /// Where it is, m.
    #[must_use]
    pub fn position(&self) -> Option<Vector2<f64>> {
        Some(self.ball?.position)
    }

    /// When it was seen last, s.
    #[must_use]
    pub fn seen(&self) -> Option<f64> {
        Some(self.ball?.seen)
    }

    /// The robot is at `pose` (x, y in m, heading in rad) at `time` (s); once a tick.
    pub fn at(&mut self, time: f64, pose: [f64; 3]) {
        self.poses[self.ticks % POSES] = (time, pose);
        self.ticks += 1;
    }

    /// Takes the sight in `sensors`, if there is a new one, and a ball is known.
    pub fn see(&mut self, sensors: &Sensors) {
        let Some(sight) = sensors.ball.filter(|sight| sight.time > self.last_sight) else { return };
        let Some(ball) = &mut self.ball else { return };
        let older = |from: &&(f64, [f64; 3])| from.0 <= sight.time + 1e-9;
        let Some((_, [x, y, heading])) = self.poses.iter().filter(older).max_by(|a, b| a.0.total_cmp(&b.0)) else {
            return;
        };
        let local = Vector2::new(sight.position[0], sight.position[1]);
        let seen = Vector2::new(*x, *y) + Rotation2::new(*heading) * local;
        if !(seen.x + seen.y).is_finite() {
            return;
        }
        let noise = (SIGHT[0] + SIGHT[1] * local.norm()).powi(2);
        let since = if ball.seen.is_finite() { (sight.time - ball.seen).max(0.0) } else { 0.0 };
        let variance = ball.variance + WANDER * since;
        let gain = variance / (variance + noise);
        ball.position += (seen - ball.position) * gain;
        ball.variance = variance * (1.0 - gain);
        ball.seen = sight.time;
        self.last_sight = sight.time;
    }
}
