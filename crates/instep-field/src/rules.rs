//! The numbers of the rules: players, times, limits of robots.
//!
//! Sources: HL 2025 (RoboCup-Humanoid-TC/Rules) for `adult-2024` and `kid`, HSL 2026 (late drafts of v1.1) for `hsl-*`,
//! rule book SSim2026 of `rcsssmj` 0.2.1 for `simulation` and `fifa`. A number that a book does not give is absent.

use serde::{Deserialize, Serialize};

/// The rules that a field is played under. Times in s, lengths in m, masses in kg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Players of a team on the field.
    pub players: usize,
    /// Halves of a game.
    pub halves: usize,
    /// Length of a half.
    pub half_time: f64,
    /// To walk to the kick-off positions (READY).
    pub ready: Option<f64>,
    /// After a kick-off the ball is free for both after this time.
    pub ball_free_after: f64,
    /// After the whistle the GameController hides PLAYING for this time.
    pub playing_hidden: Option<f64>,
    /// A free kick, throw-in, corner or goal kick must be taken within.
    pub set_play: Option<f64>,
    /// A penalty kick must be taken within.
    pub penalty_kick: Option<f64>,
    /// A player that is sent off stays out.
    pub removal: Option<f64>,
    /// Longer for each repeat.
    pub removal_repeat: Option<f64>,
    /// Longest that a field player may hold the ball.
    pub ball_holding: Option<f64>,
    /// Longest that the keeper may.
    pub keeper_holding: Option<f64>,
    /// No progress near the ball.
    pub stuck_local: Option<f64>,
    /// No progress anywhere.
    pub stuck_global: Option<f64>,
    /// A fallen player must begin to get up within.
    pub get_up: Option<f64>,
    /// And has this many tries.
    pub get_up_tries: Option<usize>,
    /// A game ends when a team leads by.
    pub mercy_goals: Option<usize>,
    /// A goal may be scored directly from the kick-off.
    pub direct_goal_from_kick_off: bool,
    /// Lowest and greatest height of a robot.
    pub robot_height: Option<[f64; 2]>,
    /// Greatest mass of a robot.
    pub robot_mass: Option<f64>,
}

impl Rules {
    /// The rules that the field of this name (one of [`crate::FIELD_NAMES`]) is played under; an own field is played
    /// under those of the adult size.
    pub fn for_field(name: &str) -> Rules {
        match name {
            "kid" => Rules { players: 4, robot_height: Some([0.4, 1.0]), ..HL },
            "hsl-s" => Rules { players: 4, robot_height: Some([0.0, 1.10]), robot_mass: Some(15.0), ..HSL },
            "hsl-m" => Rules { players: 3, robot_height: Some([0.0, 1.25]), robot_mass: Some(25.0), ..HSL },
            "hsl-l" => Rules { players: 3, robot_height: Some([0.0, 1.90]), robot_mass: Some(80.0), ..HSL },
            "simulation" => SIMULATION,
            "fifa" => Rules { players: 11, ..SIMULATION },
            _ => HL,
        }
    }
}

/// Humanoid League, adult size. In 2024 teams of two played (paper 4); the book of 2025 says three.
const HL: Rules = Rules {
    players: 3,
    halves: 2,
    half_time: 600.0,
    ready: Some(30.0),
    ball_free_after: 10.0,
    playing_hidden: None,
    set_play: None,
    penalty_kick: None,
    removal: Some(10.0),
    removal_repeat: None,
    ball_holding: None,
    keeper_holding: None,
    stuck_local: None,
    stuck_global: None,
    get_up: None,
    get_up_tries: None,
    mercy_goals: None,
    direct_goal_from_kick_off: false,
    robot_height: Some([1.0, 2.0]),
    robot_mass: None,
};

const HSL: Rules = Rules {
    players: 3,
    halves: 2,
    half_time: 600.0,
    ready: Some(45.0),
    ball_free_after: 10.0,
    playing_hidden: Some(10.0),
    set_play: Some(45.0),
    penalty_kick: Some(60.0),
    removal: Some(45.0),
    removal_repeat: Some(10.0),
    ball_holding: Some(5.0),
    keeper_holding: Some(10.0),
    stuck_local: Some(10.0),
    stuck_global: Some(30.0),
    get_up: Some(20.0),
    get_up_tries: Some(3),
    mercy_goals: Some(10),
    direct_goal_from_kick_off: false,
    robot_height: None,
    robot_mass: None,
};

const SIMULATION: Rules = Rules {
    players: 7,
    halves: 2,
    half_time: 300.0,
    ready: None,
    ball_free_after: 15.0,
    playing_hidden: None,
    set_play: Some(15.0),
    penalty_kick: None,
    removal: None,
    removal_repeat: None,
    ball_holding: None,
    keeper_holding: None,
    stuck_local: None,
    stuck_global: None,
    get_up: Some(15.0),
    get_up_tries: None,
    mercy_goals: None,
    direct_goal_from_kick_off: false,
    robot_height: None,
    robot_mass: None,
};
