//! What a player believes and does at a moment, for reports.

use instep_behaviour::{Action, BallState, GazeMode, Reason, Role};
use instep_field::Pose;
use serde::Serialize;

use crate::legs::Stage;

/// What a player believes and does at a moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// s.
    pub time: f64,
    /// Own pose, as believed.
    pub pose: Pose,
    /// Standard deviation of its position, m.
    pub pose_std: f64,
    /// Whether the pose may be believed.
    pub located: bool,
    /// What is known of the ball.
    pub ball: BallState,
    /// Where it is believed, field frame, m; without meaning while it is lost.
    pub ball_position: [f64; 2],
    /// m/s.
    pub ball_velocity: [f64; 2],
    /// Opponents as remembered, m.
    pub opponents: Vec<[f64; 2]>,
    /// Role.
    pub role: Role,
    /// What is done.
    pub action: Action,
    /// What the legs are at.
    pub stage: Stage,
    /// Velocity that is asked of them, m/s, m/s, rad/s.
    pub velocity: [f64; 3],
    /// What the neck does.
    pub gaze: GazeMode,
    /// Where the ball shall go, m.
    pub target: Option<[f64; 2]>,
    /// Options that were weighed.
    pub reasons: Vec<Reason>,
}
