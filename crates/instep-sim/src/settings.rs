//! Every constant of the world, each in one place, with its source. The defaults are a FIFA size-5 ball on short
//! artificial turf; `validate` refuses what cannot be.

use instep_robot::Robot;
use serde::{Deserialize, Serialize};

use crate::SimError;
pub use crate::ball::Ball;

/// The world's constants.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorldSettings {
    /// The ground.
    pub pitch: Pitch,
    /// The ball.
    pub ball: Ball,
    /// Foot on ball.
    pub impact: ImpactLaw,
    /// Time steps.
    pub step: Step,
    /// The robot's drives.
    pub drives: Fidelity,
    /// The robot's senses.
    pub senses: Fidelity,
    /// Sensor noise and delay beyond the senses' own.
    pub sensors: SensorNoise,
    /// How the robot in the world differs from the model that its controller knows.
    pub model_error: ModelError,
}

/// Whether a part of the robot is as `robot.toml` says that it was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fidelity {
    /// As `robot.toml` has it.
    AsBuilt,
    /// Perfect: drives take angle, speed and torque at every step, at once, without play and friction; senses tell the truth at
    /// every tick.
    #[default]
    Ideal,
}

/// How the robot in the world differs from the model that its controller knows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModelError {
    /// Factor on the mass and inertia of every link that has both in the model file.
    pub mass: f64,
    /// Shift of the base link's centre of mass in its frame, m.
    pub base_shift: [f64; 3],
    /// Dry friction of every joint as a share of its torque limit, in [0, 0.5].
    pub joint_friction: f64,
}

impl Default for ModelError {
    fn default() -> Self {
        Self { mass: 1.0, base_shift: [0.0; 3], joint_friction: 0.0 }
    }
}

/// The ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pitch {
    /// Sliding friction between sole and ground, above 0. Lower is more slippery.
    pub friction: f64,
    /// Time constant of the contact between sole and ground, s, at least 0.004. Larger is softer.
    pub softness: f64,
    /// Sliding friction between ball and ground.
    pub ball_friction: f64,
}

impl Default for Pitch {
    fn default() -> Self {
        Self { friction: 0.9, softness: 0.008, ball_friction: 0.6 }
    }
}

/// A collision with the ball, as [`crate::contact_law`] turns it into MuJoCo's terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImpactLaw {
    /// Half period of the undamped contact, s: how long an undamped collision of free bodies lasts.
    pub contact_time: f64,
    /// Coefficient of restitution of two free bodies, in (0, 1).
    pub restitution: f64,
    /// Sliding friction.
    pub friction: f64,
}

impl Default for ImpactLaw {
    /// Foot on ball: 9 ms and 0.65. Measured with humans: under 10 ms, 0.5 to 0.65, less at higher speeds (Andersen 2008). Their
    /// feet are at 15 to 25 m/s, robots' at 0.5 to 11 m/s: the upper end is shipped. It does not fall with speed, since the
    /// contact law's restitution is one number (see [`crate::contact_law`]) and no source gives its slope below 15 m/s.
    fn default() -> Self {
        Self { contact_time: 0.009, restitution: 0.65, friction: 0.5 }
    }
}

/// Time steps, s. The near step holds while ball and foot could meet within a few far steps, so that a contact never
/// starts inside a far step: that is what makes a soft contact gain energy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Step {
    /// Period at which commands are taken and sensors are read, s; a whole multiple of the far step. It belongs to the robot,
    /// not to the integration: a re-run in finer steps keeps it.
    pub tick: f64,
    /// Step away from the ball, s.
    pub far: f64,
    /// Step near the ball, s; the far step is a whole multiple of it.
    pub near: f64,
    /// Gap between the ball and a striking geom that counts as near even where they do not move, m.
    pub near_distance: f64,
}

impl Default for Step {
    fn default() -> Self {
        Self { tick: 0.002, far: 0.001, near: 0.00025, near_distance: 0.005 }
    }
}

impl Step {
    /// How many far steps make a tick.
    #[must_use]
    pub fn far_per_tick(&self) -> usize {
        // Validated to be a small whole number.
        (self.tick / self.far).round().max(1.0) as usize
    }

    /// The same ticks in steps a `factor`th as long.
    #[must_use]
    pub fn finer(&self, factor: f64) -> Self {
        Self { far: self.far / factor, near: self.near / factor, ..*self }
    }

    /// How many near steps make a far one.
    #[must_use]
    pub fn near_per_far(&self) -> usize {
        // Validated to be a small whole number.
        (self.far / self.near).round().max(1.0) as usize
    }
}

/// Standard deviations of white sensor noise, and the delay of all sensors. Zero by default: a perfect sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorNoise {
    /// Joint angle, rad.
    pub joint_position: f64,
    /// Joint speed, rad/s.
    pub joint_velocity: f64,
    /// Angular velocity, rad/s.
    pub gyro: f64,
    /// Specific force, m/s^2.
    pub accelerometer: f64,
    /// Orientation estimate, rad about each axis.
    pub orientation: f64,
    /// Contact force, as a share of the force.
    pub contact_force: f64,
    /// Ball position, m on each horizontal axis.
    pub ball: f64,
    /// Delay of all readings, s; rounded to whole ticks.
    pub delay: f64,
    /// Further delay of the ball's sight, s.
    pub ball_delay: f64,
}

/// A constant of a world that is not the default one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// Path of the field, like `ball.mass`.
    pub key: String,
    /// Its value in the default world.
    pub default: serde_json::Value,
    /// Its value here.
    pub value: serde_json::Value,
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {} (default {})", self.key, self.value, self.default)
    }
}

