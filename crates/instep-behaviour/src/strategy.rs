//! A strategy: all numbers by which one team plays otherwise than another. A file names only what differs from the
//! default strategy.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::BehaviourError;
use crate::error::{read, within};

/// How a team plays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Strategy {
    /// Its name in tables and reports.
    pub name: String,
    /// One line about it.
    pub description: String,
    /// Weights of the costs of eq. (11).
    pub weights: Weights,
    /// When a player shoots on goal.
    pub shot: ShotSettings,
    /// Who does what.
    pub roles: RoleSettings,
    /// Where those stand that do not have the ball.
    pub positions: Positions,
}

/// Weights of eq. (11); the costs that they weigh have no unit and lie from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Weights {
    /// w_a: for large circles, which forgive an inexact kick.
    pub area: f64,
    /// w_theta_G: for kicks without turning round the ball.
    pub goal_angle: f64,
    /// w_d_G: for targets near the opponents' goal.
    pub goal_distance: f64,
    /// w_s: for targets near oneself.
    pub own_distance: f64,
    /// w_t: for targets near a mate.
    pub team_distance: f64,
    /// w_o: for targets far from opponents.
    pub opponent_distance: f64,
    /// w_b: for ways that no opponent blocks.
    pub block: f64,
}

/// When a player shoots on goal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShotSettings {
    /// Least forecast chance of a goal; 0: always shoot, blocked or not (paper 4's baseline).
    pub least_chance: f64,
    /// Reach of an opponent beyond its body that the forecast counts as blocked, m.
    pub opponent_reach: f64,
    /// Spread of the direction that the forecast counts with: this times the kick's own.
    pub spread_factor: f64,
    /// Largest turn round the ball that a shot may need, rad; beyond it, a pass or a dribble is weighed.
    pub most_turn: f64,
}

/// Who does what.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RoleSettings {
    /// Number 1 keeps the goal.
    pub keeper: bool,
    /// Advantage of the player that has the role already, s of way to the ball (against flicker).
    pub hysteresis: f64,
    /// Least time in a role, s.
    pub dwell: f64,
    /// Of those without the ball, the first defends; else it supports the striker.
    pub defender_first: bool,
    /// The keeper goes for a ball nearer than this to its goal's middle, m.
    pub keeper_clears: f64,
}

/// Where those stand that do not have the ball.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Positions {
    /// The keeper before its goal line, m.
    pub keeper_out: f64,
    /// The defender, as share of the way from the own goal to the ball.
    pub defender_share: f64,
    /// The supporter ahead of the ball, toward the opponents' goal, m.
    pub support_ahead: f64,
    /// The supporter beside the ball, m.
    pub support_beside: f64,
    /// Distance from the ball while opponents take a restart, beyond what the rules ask, m.
    pub restart_margin: f64,
}

impl Default for Strategy {
    fn default() -> Self {
        Self {
            name: "default".to_owned(),
            description: "Shoots whenever the goal is before it, stays close behind the ball with a second player, and lets the keeper come out".to_owned(),
            weights: Weights::default(),
            shot: ShotSettings::default(),
            roles: RoleSettings::default(),
            positions: Positions::default(),
        }
    }
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            area: 0.31,
            goal_angle: 0.26,
            goal_distance: 3.78,
            own_distance: 0.66,
            team_distance: 0.08,
            opponent_distance: 0.64,
            block: 1.15,
        }
    }
}

impl Default for ShotSettings {
    fn default() -> Self {
        Self { least_chance: 0.0, opponent_reach: 0.15, spread_factor: 1.0, most_turn: 1.58 }
    }
}

impl Default for RoleSettings {
    fn default() -> Self {
        Self { keeper: true, hysteresis: 2.5, dwell: 1.5, defender_first: true, keeper_clears: 3.65 }
    }
}

impl Default for Positions {
    fn default() -> Self {
        Self { keeper_out: 0.95, defender_share: 0.76, support_ahead: 0.12, support_beside: 1.84, restart_margin: 0.3 }
    }
}

impl Strategy {
    /// Reads a strategy's TOML file.
    ///
    /// # Errors
    /// [`BehaviourError`] with file and line, or with file and the path of the value that cannot be.
    pub fn load(path: &Path) -> Result<Self, BehaviourError> {
        let strategy: Self = toml::from_str(&read(path)?).map_err(|e| BehaviourError::file(path, e))?;
        strategy.validate(&path.display().to_string())?;
        Ok(strategy)
    }

    /// Checks every number; `file` is what an error names.
    ///
    /// # Errors
    /// [`BehaviourError::Value`] for the first that cannot be.
    pub fn validate(&self, file: &str) -> Result<(), BehaviourError> {
        let Weights { area, goal_angle, goal_distance, own_distance, team_distance, opponent_distance, block } =
            self.weights;
        for (field, value) in [
            ("weights.area", area),
            ("weights.goal_angle", goal_angle),
            ("weights.goal_distance", goal_distance),
            ("weights.own_distance", own_distance),
            ("weights.team_distance", team_distance),
            ("weights.opponent_distance", opponent_distance),
            ("weights.block", block),
        ] {
            within(file, field, value, 0.0, 100.0)?;
        }
        within(file, "shot.least_chance", self.shot.least_chance, 0.0, 1.0)?;
        within(file, "shot.opponent_reach", self.shot.opponent_reach, 0.0, 2.0)?;
        within(file, "shot.spread_factor", self.shot.spread_factor, 0.1, 10.0)?;
        within(file, "shot.most_turn", self.shot.most_turn, 0.0, 4.0)?;
        within(file, "roles.hysteresis", self.roles.hysteresis, 0.0, 20.0)?;
        within(file, "roles.dwell", self.roles.dwell, 0.0, 20.0)?;
        within(file, "roles.keeper_clears", self.roles.keeper_clears, 0.0, 20.0)?;
        within(file, "positions.keeper_out", self.positions.keeper_out, 0.1, 10.0)?;
        within(file, "positions.defender_share", self.positions.defender_share, 0.0, 1.0)?;
        within(file, "positions.support_ahead", self.positions.support_ahead, -10.0, 20.0)?;
        within(file, "positions.support_beside", self.positions.support_beside, 0.0, 20.0)?;
        within(file, "positions.restart_margin", self.positions.restart_margin, 0.0, 5.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_survives_its_file() {
        let strategy = Strategy::default();
        strategy.validate("default").unwrap();
        assert_eq!(toml::from_str::<Strategy>(&toml::to_string(&strategy).unwrap()).unwrap(), strategy);
    }

    #[test]
    fn an_unknown_key_and_a_wrong_number_are_named() {
        let error = toml::from_str::<Strategy>("[weights]\narea = 1\nbravery = 3\n").unwrap_err().to_string();
        assert!(error.contains("bravery") && error.contains("line 3"), "{error}");
        let strategy: Strategy = toml::from_str("[shot]\nleast_chance = nan\n").unwrap();
        let error = strategy.validate("a.toml").unwrap_err().to_string();
        assert_eq!(error, "a.toml: shot.least_chance: NaN; expected a number from 0 to 1");
    }
}
