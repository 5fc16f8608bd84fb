//! Deciding: memory, targets, roles, kicks and gaze (paper 4, section IV-E).
//!
//! [`Player`] is one robot's head: it takes [`Beliefs`] (own pose, memory of ball and players, state of the game) and
//! gives a [`Decision`]: what the body, the kick and the neck shall do, and every option that it weighed with its cost.
//! The same code runs in the game simulator and on a robot. It knows no joints and no pixels, opens no file but in
//! `load` functions, reads no clock and draws no random number; a tick allocates nothing once its buffers have grown.
//!
//! Frames: the field frame of the own team (origin at the centre mark, x toward the goal that it attacks, y left) and
//! the robot frame (x ahead, y left). m, s, rad.

mod belief;
mod body;
mod decision;
mod error;
mod geometry;
mod kick;
mod memory;
mod neck;
mod player;
mod positions;
mod roles;
mod situation;
mod strategy;
mod targets;

pub use belief::{
    Beliefs, GamePhase, GameState, Kicking, MAX_TEAM, Mate, Opponent, OwnState, PlayState, SetPlay, View,
};
pub use body::time_to_ball;
pub use decision::{Action, Decision, Gaze, GazeMode, Motion, Reason};
pub use error::BehaviourError;
pub use geometry::{Circle, Point};
pub use kick::{KickModel, KickRequest, KickTable, Which};
pub use memory::{BallMemory, BallSight, BallState, OpponentMemory, Sight};
pub use player::Player;
pub use roles::Role;
pub use situation::Situation;
pub use strategy::{Positions, RoleSettings, ShotSettings, Strategy, Weights};
pub use targets::{Candidate, Costs, Scene, Target, TargetKind, best_pass, candidates, costs, incircle, open_goal};
