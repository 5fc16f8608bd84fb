//! The engines that KickBench knows, by name, and what it needs to know of a robot.

use std::path::Path;
use std::sync::Arc;

use instep_kick::KickEngine;
use instep_kick::dynamic::{DynamicKick, DynamicSettings};
use instep_robot::Robot;
use instep_sim::settings::{Ball, WorldSettings};

use crate::BenchError;
use crate::scenario::Size;

/// Names of the engines: `dynamic`, and the same with its closed loop off.
pub const ENGINES: [&str; 2] = ["dynamic", "dynamic-open"];

/// A robot with what its trials share.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The robot.
    pub robot: Arc<Robot>,
    /// The dynamic engine's settings.
    pub dynamic: DynamicSettings,
    /// Its size and its ball.
    pub size: Size,
    /// The footprint's origin in the world when the robot stands, m.
    pub footprint: [f64; 2],
}

impl Subject {
    /// Loads `name` from the folder of robots.
    ///
    /// # Errors
    /// When the robot or its engine's settings cannot be read.
    pub fn load(robots: &Path, name: &str) -> Result<Self, BenchError> {
        let folder = robots.join(name);
        let robot = Arc::new(Robot::load(&folder)?);
        let dynamic = DynamicSettings::load(&folder)?;
        Ok(Self::new(robot, dynamic))
    }

    /// For a loaded robot, with the engine's settings from its folder.
    ///
    /// # Errors
    /// When the engine's settings cannot be read.
    pub fn of(robot: Robot) -> Result<Self, BenchError> {
        let dynamic = DynamicSettings::load(robot.model_file().parent().unwrap_or(Path::new(".")))?;
        Ok(Self::new(Arc::new(robot), dynamic))
    }

    /// For a robot and its settings.
    #[must_use]
    pub fn new(robot: Arc<Robot>, dynamic: DynamicSettings) -> Self {
        let data = robot.data();
        let [left, right] = [0, 1].map(|side| data.point(&robot.legs[side].sole));
        let middle = 0.5 * (left + right);
        let leg = &robot.legs[0];
        let length = |a: usize, b: usize| (data.link_position(a) - data.link_position(b)).norm();
        let strikers = robot.legs.iter().flat_map(|leg| &leg.strike);
        let toes = strikers
            .map(|&geom| {
                let (ends, radius) = data.capsule(geom);
                ends[0].x.max(ends[1].x) + radius - middle.x
            })
            .fold(0.0, f64::max);
        let size = Size {
            leg: length(leg.thigh, leg.shank) + length(leg.shank, leg.foot) - leg.sole.point.z.min(0.0),
            half_width: 0.5 * (left.y - right.y).abs(),
            toes,
            ball: dynamic.ball.radius,
            deceleration: dynamic.ball.deceleration,
        };
        Self { robot, dynamic, size, footprint: [middle.x, middle.y] }
    }

    /// The world's constants for this robot's ball.
    #[must_use]
    pub fn world(&self) -> WorldSettings {
        let mut world = WorldSettings {
            ball: Ball { mass: self.dynamic.ball.mass, radius: self.dynamic.ball.radius },
            ..WorldSettings::default()
        };
        world.pitch.rolling_deceleration = self.dynamic.ball.deceleration;
        // Feet of these robots pass the ball at under 3 m/s: more than twice that times the far step. A light ball needs
        // a finer near step than the default for the audit's 2 %.
        world.step.near_distance = 0.02;
        world.step.near = 0.0001;
        world
    }

    /// The engine called `name`.
    ///
    /// # Errors
    /// When there is none, or it does not fit the robot.
    pub fn engine(&self, name: &str) -> Result<Box<dyn KickEngine + Send>, BenchError> {
        let mut settings = self.dynamic.clone();
        match name {
            "dynamic" => {}
            "dynamic-open" => settings.feedback.on = false,
            _ => {
                return Err(BenchError::Unknown { kind: "engine", found: name.into(), known: ENGINES.join(", ") });
            }
        }
        Ok(Box::new(DynamicKick::new(Arc::clone(&self.robot), settings)?))
    }
}
