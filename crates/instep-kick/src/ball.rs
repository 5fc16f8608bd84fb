//! What a team's engines assume of the ball that their robot plays: `robots/<name>/ball.toml`, one file for all engines.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::KickError;

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

impl BallModel {
    /// Reads `ball.toml` in a robot's folder.
    ///
    /// # Errors
    /// When it cannot be read, or a value cannot be: with file and field.
    pub fn load(folder: &Path) -> Result<Self, KickError> {
        let file = folder.join("ball.toml");
        let name = file.display().to_string();
        let text = std::fs::read_to_string(&file).map_err(|e| KickError::Read {
            file: name.clone(),
            detail: format!("{e}; expected the ball that this robot plays"),
        })?;
        let ball: Self = toml::from_str(&text)
            .map_err(|e| KickError::Parse { file: name.clone(), detail: e.to_string().trim_end().to_owned() })?;
        ball.validate().map_err(|error| match error {
            KickError::Setting { field, found, expected } => {
                KickError::Setting { field: format!("{name}: {field}"), found, expected }
            }
            other => other,
        })?;
        Ok(ball)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), KickError> {
        for (field, value, low, high) in [
            ("radius", self.radius, 0.01, 0.2),
            ("mass", self.mass, 0.005, 1.0),
            ("restitution", self.restitution, 0.01, 0.99),
            ("deceleration", self.deceleration, 0.01, 5.0),
        ] {
            if !(low..=high).contains(&value) {
                let expected = format!("a number in [{low}, {high}]");
                return Err(KickError::Setting { field: field.to_owned(), found: value.to_string(), expected });
            }
        }
        Ok(())
    }

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
