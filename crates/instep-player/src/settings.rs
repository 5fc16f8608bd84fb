//! What a player is made with: its team's strategy, its robot's kicks, and the numbers that are neither.

use std::path::Path;

use instep_behaviour::{KickModel, KickTable, Strategy};
use instep_robot::Robot;
use instep_walk::WalkSettings;
use instep_walk::in_gait::InGaitSettings;
use serde::{Deserialize, Serialize};

use crate::PlayerError;

/// The tuning's file in a robot's folder.
const FILE: &str = "player.toml";
/// The in-gait kick's file in a robot's folder.
const IN_GAIT: &str = "in-gait.toml";

/// What a player is made with.
#[derive(Debug, Clone)]
pub struct PlayerSettings {
    /// How its team plays.
    pub strategy: Strategy,
    /// The kicks that decisions count with; they should be those that the legs have.
    pub kicks: KickTable,
    /// How it walks.
    pub walk: WalkSettings,
    /// How it kicks within the gait; without it the ball is pushed by walking.
    pub in_gait: Option<InGaitSettings>,
    /// All other numbers.
    pub tuning: Tuning,
}

impl PlayerSettings {
    /// For `robot`, from its folder: `walk.toml`, `in-gait.toml` and `player.toml`, as far as they are there. Of `kicks` those
    /// within the gait of this robot are used, when it has `in-gait.toml`; else the ball is pushed.
    ///
    /// # Errors
    /// When a file is not what it should be.
    pub fn load(robot: &Robot, strategy: Strategy, kicks: &KickTable) -> Result<Self, PlayerError> {
        let read = |file: &Path| {
            std::fs::read_to_string(file)
                .map_err(|e| PlayerError::File { file: file.display().to_string(), detail: e.to_string() })
        };
        let in_gait = robot.folder().join(IN_GAIT);
        let in_gait = if in_gait.exists() {
            Some(InGaitSettings::parse(&in_gait.display().to_string(), &read(&in_gait)?)?)
        } else {
            None
        };
        let file = robot.folder().join(FILE);
        let tuning =
            if file.exists() { Tuning::parse(&file.display().to_string(), &read(&file)?)? } else { Tuning::default() };
        let own = kicks.kick.iter().filter(|kick| in_gait.is_some() && kick.in_gait && kick.robot == robot.name);
        let own: Vec<_> = own.cloned().collect();
        let kick = if own.is_empty() { vec![tuning.push.kick(&robot.name)] } else { own };
        Ok(Self { strategy, kicks: KickTable { kick }, walk: WalkSettings::load(robot)?, in_gait, tuning })
    }
}

/// Numbers of a player that are neither its team's nor its walk's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tuning {
    /// Time between two decisions, s.
    pub decide: f64,
    /// Time between two commands to the legs, s.
    pub navigate: f64,
    /// Time between two messages to the team, s.
    pub say: f64,
    /// A mate that has said nothing for this long does not count, s.
    pub mate_forgotten: f64,
    /// Share of what the walk allows that is asked of it: the rest corrects.
    pub walk_share: f64,
    /// The same for side steps: fast ones on top of a fast walk are what a biped falls over.
    pub side_share: f64,
    /// From a change of the asked velocity to its effect, s.
    pub walk_delay: f64,
    /// Time constant with which the velocity follows, s.
    pub walk_lag: f64,
    /// Of the body seen from above, m.
    pub radius: f64,
    /// Nearest that the robot's middle comes to a ball that it walks round, m.
    pub round_ball: f64,
    /// From this tilt it counts as fallen, rad.
    pub fallen_tilt: f64,
    /// Farthest ball that the camera finds, m.
    pub sight_range: f64,
    /// How the ball is pushed.
    pub push: PushSettings,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            decide: 0.1,
            navigate: 0.05,
            say: 0.5,
            mate_forgotten: 4.0,
            walk_share: 0.8,
            side_share: 0.8,
            walk_delay: 0.1,
            walk_lag: 0.4,
            radius: 0.3,
            round_ball: 0.45,
            fallen_tilt: 1.0,
            sight_range: 9.0,
            push: PushSettings::default(),
        }
    }
}

