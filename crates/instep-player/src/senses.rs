//! What a player is told at a tick. Whatever is not there stays at its default: a robot without a camera has no sights.

use arrayvec::ArrayVec;
use instep_behaviour::{GameState, MAX_TEAM};
use instep_field::Pose;
use instep_localisation::{LineSight, Sight};
use instep_robot::control::Sensors;
use instep_walk::StateEstimate;

use crate::Message;

/// What a player is told at a tick.
#[derive(Debug, Clone, Default)]
pub struct Senses {
    /// The body's own: time (s, never back), joints, inertial sensor, soles. `body.ball` is ignored: the ball comes with
    /// the sights.
    pub body: Sensors,
    /// What the newest camera frame showed. The same frame may be handed in again; it is used once.
    pub sights: Option<Sights>,
    /// A pose that the league tells, where it does.
    pub fix: Option<Fix>,
    /// The body's state, where the league tells more of it than the own senses do: it overrules walking's estimator.
    pub state: Option<StateEstimate>,
    /// The game, as the own team sees it.
    pub game: GameState,
    /// What mates said since the tick before.
    pub heard: ArrayVec<Message, MAX_TEAM>,
}

/// What one camera frame showed, in the robot frame of the moment when it was taken.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sights {
    /// When the picture was taken, not when it arrived, s of `Sensors::time`.
    pub time: f64,
    /// Where the camera looked, from straight ahead, rad.
    pub gaze_yaw: f64,
    /// The ball.
    pub ball: Option<BallSight>,
    /// Landmarks.
    pub landmarks: Vec<Sight>,
    /// Pieces of lines.
    pub lines: Vec<LineSight>,
    /// Other robots.
    pub robots: Vec<RobotSight>,
}

/// A ball that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallSight {
    /// Its middle, projected on the ground, m.
    pub position: [f64; 2],
    /// Height of its middle over the ground, m.
    pub height: f64,
    /// Standard deviation of each coordinate on the ground, m.
    pub std: f64,
}

/// Another robot that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotSight {
    /// Its middle on the ground, m.
    pub position: [f64; 2],
    /// Of the own team; `None` where that cannot be told: then it counts as an opponent.
    pub mate: Option<bool>,
    /// Its number, where it can be told.
    pub number: Option<u8>,
    /// On the ground.
    pub fallen: bool,
}

/// A pose that the league tells (a simulation server's own senses, a referee's beam).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// When it was true, s of `Sensors::time`.
    pub time: f64,
    /// `field_from_robot`.
    pub pose: Pose,
    /// Standard deviation of x and y, m, and of the heading, rad.
    pub std: [f64; 2],
}
