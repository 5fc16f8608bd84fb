//! What a team's engines assume of the ball that their robot plays: `robots/<name>/ball.toml`, one file for all engines.

use serde::{Deserialize, Serialize};

use crate::KickError;
use crate::settings::{Settings, within};

/// A ball and its impact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BallModel {
    /// Radius, m.
    pub radius: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Restitution of foot on ball, in (0, 1): v_ball = v_foot (1 + e) M / (M + m).
    pub restitution: f64,
    /// Deceleration of the rolling ball, m/s^2: turns a distance into a speed and forecasts a moving ball.
    pub deceleration: f64,
}

impl Settings for BallModel {
    const FILE: &'static str = "ball.toml";
    const HOLDS: &'static str = "the ball";

    fn validate(&self) -> Result<(), KickError> {
        within("radius", self.radius, 0.01, 0.2)?;
        within("mass", self.mass, 0.005, 1.0)?;
        within("restitution", self.restitution, 0.01, 0.99)?;
        within("deceleration", self.deceleration, 0.01, 5.0)
    }
}

impl BallModel {
    /// Ball speed over foot speed for an effective mass (kg) of the foot (facts/physics-of-the-kick.md).
    #[must_use]
    pub fn gain(&self, mass: f64) -> f64 {
        (1.0 + self.restitution) * mass / (mass + self.mass)
    }

    /// Where a ball is (m) and how it moves (m/s) after `time` (s) of rolling.
    #[must_use]
    pub fn roll(&self, ball: [f64; 2], velocity: [f64; 2], time: f64) -> ([f64; 2], [f64; 2]) {
        let speed = velocity[0].hypot(velocity[1]);
        if speed < 1e-6 || time <= 0.0 {
            return (ball, velocity);
        }
        let t = time.min(speed / self.deceleration);
        let way = (speed - 0.5 * self.deceleration * t) * t / speed;
        let left = (speed - self.deceleration * t) / speed;
        ([ball[0] + velocity[0] * way, ball[1] + velocity[1] * way], velocity.map(|v| v * left))
    }
}
