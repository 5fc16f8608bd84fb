//! A decision as a value: what to do, and every option that was weighed.

use arrayvec::ArrayVec;
use instep_field::Pose;
use serde::Serialize;

use crate::kick::KickRequest;
use crate::memory::BallState;
use crate::roles::Role;
use crate::targets::Target;

/// Most reasons of one decision.
pub(crate) const MOST_REASONS: usize = 16;

/// What the body does, as an action block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    /// Stands: before the game, in SET, sent off, while a kick is on its way.
    Stand,
    /// Gets up.
    GetUp,
    /// Looks for the ball.
    Search,
    /// Walks behind the ball.
    Approach,
    /// Plays the ball a little ahead.
    Dribble,
    /// Kicks: shot or pass.
    Kick,
    /// Walks to its place.
    GoTo,
    /// Stands between ball and own goal.
    Defend,
    /// Keeps the goal.
    KeepGoal,
    /// Takes a restart.
    SetPieceOurs,
    /// Keeps away while the others take one.
    SetPieceTheirs,
    /// Makes way for a robot that is being taken off.
    MakeWay,
}

/// How the body moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// Stands.
    Stand,
    /// Gets up.
    GetUp,
    /// Walks to a pose in the field frame.
    Walk {
        /// Where to.
        pose: Pose,
        /// Round the ball, not through it.
        avoid_ball: bool,
    },
    /// Walks with a velocity in the robot frame, m/s, m/s, rad/s.
    Velocity([f64; 3]),
}

/// What the neck does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GazeMode {
    /// Looks at the ball that it sees.
    #[default]
    Track,
    /// Looks where the ball must be.
    Predict,
    /// Sweeps for the ball.
    Search,
    /// Looks for landmarks.
    Relocalise,
}

/// Where the neck looks.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Gaze {
    /// Why.
    pub mode: GazeMode,
    /// From straight ahead, to the left, rad.
    pub yaw: f64,
    /// Down, rad.
    pub pitch: f64,
}

/// One option that was weighed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reason {
    /// What could be done.
    pub option: &'static str,
    /// What it costs; the least of those that are not rejected is done. Without unit, except for `striker`: s.
    pub cost: f64,
    /// Not done.
    pub rejected: bool,
    /// Why, or why not.
    pub why: &'static str,
}

/// What a player does now, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// The action block.
    pub action: Action,
    /// For the team.
    pub role: Role,
    /// The body's motion.
    pub motion: Motion,
    /// A kick, once its moment has come.
    pub kick: Option<KickRequest>,
    /// The kick that the approach prepares; its moment need not have come.
    pub prepared: Option<KickRequest>,
    /// Where the ball shall go.
    pub target: Option<Target>,
    /// The neck.
    pub gaze: Gaze,
    /// What is known of the ball.
    pub ball: BallState,
    /// All options, in the order in which they were weighed.
    pub reasons: ArrayVec<Reason, MOST_REASONS>,
}
