//! What a player believes: all that a decision may use.

use arrayvec::ArrayVec;
use instep_field::Pose;
use serde::{Deserialize, Serialize};

use crate::geometry::Circle;
use crate::memory::BallMemory;
use crate::roles::Role;

/// Most players of a team.
pub const MAX_TEAM: usize = 11;

/// All that a decision may use, in the own team's field frame.
#[derive(Debug, Clone)]
pub struct Beliefs {
    /// Time, s; never goes back.
    pub time: f64,
    /// Own number, from 1. Number 1 keeps the goal where the strategy has a keeper.
    pub number: u8,
    /// Oneself.
    pub own: OwnState,
    /// The ball.
    pub ball: BallMemory,
    /// Team mates, by what they said last.
    pub mates: ArrayVec<Mate, MAX_TEAM>,
    /// Opponents that one remembers.
    pub opponents: ArrayVec<Opponent, MAX_TEAM>,
    /// The game.
    pub game: GameState,
    /// What the camera sees.
    pub view: View,
}

/// Oneself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnState {
    /// `field_from_robot`.
    pub pose: Pose,
    /// Of x (m), y (m) and heading (rad).
    pub covariance: [[f64; 3]; 3],
    /// In the robot frame, m/s, m/s, rad/s.
    pub velocity: [f64; 3],
    /// On the ground.
    pub fallen: bool,
    /// A kick is on its way.
    pub kicking: bool,
    /// Where the neck looks, from straight ahead, rad.
    pub gaze_yaw: f64,
}

impl OwnState {
    /// Standing at a pose that is known.
    pub fn at(pose: Pose) -> Self {
        Self { pose, covariance: [[0.0; 3]; 3], velocity: [0.0; 3], fallen: false, kicking: false, gaze_yaw: 0.0 }
    }

    /// Standard deviation of the position, m.
    pub fn position_std(&self) -> f64 {
        (self.covariance[0][0] + self.covariance[1][1]).max(0.0).sqrt()
    }
}

/// A team mate, by what it said last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mate {
    /// Number, from 1.
    pub number: u8,
    /// Where it is.
    pub pose: Pose,
    /// What it does.
    #[serde(default)]
    pub role: Role,
    /// Its own time to the ball, s.
    #[serde(default = "far")]
    pub time_to_ball: f64,
    /// Neither fallen nor sent off.
    #[serde(default = "yes")]
    pub able: bool,
    /// Being taken off the field.
    #[serde(default)]
    pub penalised: bool,
}

/// An opponent that one remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opponent {
    /// Where it is.
    pub circle: Circle,
    /// m/s.
    pub velocity: [f64; 2],
    /// Being taken off the field.
    pub penalised: bool,
}

fn far() -> f64 {
    1e3
}

fn yes() -> bool {
    true
}

/// What the camera sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct View {
    /// Half of the horizontal field of view, rad.
    pub half_angle: f64,
    /// Farthest ball that is found, m.
    pub range: f64,
    /// How far the neck turns to either side, rad.
    pub neck_limit: f64,
}

impl Default for View {
    fn default() -> Self {
        Self { half_angle: 0.9, range: 9.0, neck_limit: 1.6 }
    }
}

/// The game, as one team sees it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GameState {
    /// Part of the game.
    pub phase: GamePhase,
    /// State of play.
    pub state: PlayState,
    /// Restart that goes on.
    pub set_play: SetPlay,
    /// Who takes it.
    pub kicking: Kicking,
    /// Left of the half, s.
    pub time_left: f64,
    /// Goals, ours first.
    pub score: [u32; 2],
    /// Oneself is sent off.
    pub penalised: bool,
}

impl Default for GameState {
    fn default() -> Self {
        Self {
            phase: GamePhase::Normal,
            state: PlayState::Playing,
            set_play: SetPlay::None,
            kicking: Kicking::Nobody,
            time_left: 600.0,
            score: [0; 2],
            penalised: false,
        }
    }
}

/// Part of the game, in the order of the GameController's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GamePhase {
    /// The two halves.
    Normal,
    /// Penalty shoot-out.
    Shootout,
    /// Extra time.
    Extra,
    /// A team's or the referee's time-out.
    Timeout,
}

/// State of play, in the order of the GameController's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlayState {
    /// Before a half.
    Initial,
    /// Players walk to their positions.
    Ready,
    /// Nobody moves; the whistle comes.
    Set,
    /// The game goes on.
    Playing,
    /// A half is over.
    Finished,
}

/// A restart, in the order of the GameController's numbers. A kick-off is [`SetPlay::None`] with a kicking team.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SetPlay {
    /// Open play, or a kick-off.
    None,
    /// A goal may follow directly.
    DirectFreeKick,
    /// A second player must touch the ball before a goal.
    IndirectFreeKick,
    /// Penalty kick.
    PenaltyKick,
    /// Throw-in (kicked).
    ThrowIn,
    /// Goal kick.
    GoalKick,
    /// Corner kick.
    CornerKick,
}

/// Who takes a restart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kicking {
    /// Open play.
    Nobody,
    /// Own team.
    Us,
    /// The other team.
    Them,
}