/// How the ball is played by walking into it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PushSettings {
    /// Distance behind the ball where the way through it begins, m.
    pub start: f64,
    /// Speed of the walk through the ball, m/s.
    pub speed: f64,
    /// How far beside the robot's middle the ball is met: before a foot, m.
    pub outward: f64,
    /// Errors across (m) and of the heading (rad) with which it may begin.
    pub begin: [f64; 2],
    /// Errors with which it is given up.
    pub end: [f64; 2],
    /// How fast errors across and of the heading are closed, 1/s.
    pub steer: [f64; 2],
    /// Speed with which a pushed ball leaves, m/s.
    pub ball_speed: f64,
}

impl Default for PushSettings {
    fn default() -> Self {
        Self {
            start: 0.7,
            speed: 0.5,
            outward: 0.1,
            begin: [0.08, 0.25],
            end: [0.30, 0.7],
            steer: [1.0, 1.2],
            ball_speed: 1.0,
        }
    }
}

impl PushSettings {
    /// The push as decisions see it. Its errors are those of a shove by a walking shin: rough.
    fn kick(&self, robot: &str) -> KickModel {
        KickModel {
            engine: "push".into(),
            robot: robot.into(),
            scenario: "none".into(),
            requests: 0,
            hit_rate: 1.0,
            upright_rate: 1.0,
            ball_speed_median: self.ball_speed,
            speed_ratio_median: 1.0,
            direction_error_median_deg: 10.0,
            direction_error_p90_deg: 25.0,
            contact_median_s: 0.3,
            speed_spread: 0.3,
            recovery: 0.0,
            ball_ahead: 0.3,
            in_gait: true,
            source: "a guess: the walk goes through the ball".into(),
        }
    }
}

impl Tuning {
    /// Reads `text`, the content of `file`.
    ///
    /// # Errors
    /// When it is not what it should be: line, or path of the value.
    pub fn parse(file: &str, text: &str) -> Result<Self, PlayerError> {
        let tuning: Self = toml::from_str(text)
            .map_err(|e| PlayerError::File { file: file.into(), detail: e.to_string().trim_end().to_owned() })?;
        tuning.validate(file)?;
        Ok(tuning)
    }

    /// Checks every number; `file` is what an error names.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn validate(&self, file: &str) -> Result<(), PlayerError> {
        let push = &self.push;
        for (field, value, low, high) in [
            ("decide", self.decide, 0.0, 2.0),
            ("navigate", self.navigate, 0.0, 2.0),
            ("say", self.say, 0.0, 60.0),
            ("mate_forgotten", self.mate_forgotten, 0.1, 60.0),
            ("walk_share", self.walk_share, 0.05, 1.0),
            ("side_share", self.side_share, 0.05, 1.0),
            ("walk_delay", self.walk_delay, 0.0, 1.0),
            ("walk_lag", self.walk_lag, 0.0, 3.0),
            ("radius", self.radius, 0.05, 2.0),
            ("round_ball", self.round_ball, 0.1, 2.0),
            ("fallen_tilt", self.fallen_tilt, 0.3, 1.5),
            ("sight_range", self.sight_range, 0.5, 200.0),
            ("push.start", push.start, 0.2, 3.0),
            ("push.speed", push.speed, 0.05, 5.0),
            ("push.outward", push.outward, 0.0, 0.5),
            ("push.begin[0]", push.begin[0], 0.01, 1.0),
            ("push.begin[1]", push.begin[1], 0.01, 3.0),
            ("push.end[0]", push.end[0], push.begin[0], 2.0),
            ("push.end[1]", push.end[1], push.begin[1], 3.2),
            ("push.steer[0]", push.steer[0], 0.0, 10.0),
            ("push.steer[1]", push.steer[1], 0.0, 10.0),
            ("push.ball_speed", push.ball_speed, 0.1, 20.0),
        ] {
            if !(value >= low && value <= high) {
                return Err(PlayerError::Value {
                    place: format!("{file}: {field}"),
                    found: value.to_string(),
                    expected: format!("a number from {low} to {high}"),
                });
            }
        }
        Ok(())
    }
}
