//! What a robot must not walk into: a disc that moves.

use serde::{Deserialize, Serialize};

/// A person, a robot, a ball that is not to be touched.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Middle in the field frame, m.
    pub position: [f64; 2],
    /// In the field frame, m/s; zero for what stands.
    #[serde(default)]
    pub velocity: [f64; 2],
    /// Of its body, m. The keep-out of the robot's middle is this and the robot's own radius.
    pub radius: f64,
}

impl Obstacle {
    /// Where it is `time` seconds from now if it goes on as now, m.
    #[must_use]
    pub fn at(&self, time: f64) -> [f64; 2] {
        [self.position[0] + self.velocity[0] * time, self.position[1] + self.velocity[1] * time]
    }

    /// Whether every number is finite and the radius not negative.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let [x, y] = self.position;
        let [u, v] = self.velocity;
        x.is_finite()
            && y.is_finite()
            && u.is_finite()
            && v.is_finite()
            && self.radius.is_finite()
            && self.radius >= 0.0
    }
}
