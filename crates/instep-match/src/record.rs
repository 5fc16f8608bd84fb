//! A game as it can be looked at: frames with truth, beliefs, roles, decisions and targets.

use instep_behaviour::{Action, BallState, Reason, Role, Target};
use serde::Serialize;

use crate::game::Match;
use crate::referee::Event;
use crate::robot::Status;

/// Frames a second.
pub(crate) const RATE: f64 = 5.0;

/// A recorded game, in the world's frame.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Recording {
    /// In the order of time.
    pub frames: Vec<Frame>,
    /// Everything that the referee saw or did.
    pub events: Vec<Event>,
}

/// One moment.
#[derive(Debug, Clone, Serialize)]
pub struct Frame {
    /// s.
    pub time: f64,
    /// Left of the half, s.
    pub left: f64,
    /// READY, SET, PLAYING and so on, with the restart.
    pub state: String,
    /// Goals.
    pub score: [u32; 2],
    /// x, y, m.
    pub ball: [f32; 2],
    /// In the match's order.
    pub robots: Vec<RobotFrame>,
}

/// One robot at one moment.
#[derive(Debug, Clone, Serialize)]
pub struct RobotFrame {
    /// x, y, heading.
    pub pose: [f32; 3],
    /// Where it believes to be.
    pub believed: [f32; 2],
    /// Neck, rad.
    pub gaze: f32,
    /// 0 plays, 1 on the ground, 2 sent off.
    pub status: u8,
    /// For the team.
    pub role: Option<Role>,
    /// Action block.
    pub action: Option<Action>,
    /// Where it believes the ball.
    pub ball: Option<[f32; 2]>,
    /// What it knows of it.
    pub ball_state: BallState,
    /// Target: x, y, radius.
    pub target: Option<[f32; 3]>,
    /// Options: name, cost, rejected, why.
    pub reasons: Vec<(&'static str, f32, bool, &'static str)>,
}

pub(crate) fn round(value: f64) -> f32 {
    ((value * 1000.0).round() / 1000.0) as f32
}

impl Frame {
    /// The present moment of a match.
    pub fn of(game: &Match) -> Self {
        let referee = game.referee();
        let robots = game.robots().iter().map(|robot| {
            let sign = if robot.team == 0 { 1.0 } else { -1.0 };
            let world = |p: [f64; 2]| [round(sign * p[0]), round(sign * p[1])];
            let decision = robot.decision.as_ref();
            let active = robot.is_active();
            let ball = robot.beliefs.ball;
            let reason = |r: &Reason| (r.option, round(r.cost.min(1e6)), r.rejected, r.why);
            let circle = |t: Target| {
                let [x, y] = world(t.point);
                [x, y, round(t.radius)]
            };
            RobotFrame {
                pose: [round(robot.pose.x), round(robot.pose.y), round(robot.pose.heading)],
                believed: world(robot.beliefs.own.pose.position()),
                gaze: round(robot.gaze_yaw),
                status: match robot.status {
                    Status::Active => 0,
                    Status::Down { .. } => 1,
                    Status::Removed { .. } => 2,
                },
                role: decision.map(|d| d.role),
                action: decision.map(|d| d.action),
                ball: (active && ball.is_known()).then(|| world(ball.position)),
                ball_state: ball.state,
                target: decision.filter(|_| active).and_then(|d| d.target).map(circle),
                reasons: decision.map(|d| d.reasons.iter().map(reason).collect()).unwrap_or_default(),
            }
        });
        Self {
            time: (game.time() * 100.0).round() / 100.0,
            left: referee.time_left.round(),
            state: format!("{:?} {:?}", referee.state, referee.set_play),
            score: referee.score,
            ball: game.ball().position.map(round),
            robots: robots.collect(),
        }
    }
}