impl WorldSettings {
    /// With the drives and senses of `robot` as they were built, and ticks of at most two milliseconds of which a whole number
    /// makes a cycle of its bus.
    #[must_use]
    pub fn as_built(self, robot: &Robot) -> Self {
        let Step { tick, far, near, near_distance } = self.step;
        let whole = |long: f64, short: f64| long / (long / short - 1e-9).ceil().max(1.0);
        let tick = whole(robot.drives.period, tick);
        let far = whole(tick, far);
        let step = Step { tick, far, near: whole(far, near), near_distance };
        Self { drives: Fidelity::AsBuilt, senses: Fidelity::AsBuilt, step, ..self }
    }

    /// With ideal drives and senses; the steps stay.
    #[must_use]
    pub fn ideal(self) -> Self {
        Self { drives: Fidelity::Ideal, senses: Fidelity::Ideal, ..self }
    }

    /// In which constants this world differs from `default`, the robot's own world; in the order of their keys.
    #[must_use]
    pub fn changes(&self, default: &Self) -> Vec<Change> {
        let tree = |settings: &Self| serde_json::to_value(settings).unwrap_or_default();
        let mut found = Vec::new();
        differences(String::new(), &tree(default), &tree(self), &mut found);
        found
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the first field whose value cannot be.
    pub fn validate(&self) -> Result<(), SimError> {
        let check = |field: &str, value: f64, good: bool, expected: &str| {
            if good && value.is_finite() {
                return Ok(());
            }
            Err(SimError::Setting { field: field.into(), found: value.to_string(), expected: expected.into() })
        };
        let positive = |field: &str, value: f64| check(field, value, value > 0.0, "a number above 0");
        let not_negative = |field: &str, value: f64| check(field, value, value >= 0.0, "a number of at least 0");
        positive("pitch.friction", self.pitch.friction)?;
        check("pitch.softness", self.pitch.softness, self.pitch.softness >= 0.004, "at least 0.004 s")?;
        not_negative("pitch.ball_friction", self.pitch.ball_friction)?;
        positive("ball.mass", self.ball.mass)?;
        positive("ball.radius", self.ball.radius)?;
        not_negative("ball.drag", self.ball.drag)?;
        not_negative("ball.rolling_deceleration", self.ball.rolling_deceleration)?;
        for (name, law) in [("impact", &self.impact), ("ball.rebound", &self.ball.rebound)] {
            positive(&format!("{name}.contact_time"), law.contact_time)?;
            let e = law.restitution;
            check(&format!("{name}.restitution"), e, e > 0.0 && e < 1.0, "a number between 0 and 1")?;
            not_negative(&format!("{name}.friction"), law.friction)?;
        }
        positive("model_error.mass", self.model_error.mass)?;
        for shift in self.model_error.base_shift {
            check("model_error.base_shift", shift, shift.abs() <= 0.3, "a shift of at most 0.3 m")?;
        }
        let friction = self.model_error.joint_friction;
        check("model_error.joint_friction", friction, (0.0..=0.5).contains(&friction), "a share in [0, 0.5]")?;
        positive("step.far", self.step.far)?;
        positive("step.near", self.step.near)?;
        positive("step.near_distance", self.step.near_distance)?;
        positive("step.tick", self.step.tick)?;
        let whole =
            |multiple: f64| (multiple - multiple.round()).abs() < 1e-6 && (1.0..=10_000.0).contains(&multiple.round());
        check("step.far", self.step.far, whole(self.step.tick / self.step.far), "a whole fraction of step.tick")?;
        check("step.near", self.step.near, whole(self.step.far / self.step.near), "a whole fraction of step.far")?;
        let noise = &self.sensors;
        for (field, value) in [
            ("joint_position", noise.joint_position),
            ("joint_velocity", noise.joint_velocity),
            ("gyro", noise.gyro),
            ("accelerometer", noise.accelerometer),
            ("orientation", noise.orientation),
            ("contact_force", noise.contact_force),
            ("ball", noise.ball),
            ("delay", noise.delay),
            ("ball_delay", noise.ball_delay),
        ] {
            not_negative(&format!("sensors.{field}"), value)?;
        }
        check("sensors.delay", noise.delay, noise.delay <= 1.0, "at most 1 s")?;
        check("sensors.ball_delay", noise.ball_delay, noise.ball_delay <= 1.0, "at most 1 s")
    }
}

/// Adds every leaf in which two trees of settings differ.
fn differences(key: String, default: &serde_json::Value, value: &serde_json::Value, found: &mut Vec<Change>) {
    if let (Some(before), Some(after)) = (default.as_object(), value.as_object()) {
        let missing = serde_json::Value::Null;
        for name in before.keys().chain(after.keys().filter(|name| !before.contains_key(*name))) {
            let path = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            differences(path, before.get(name).unwrap_or(&missing), after.get(name).unwrap_or(&missing), found);
        }
    } else if default != value {
        found.push(Change { key, default: default.clone(), value: value.clone() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_constant_is_named_with_both_values() {
        let default = WorldSettings::default();
        assert_eq!(default.changes(&default), []);
        let mut other = default;
        other.ball.mass = 0.02;
        other.model_error.base_shift[1] = 0.1;
        let changes = other.changes(&default);
        let keys: Vec<&str> = changes.iter().map(|change| change.key.as_str()).collect();
        assert_eq!(keys, ["ball.mass", "model_error.base_shift"]);
        assert_eq!((changes[0].default.as_f64(), changes[0].value.as_f64()), (Some(0.43), Some(0.02)));
        assert_eq!(changes[0].to_string(), "ball.mass 0.02 (default 0.43)");
    }
}
