//! What navigation is told of a robot and of how careful to be.

use serde::{Deserialize, Serialize};

use crate::NavigationError;

/// A robot as navigation knows it: how fast it may be told to walk, and how it answers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotLimits {
    /// Fastest ahead, m/s.
    pub forward: f64,
    /// Fastest back, m/s.
    pub backward: f64,
    /// Fastest sideways, m/s.
    pub sideways: f64,
    /// Fastest turn, rad/s.
    pub turn: f64,
    /// Largest change of the commanded velocity, m/s^2.
    pub acceleration: f64,
    /// Largest change of the commanded turn, rad/s^2.
    pub turn_acceleration: f64,
    /// Time constant with which the velocity follows its command, s; about a step.
    pub lag: f64,
    /// From a command to its first effect, s.
    pub delay: f64,
    /// Of the body seen from above, m.
    pub radius: f64,
}

impl Default for RobotLimits {
    fn default() -> Self {
        Self {
            forward: 1.0,
            backward: 0.4,
            sideways: 0.4,
            turn: 1.0,
            acceleration: 1.2,
            turn_acceleration: 3.0,
            lag: 0.3,
            delay: 0.1,
            radius: 0.25,
        }
    }
}

/// How the velocity is found that follows the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tracker {
    /// Nonlinear predictive control: what a robot runs.
    #[default]
    Nonlinear,
    /// One quadratic program about the last solution.
    Linearised,
    /// The path's own velocity and a proportional correction: for thousands of games at once. Same paths, same goals,
    /// same causes; obstacles are avoided by the path alone.
    Direct,
}

/// What of the robot's answer the prediction knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Lag and delay.
    #[default]
    Lagged,
    /// Paper 4, eq 6 as printed: the velocity is the command at once, effort counted from standstill.
    Printed,
}

/// How careful to be. The defaults are measured (`docs/navigate.md`).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// What follows the path.
    pub tracker: Tracker,
    /// What the prediction knows of the robot.
    pub model: Model,
    /// Cost of a turn on the path, m/rad. More makes ways straighter and longer.
    pub turn_cost: f64,
    /// Each metre inside a keep-out counts as this many more, where start or goal lie inside one.
    pub inside_price: f64,
    /// A path round the other side must be shorter by this, m: what stops dithering.
    pub side_bonus: f64,
    /// Room between a keep-out and the path's polygon, m.
    pub path_margin: f64,
    /// Room that the prediction keeps to a keep-out, m.
    pub keep_out_margin: f64,
    /// Room that the robot's middle keeps to the edge of the field's border strip, m.
    pub border_margin: f64,
    /// Time between two paths, s.
    pub plan_period: f64,
    /// Within this distance of the goal the robot turns to its heading, m.
    pub turn_in: f64,
    /// Distance (m) and angle (rad) that count as there.
    pub there: [f64; 2],
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tracker: Tracker::Nonlinear,
            model: Model::Lagged,
            turn_cost: 0.5,
            inside_price: 8.0,
            side_bonus: 0.6,
            path_margin: 0.12,
            keep_out_margin: 0.08,
            border_margin: 0.3,
            plan_period: 0.1,
            turn_in: 0.8,
            there: [0.04, 0.04],
        }
    }
}

fn within(
    field: &'static str,
    value: f64,
    [low, high]: [f64; 2],
    expected: &'static str,
) -> Result<(), NavigationError> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(NavigationError::Value { field, found: value.to_string(), expected })
}

impl RobotLimits {
    /// # Errors
    /// The first number that no robot has.
    pub fn validate(&self) -> Result<(), NavigationError> {
        let speed = ([1e-3, 20.0], "0.001 to 20");
        within("forward", self.forward, speed.0, speed.1)?;
        within("backward", self.backward, speed.0, speed.1)?;
        within("sideways", self.sideways, speed.0, speed.1)?;
        within("turn", self.turn, speed.0, speed.1)?;
        within("acceleration", self.acceleration, [1e-3, 100.0], "0.001 to 100")?;
        within("turn_acceleration", self.turn_acceleration, [1e-3, 100.0], "0.001 to 100")?;
        within("lag", self.lag, [0.0, 3.0], "0 to 3 s")?;
        within("delay", self.delay, [0.0, 1.0], "0 to 1 s")?;
        within("radius", self.radius, [0.0, 2.0], "0 to 2 m")
    }

    /// Lowest and highest command.
    pub(crate) fn bounds(&self) -> [[f64; 3]; 2] {
        [[-self.backward, -self.sideways, -self.turn], [self.forward, self.sideways, self.turn]]
    }

    /// Largest change of a command a second.
    pub(crate) fn rates(&self) -> [f64; 3] {
        [self.acceleration, self.acceleration, self.turn_acceleration]
    }

    /// Fastest in a direction off the heading by `angle`, m/s.
    pub(crate) fn speed_toward(&self, angle: f64) -> f64 {
        let (s, c) = angle.sin_cos();
        let ahead = if c >= 0.0 { self.forward } else { self.backward };
        // An ellipse inside the box of the limits.
        1.0 / (c / ahead).hypot(s / self.sideways)
    }
}

impl Settings {
    /// # Errors
    /// The first number that cannot be.
    pub fn validate(&self) -> Result<(), NavigationError> {
        within("turn_cost", self.turn_cost, [0.0, 100.0], "0 to 100 m/rad")?;
        within("inside_price", self.inside_price, [0.0, 1000.0], "0 to 1000")?;
        within("side_bonus", self.side_bonus, [0.0, 10.0], "0 to 10 m")?;
        within("path_margin", self.path_margin, [0.0, 1.0], "0 to 1 m")?;
        within("keep_out_margin", self.keep_out_margin, [0.0, 1.0], "0 to 1 m")?;
        within("border_margin", self.border_margin, [-5.0, 2.0], "-5 to 2 m")?;
        within("plan_period", self.plan_period, [0.0, 2.0], "0 to 2 s")?;
        within("turn_in", self.turn_in, [0.0, 10.0], "0 to 10 m")?;
        within("there[0]", self.there[0], [1e-3, 1.0], "0.001 to 1 m")?;
        within("there[1]", self.there[1], [1e-3, 1.0], "0.001 to 1 rad")
    }
}
